//! Every field in every format, there and back, and files that must not be read.
#![allow(clippy::unwrap_used)]

use macropulse::formats::{Format, Names, read_pcd, read_range_png, write_cloud};
use macropulse::points::{NO_OBJECT, Outcome, PointCloud, Truth, Viewpoint};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const ROWS: usize = 5;
const COLUMNS: usize = 7;

/// Every third pixel is empty; no two pixels have the same value in any column.
fn cloud(with_truth: bool) -> PointCloud {
    let pixels = ROWS * COLUMNS;
    let empty = |at: usize| at % 3 == 2;
    let each = |value: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (0..pixels).map(|at| if empty(at) { f32::NAN } else { value(at as f32) }).collect()
    };
    let count = |scale: usize| (0..pixels).map(|at| (at * scale) as u16).collect::<Vec<_>>();
    let named = |shift: u16| {
        (0..pixels).map(|at| if empty(at) { NO_OBJECT } else { at as u16 % 2 + shift }).collect()
    };
    let truth = Truth {
        range: each(&|at| 20.0 + at),
        object: named(0),
        material: named(1),
        cosine: each(&|at| 1.0 - at / 64.0),
        outcome: (0..pixels).map(|at| Outcome::ALL[at % 6]).collect(),
    };
    PointCloud {
        scan: 12,
        rows: ROWS,
        columns: COLUMNS,
        viewpoint: Viewpoint { position: [12.1, -0.3, 1.7], turn: [0.8, 0.0, -0.6, 0.0] },
        x: each(&|at| 0.1 + at),
        y: each(&|at| -0.2 * at),
        z: each(&|at| 0.3 * at - 2.0),
        intensity: each(&|at| at / 40.0),
        range: each(&|at| 20.001 + at),
        time_ns: (0..pixels).map(|at| at as f64 * 40.946_502_1).collect(),
        peak: count(3),
        marks: count(5),
        margin: count(2),
        truth: if with_truth { truth } else { Truth::default() },
    }
}

fn names() -> [Vec<String>; 2] {
    let list = |names: [&str; 3]| names.map(str::to_owned).to_vec();
    [list(["car", "road, wet", "sky"]), list(["paint", "glass", "\"matt\" black"])]
}

fn write(format: Format, cloud: &PointCloud) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan").with_extension(format.name());
    let [objects, materials] = names();
    let names = Names { objects: &objects, materials: &materials };
    write_cloud(format, cloud, &names, &path).unwrap();
    (folder, path)
}

/// Equal, with NaN equal to NaN.
fn assert_same(read: &[f32], written: &[f32], tolerance: f32, what: &str) {
    assert_eq!(read.len(), written.len(), "{what}");
    for (at, (a, b)) in read.iter().zip(written).enumerate() {
        let same = a.is_nan() && b.is_nan() || (a - b).abs() <= tolerance;
        assert!(same, "{what}[{at}]: read {a}, written {b}");
    }
}

#[test]
fn pcd_keeps_every_column_of_every_pixel() {
    for with_truth in [false, true] {
        let written = cloud(with_truth);
        let (_folder, path) = write(Format::Pcd, &written);
        let read = read_pcd(&path).unwrap();
        assert_eq!((read.scan, read.rows, read.columns), (12, ROWS, COLUMNS));
        assert_same(&read.x, &written.x, 0.0, "x");
        assert_same(&read.y, &written.y, 0.0, "y");
        assert_same(&read.z, &written.z, 0.0, "z");
        assert_same(&read.intensity, &written.intensity, 0.0, "intensity");
        assert_same(&read.range, &written.range, 0.0, "range");
        assert_eq!(read.time_ns, written.time_ns);
        assert_eq!(read.viewpoint, written.viewpoint);
        assert_eq!(read.peak, written.peak);
        assert_eq!(read.marks, written.marks);
        assert_eq!(read.margin, written.margin);
        assert_same(&read.truth.range, &written.truth.range, 0.0, "true range");
        assert_eq!(read.truth.object, written.truth.object);
        assert_eq!(read.truth.material, written.truth.material);
        assert_eq!(read.truth.outcome, written.truth.outcome);
        // Stored as an angle in f32: half an ulp of π/2 is 6e-8 rad.
        assert_same(&read.truth.cosine, &written.truth.cosine, 2e-7, "cosine");
    }
}

#[test]
fn ply_holds_the_returns_as_another_reader_sees_them() {
    let written = cloud(true);
    let (_folder, path) = write(Format::Ply, &written);
    let mut file = fs::File::open(path).unwrap();
    let ply = Parser::<DefaultElement>::new().read_ply(&mut file).unwrap();
    let vertices = &ply.payload["vertex"];
    let valid: Vec<usize> =
        (0..ROWS * COLUMNS).filter(|&at| written.range[at].is_finite()).collect();
    assert_eq!(vertices.len(), valid.len());
    for (vertex, at) in vertices.iter().zip(valid) {
        let truth = &written.truth;
        assert_eq!(vertex["x"], Property::Float(written.x[at]));
        assert_eq!(vertex["y"], Property::Float(written.y[at]));
        assert_eq!(vertex["z"], Property::Float(written.z[at]));
        assert_eq!(vertex["intensity"], Property::Float(written.intensity[at]));
        assert_eq!(vertex["range"], Property::Float(written.range[at]));
        assert_eq!(vertex["time_ns"], Property::Double(written.time_ns[at]));
        assert_eq!(vertex["row"], Property::UShort((at / COLUMNS) as u16));
        assert_eq!(vertex["column"], Property::UShort((at % COLUMNS) as u16));
        assert_eq!(vertex["ring"], vertex["row"]);
        assert_eq!(vertex["peak"], Property::UShort(written.peak[at]));
        assert_eq!(vertex["marks"], Property::UShort(written.marks[at]));
        assert_eq!(vertex["margin"], Property::UShort(written.margin[at]));
        assert_eq!(vertex["true_range"], Property::Float(truth.range[at]));
        assert_eq!(vertex["object"], Property::UShort(truth.object[at]));
        assert_eq!(vertex["material"], Property::UShort(truth.material[at]));
        assert_eq!(vertex["outcome"], Property::UChar(truth.outcome[at] as u8));
    }
}

#[test]
fn csv_holds_the_returns_to_the_last_digit() {
    let written = cloud(false);
    let (_folder, path) = write(Format::Csv, &written);
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "x_m,y_m,z_m,intensity,range_m,time_ns,row,column,ring,peak,marks,margin,\
         return_number,number_of_returns,flags"
    );
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let place = |at: usize| cells[at].parse::<usize>().unwrap();
        let at = place(6) * COLUMNS + place(7);
        assert_eq!(cells[0].parse::<f32>().unwrap(), written.x[at]);
        assert_eq!(cells[4].parse::<f32>().unwrap(), written.range[at]);
        assert_eq!(cells[5].parse::<f64>().unwrap(), written.time_ns[at]);
        assert_eq!(place(11), usize::from(written.margin[at]));
    }
    assert_eq!(text.lines().count(), 1 + written.range.iter().filter(|r| r.is_finite()).count());
}

#[test]
fn png_is_16_bit_grey_with_its_scale_inside() {
    let written = cloud(false);
    let (_folder, path) = write(Format::Png, &written);
    let image = read_range_png(&path).unwrap();
    assert_eq!((image.rows, image.columns), (ROWS, COLUMNS));
    assert_same(&image.range, &written.range, 1.0 / 512.0, "range");
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    let text = &reader.info().uncompressed_latin1_text[0];
    assert!(text.text.starts_with("metres = value / 256; 0 = no return"));
}

#[test]
fn the_same_cloud_is_the_same_bytes() {
    for format in Format::ALL {
        let [(_a, first), (_b, second)] = [(); 2].map(|()| write(format, &cloud(true)));
        assert_eq!(fs::read(first).unwrap(), fs::read(second).unwrap(), "{}", format.name());
    }
}

/// Writes `bytes` under the name of `path` and gives the sentence with which it is refused.
fn refusal<T: std::fmt::Debug, E: std::fmt::Display>(
    path: &Path,
    bytes: &[u8],
    read: impl Fn(&Path) -> Result<T, E>,
) -> String {
    fs::write(path, bytes).unwrap();
    read(path).unwrap_err().to_string()
}

#[test]
fn a_truncated_file_is_refused() {
    let (_folder, pcd) = write(Format::Pcd, &cloud(true));
    let bytes = fs::read(&pcd).unwrap();
    let sentence = refusal(&pcd, &bytes[..bytes.len() - 1], read_pcd);
    assert!(sentence.contains("ends after 34 of 35 points"), "{sentence}");

    let (_folder, png) = write(Format::Png, &cloud(true));
    let bytes = fs::read(&png).unwrap();
    let sentence = refusal(&png, &bytes[..bytes.len() / 2], read_range_png);
    assert!(sentence.contains("is not a png file that can be read"), "{sentence}");

    let (_folder, ply) = write(Format::Ply, &cloud(true));
    let bytes = fs::read(&ply).unwrap();
    let cut = &mut &bytes[..bytes.len() - 1];
    assert!(Parser::<DefaultElement>::new().read_ply(cut).is_err());
}

#[test]
fn a_file_with_the_wrong_header_is_refused() {
    let (_folder, pcd) = write(Format::Pcd, &cloud(true));
    let (_other, png) = write(Format::Png, &cloud(true));
    let [pcd_bytes, png_bytes] = [&pcd, &png].map(|path| fs::read(path).unwrap());
    let sentence = refusal(&pcd, &png_bytes, read_pcd);
    assert!(sentence.contains("its header is not text"), "{sentence}");
    let sentence = refusal(&png, &pcd_bytes, read_range_png);
    assert!(sentence.contains("is not a png file that can be read"), "{sentence}");
    let sentence = read_pcd(Path::new("no-such.pcd")).unwrap_err().to_string();
    assert_eq!(sentence, "cannot read no-such.pcd: there is no such file or folder");
}

#[test]
fn an_unwritable_folder_is_one_sentence() {
    let path = Path::new("no-such-folder/scan.pcd");
    let error = write_cloud(Format::Pcd, &cloud(false), &Names::default(), path).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot write no-such-folder/scan.pcd: there is no such file or folder"
    );
}
