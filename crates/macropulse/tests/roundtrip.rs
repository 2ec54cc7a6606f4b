//! Every field in every format, there and back, and files that must not be read.
#![allow(clippy::unwrap_used)]

use macropulse::formats::{
    Clouds, Format, Names, read_cloud, read_pcd, read_range_png, write_cloud,
};
use macropulse::points::{
    NO_OBJECT, Outcome, Pick, PointCloud, Surface, Surfaces, Truth, Viewpoint,
};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const ROWS: usize = 5;
const COLUMNS: usize = 7;

/// Returns a cloud. Every third pixel is empty, the others have `returns_per_shot` returns; no two returns
/// have the same value in any column.
fn cloud_of(returns_per_shot: u8, with_truth: bool) -> PointCloud {
    let pixels = ROWS * COLUMNS;
    let answered = (0..pixels).filter(|pixel| pixel % 3 != 2);
    let all: Vec<(usize, u8)> =
        answered.flat_map(|pixel| (1..=returns_per_shot).map(move |n| (pixel, n))).collect();
    let place = |&(pixel, number): &(usize, u8)| pixel * 4 + usize::from(number) - 1;
    let each = |value: &dyn Fn(f32) -> f32| -> Vec<f32> {
        all.iter().map(|point| value(place(point) as f32 / 4.0)).collect()
    };
    let count = |scale: usize| all.iter().map(|point| (place(point) * scale) as u16).collect();
    let fired_ns: Vec<f64> = (0..pixels).map(|at| at as f64 * 40.946_502_1).collect();
    let mut truth = Truth::default();
    if with_truth {
        truth.returns = Surfaces {
            range: each(&|at| 20.0 + at),
            object: all.iter().map(|point| place(point) as u16 % 2).collect(),
            material: all.iter().map(|point| place(point) as u16 % 2 + 1).collect(),
            cosine: each(&|at| 1.0 - at / 64.0),
            outcome: all.iter().map(|point| Outcome::ALL[1 + place(point) % 3]).collect(),
        };
        truth.radial_velocity = each(&|at| 4.0 - at);
        for pixel in 0..pixels {
            let shown = all.iter().position(|&(other, _)| other == pixel);
            // The first surface of a pixel without a return.
            truth.pixels.push(shown.map_or(
                Surface {
                    range: pixel as f32,
                    object: NO_OBJECT,
                    material: 3,
                    cosine: 0.5,
                    outcome: Outcome::Missed,
                },
                |at| Surface { outcome: truth.returns.outcome[at], ..Surface::NONE },
            ));
        }
    }
    PointCloud {
        scan: 12,
        rows: ROWS,
        columns: COLUMNS,
        viewpoint: Viewpoint { position: [12.1, -0.3, 1.7], turn: [0.8, 0.0, -0.6, 0.0] },
        returns_per_shot,
        pick: Pick::First,
        row: all.iter().map(|(pixel, _)| (pixel / COLUMNS) as u16).collect(),
        column: all.iter().map(|(pixel, _)| (pixel % COLUMNS) as u16).collect(),
        return_number: all.iter().map(|(_, number)| *number).collect(),
        number_of_returns: vec![returns_per_shot; all.len()],
        x: each(&|at| 0.1 + at),
        y: each(&|at| -0.2 * at),
        z: each(&|at| 0.3 * at - 2.0),
        intensity: each(&|at| at / 40.0),
        range: each(&|at| 20.001 + at),
        time_ns: all.iter().map(|(pixel, _)| fired_ns[*pixel]).collect(),
        peak: count(3),
        marks: count(5),
        margin: count(2),
        radial_velocity: each(&|at| at - 5.0),
        photons: vec![f32::NAN; all.len()],
        saturated: all.iter().map(|point| place(point) % 3 == 1).collect(),
        fired_ns,
        truth,
        ..PointCloud::default()
    }
}

fn cloud(with_truth: bool) -> PointCloud {
    cloud_of(1, with_truth)
}

fn names() -> [Vec<String>; 2] {
    let list = |names: [&str; 3]| names.map(str::to_owned).to_vec();
    [list(["car", "road, wet", "sky"]), list(["paint", "glass", "\"matt\" black"])]
}

fn write(format: Format, cloud: &PointCloud) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan").with_extension(format.extension());
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

fn assert_same_returns(read: &PointCloud, written: &PointCloud) {
    assert_same(&read.x, &written.x, 0.0, "x");
    assert_same(&read.y, &written.y, 0.0, "y");
    assert_same(&read.z, &written.z, 0.0, "z");
    assert_same(&read.intensity, &written.intensity, 0.0, "intensity");
    assert_same(&read.range, &written.range, 0.0, "range");
    assert_eq!(read.time_ns, written.time_ns);
    assert_eq!((&read.row, &read.column), (&written.row, &written.column));
    assert_eq!(read.return_number, written.return_number);
    assert_eq!(read.number_of_returns, written.number_of_returns);
    assert_eq!(read.peak, written.peak);
    assert_eq!(read.marks, written.marks);
    assert_eq!(read.margin, written.margin);
    assert_eq!(read.saturated, written.saturated);
    assert_same(&read.radial_velocity, &written.radial_velocity, 0.0, "radial velocity");
    let velocities = [read, written].map(|cloud| &cloud.truth.radial_velocity);
    assert_same(velocities[0], velocities[1], 0.0, "true radial velocity");
    assert_same_truth(&read.truth.returns, &written.truth.returns);
}

fn assert_same_truth(read: &Surfaces, written: &Surfaces) {
    assert_same(&read.range, &written.range, 0.0, "true range");
    assert_eq!(read.object, written.object);
    assert_eq!(read.material, written.material);
    assert_eq!(read.outcome, written.outcome);
    // Stored as an angle in f32: half an ulp of π/2 is 6e-8 rad.
    assert_same(&read.cosine, &written.cosine, 2e-7, "cosine");
}

#[test]
fn pcd_keeps_every_column_of_every_pixel() {
    for with_truth in [false, true] {
        let written = cloud(with_truth);
        let (_folder, path) = write(Format::Pcd, &written);
        let read = read_pcd(&path).unwrap();
        assert_eq!((read.scan, read.rows, read.columns), (12, ROWS, COLUMNS));
        assert_same_returns(&read, &written);
        assert_eq!(read.fired_ns, written.fired_ns);
        assert_eq!(read.viewpoint, written.viewpoint);
        assert_same_truth(&read.truth.pixels, &written.truth.pixels);
    }
}

#[test]
fn pcd_keeps_every_return_of_a_list_and_its_image() {
    for with_truth in [false, true] {
        for pick in [Pick::First, Pick::Strongest, Pick::Last] {
            let written = PointCloud { pick, ..cloud_of(3, with_truth) };
            let (_folder, path) = write(Format::Pcd, &written);
            let read = read_pcd(&path).unwrap();
            assert_eq!((read.scan, read.rows, read.columns), (12, ROWS, COLUMNS));
            assert_eq!((read.returns_per_shot, read.pick), (3, pick));
            assert_same_returns(&read, &written);
            assert_eq!(read.image(pick), written.image(pick));
            // Written again, it is the same.
            let (_other, again) = write(Format::Pcd, &read);
            assert_eq!(fs::read(&path).unwrap(), fs::read(again).unwrap());
        }
    }
}

/// The list of a cloud, as formats without pixels of their own keep it.
fn as_list(cloud: &PointCloud) -> PointCloud {
    let image = cloud.image(cloud.pick);
    let fired = |at: Option<usize>| at.map_or(f64::NAN, |at| cloud.time_ns[at]);
    PointCloud { fired_ns: image.iter().map(fired).collect(), ..cloud.clone() }
}

/// Gives objects and materials the numbers they were written with: a CSV has names, which are numbered
/// in the order in which they come.
fn renumber(cloud: &mut PointCloud, found: Names) {
    let [objects, materials] = names();
    let truth = &mut cloud.truth.returns;
    for (numbers, found, written) in [
        (&mut truth.object, found.objects, objects),
        (&mut truth.material, found.materials, materials),
    ] {
        for number in numbers {
            let name = &found[usize::from(*number)];
            *number = written.iter().position(|written| written == name).unwrap() as u16;
        }
    }
}

#[test]
fn formats_that_hold_every_attribute_give_every_attribute_back() {
    for name in ["pcd", "ply", "e57", "npy", "csv", "mcap"] {
        let format = Format::parse(name).unwrap();
        for (most, with_truth) in [(1, true), (1, false), (3, true), (3, false)] {
            let written = cloud_of(most, with_truth);
            let (_folder, path) = write(format, &written);
            let mut clouds = Clouds::open(&path).unwrap();
            let mut read = clouds.next().unwrap().unwrap();
            if name == "csv" {
                renumber(&mut read, clouds.names());
            }
            // E57 has seconds, and a billionth of them is not always the same number.
            for (read, written) in read.time_ns.iter_mut().zip(&written.time_ns) {
                assert!((*read - written).abs() <= 1e-12 * written.abs(), "{name}");
                *read = *written;
            }
            assert_same_returns(&read, &written);
            assert_eq!(read.returns_per_shot, most, "{name}");
            assert_eq!((read.rows, read.columns), (ROWS, COLUMNS), "{name}");
            if !["npy", "csv"].contains(&name) {
                assert_eq!((read.scan, read.viewpoint), (12, written.viewpoint), "{name}");
            }
            if !["pcd", "mcap"].contains(&name) {
                let fired = as_list(&written).fired_ns;
                let same = |(a, b): (&f64, &f64)| a.is_nan() && b.is_nan() || (a - b).abs() < 1e-9;
                assert!(read.fired_ns.iter().zip(&fired).all(same), "{name}");
            }
        }
    }
}

#[test]
fn las_and_laz_keep_coordinates_to_half_a_micrometre_and_all_else_as_it_is() {
    for format in [Format::Las, Format::Laz] {
        for with_truth in [false, true] {
            let written = cloud_of(3, with_truth);
            let (_folder, path) = write(format, &written);
            let mut read = read_cloud(&path).unwrap();
            assert_same(&read.x, &written.x, 5.01e-7, "x");
            assert_same(&read.y, &written.y, 5.01e-7, "y");
            assert_same(&read.z, &written.z, 5.01e-7, "z");
            for (read, written) in read.time_ns.iter().zip(&written.time_ns) {
                assert!((read - written).abs() <= 1e-12 * written, "{read} {written}");
            }
            read.x.clone_from(&written.x);
            read.y.clone_from(&written.y);
            read.z.clone_from(&written.z);
            read.time_ns.clone_from(&written.time_ns);
            assert_same_returns(&read, &written);
            assert_eq!(
                (read.scan, read.pick, read.viewpoint),
                (12, Pick::First, written.viewpoint)
            );
        }
    }
}

#[test]
fn kitti_and_xyz_keep_four_numbers() {
    let written = cloud(true);
    for format in [Format::Kitti, Format::Xyz] {
        let (_folder, path) = write(format, &written);
        let read = read_cloud(&path).unwrap();
        assert_same(&read.x, &written.x, 0.0, "x");
        assert_same(&read.intensity, &written.intensity, 0.0, "intensity");
        assert_eq!((read.rows, read.columns, read.truth), (0, 0, Truth::default()));
    }
}

#[test]
fn names_travel_with_the_points() {
    for name in ["pcd", "ply", "las", "laz", "e57", "mcap"] {
        let (_folder, path) = write(Format::parse(name).unwrap(), &cloud(true));
        let mut clouds = Clouds::open(&path).unwrap();
        assert!(clouds.next().unwrap().is_ok());
        let [objects, materials] = names();
        let found = clouds.names();
        assert_eq!((found.objects, found.materials), (&objects[..], &materials[..]), "{name}");
        assert!(clouds.next().is_none());
    }
}

#[test]
fn only_files_with_clouds_are_read() {
    for name in ["png", "range-npy", "mcap-osi", "mcap-foxglove"] {
        let (_folder, path) = write(Format::parse(name).unwrap(), &cloud(true));
        assert!(read_cloud(&path).is_err(), "{name}");
    }
    let (folder, _) = write(Format::Ply, &cloud(true));
    let text = folder.path().join("scene.docx");
    std::fs::write(&text, "no points").unwrap();
    let told = read_cloud(&text).unwrap_err().to_string();
    assert!(told.contains("no point cloud is read from such a file; read are"), "{told}");
}

#[test]
fn ply_holds_the_returns_as_another_reader_sees_them() {
    let written = cloud_of(2, true);
    let (_folder, path) = write(Format::Ply, &written);
    let mut file = fs::File::open(path).unwrap();
    let ply = Parser::<DefaultElement>::new().read_ply(&mut file).unwrap();
    let vertices = &ply.payload["vertex"];
    assert_eq!(vertices.len(), written.returns());
    for (at, vertex) in vertices.iter().enumerate() {
        let truth = &written.truth.returns;
        assert_eq!(vertex["x"], Property::Float(written.x[at]));
        assert_eq!(vertex["y"], Property::Float(written.y[at]));
        assert_eq!(vertex["z"], Property::Float(written.z[at]));
        assert_eq!(vertex["intensity"], Property::Float(written.intensity[at]));
        assert_eq!(vertex["range"], Property::Float(written.range[at]));
        assert_eq!(vertex["time_ns"], Property::Double(written.time_ns[at]));
        assert_eq!(vertex["row"], Property::Int(written.row[at].into()));
        assert_eq!(vertex["column"], Property::Int(written.column[at].into()));
        assert_eq!(vertex["ring"], vertex["row"]);
        assert_eq!(vertex["peak"], Property::Int(written.peak[at].into()));
        assert_eq!(vertex["marks"], Property::Int(written.marks[at].into()));
        assert_eq!(vertex["margin"], Property::Int(written.margin[at].into()));
        assert_eq!(vertex["return_number"], Property::UChar(1 + at as u8 % 2));
        assert_eq!(vertex["number_of_returns"], Property::UChar(2));
        assert_eq!(vertex["true_range"], Property::Float(truth.range[at]));
        assert_eq!(vertex["object"], Property::Int(truth.object[at].into()));
        assert_eq!(vertex["material"], Property::Int(truth.material[at].into()));
        assert_eq!(vertex["outcome"], Property::UChar(truth.outcome[at] as u8));
    }
}

#[test]
fn csv_holds_the_returns_to_the_last_digit() {
    let written = cloud_of(2, false);
    let (_folder, path) = write(Format::Csv, &written);
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next().unwrap(),
        "x_m,y_m,z_m,intensity,range_m,time_ns,row,column,ring,peak,marks,margin,\
         return_number,number_of_returns,flags,radial_velocity_m_s"
    );
    for (at, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let place = |at: usize| cells[at].parse::<usize>().unwrap();
        assert_eq!([place(6), place(7)], [written.row[at], written.column[at]].map(usize::from));
        assert_eq!(cells[0].parse::<f32>().unwrap(), written.x[at]);
        assert_eq!(cells[4].parse::<f32>().unwrap(), written.range[at]);
        assert_eq!(cells[5].parse::<f64>().unwrap(), written.time_ns[at]);
        assert_eq!(place(11), usize::from(written.margin[at]));
        assert_eq!([place(12), place(13)], [1 + at % 2, 2]);
        assert_eq!(cells[15].parse::<f32>().unwrap(), written.radial_velocity[at]);
    }
    assert_eq!(text.lines().count(), 1 + written.returns());
}

#[test]
fn png_is_16_bit_grey_with_its_scale_inside() {
    let written = cloud(false);
    let (_folder, path) = write(Format::Png, &written);
    let image = read_range_png(&path).unwrap();
    assert_eq!((image.rows, image.columns), (ROWS, COLUMNS));
    let shown = written.image(written.pick).spread(&written.range, f32::NAN);
    assert_same(&image.range, &shown, 1.0 / 512.0, "range");
    let file = std::io::BufReader::new(fs::File::open(path).unwrap());
    let reader = png::Decoder::new(file).read_info().unwrap();
    let text = &reader.info().uncompressed_latin1_text[0];
    assert!(text.text.starts_with("metres = value / 256; 0 = no return"));
}

/// Names in a file are repeated in what is said of it, in one line.
#[test]
fn a_name_of_two_lines_is_told_in_one() {
    let (_folder, npy) = write(Format::Npy, &cloud(false));
    let bytes = fs::read(&npy).unwrap();
    let (plain, odd) = (b"('range', '<f4')", b"('ran\ne', '<c4')");
    let at = bytes.windows(plain.len()).position(|part| part == plain).unwrap();
    let bytes = [&bytes[..at], odd, &bytes[at + plain.len()..]].concat();
    let sentence = refusal(&npy, &bytes, read_cloud);
    assert!(sentence.contains("`ran e`") && sentence.lines().count() == 1, "{sentence}");
}

/// A file of some bytes that promises more pixels than any sensor has.
#[test]
fn a_png_of_too_many_pixels_is_refused_unread() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1 << 16, 1 << 24);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let scale = "metres = value / 256; 0 = no return; 65535 = 255.99 m or farther";
    encoder.add_text_chunk("Range scale".into(), scale.into()).unwrap();
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[]).unwrap();
    drop(writer);
    let folder = tempfile::tempdir().unwrap();
    let sentence = refusal(&folder.path().join("a.png"), &bytes, read_range_png);
    assert!(sentence.contains("65536 x 16777216 pixels are more than 33554432"), "{sentence}");
}

#[test]
fn the_same_cloud_is_the_same_bytes() {
    for &format in Format::ALL {
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
