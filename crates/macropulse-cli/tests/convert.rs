//! `macropulse convert`: what arrives, what is said to be left out, what is refused.
#![allow(missing_docs)]

use crate::common;

use std::fs;

use common::Desk;
use macropulse::formats::read_cloud;

/// A desk with three scans of a small sensor in a file of messages and in PCD files.
fn desk() -> Desk {
    let desk = Desk::new();
    let ran = desk.run(
        "simulate --sensor kim-park-2016-fixed --set scan.raster.rows=8 \
         --set scan.raster.columns=12 --scene street --scans 3 --truth --format pcd,mcap -o in",
    );
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""));
    desk
}

#[test]
fn a_round_through_every_format_loses_nothing() {
    let desk = desk();
    let mut from = "in/scan-000001.pcd".to_owned();
    for ending in ["e57", "ply", "mcap", "pcd"] {
        let ran = desk.run(&format!("convert {from} -o round.{ending}"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        from = format!("round.{ending}");
    }
    let [read, written] =
        [&from, "in/scan-000001.pcd"].map(|name| read_cloud(&desk.path().join(name)).unwrap());
    assert!(written.returns() > 20);
    assert_eq!((&read.x, &read.range, &read.margin), (&written.x, &written.range, &written.margin));
    assert_eq!((read.scan, read.viewpoint), (1, written.viewpoint));
    assert_eq!(read.truth.returns.outcome, written.truth.returns.outcome);
    let text = fs::read(desk.path().join(&from)).unwrap();
    assert!(String::from_utf8_lossy(&text).contains("# object 0 "), "names are lost");
}

#[test]
fn scans_are_put_into_one_file_and_taken_out_again() {
    let desk = desk();
    let ran = desk.run("convert in/scan-000000.pcd in/scan-000001.pcd -o two.mcap");
    assert!(ran.out.starts_with("2 scans, "), "{}", ran.out);
    let ran = desk.run("convert two.mcap in/scans.mcap --format npy,range-npy -o apart");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let names = ["two-000000.npy", "two-000001-range.npy", "scans-000002.npy"];
    for name in names {
        assert!(desk.path().join("apart").join(name).exists(), "{name}: {:?}", desk.files());
    }
    let [a, b] = ["two-000001.npy", "scans-000001.npy"]
        .map(|name| fs::read(desk.path().join("apart").join(name)).unwrap());
    assert_eq!(a, b);
}

#[test]
fn what_cannot_be_held_is_said() {
    let desk = desk();
    let ran = desk.run("convert in/scan-000000.pcd -o points.bin");
    assert_eq!(ran.code, Some(0));
    assert!(
        ran.err.starts_with("macropulse: kitti cannot hold range, time_ns, row,"),
        "{}",
        ran.err
    );
    assert!(ran.err.contains("pixels without a return"), "{}", ran.err);
    let ran = desk.run("convert in/scan-000000.pcd -o points.bin -q");
    assert_eq!((ran.code, ran.out.as_str(), ran.err.as_str()), (Some(0), "", ""));
    assert_eq!(desk.run("convert points.bin -o points.npy").code, Some(0));
}

#[test]
fn an_ending_of_a_format_in_either_case_names_one_file() {
    let desk = desk();
    for name in ["points.txt", "points.xyz", "POINTS.PLY"] {
        let ran = desk.run(&format!("convert in/scan-000000.pcd -q -o {name}"));
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(desk.path().join(name).is_file(), "{name}");
    }
    let ran = desk.run("convert in/scan-000000.pcd --format ply -o points.txt");
    assert!(ran.err.contains("ends as a txt file does"), "{}", ran.err);
}

#[test]
fn a_file_that_was_cut_short_gives_its_finished_scans_and_a_sentence() {
    let desk = desk();
    let whole = fs::read(desk.path().join("in/scans.mcap")).unwrap();
    fs::write(desk.path().join("cut.mcap"), &whole[..whole.len() * 3 / 5]).unwrap();
    let ran = desk.run("convert cut.mcap --format pcd -o out");
    assert_eq!((ran.code, ran.err.lines().count()), (Some(2), 1), "{}", ran.err);
    assert!(ran.err.contains("cut.mcap") && ran.err.contains("cut short"), "{}", ran.err);
    assert!(desk.path().join("out/cut-000000.pcd").exists());
}

#[test]
fn files_of_others_are_read_by_their_names_and_their_points() {
    let desk = Desk::new();
    desk.put("a.xyz", "// X Y Z I\n3 4 12 7\n0 0 2.5 9\n");
    desk.put("b.pts", "2\n3 4 12 7\n0 0 2.5 9\n");
    desk.put("c.txt", "X;Y;Z;Reflectivity\n3;4;12;7\n0;0;2,5;9\n");
    let points = [[3.0_f32, 4.0, 12.0, 7.0, 0.0], [-0.5, 0.0, 2.5, 9.0, 31.0]];
    let floats = |of: usize| {
        points.iter().flat_map(|point| &point[..of]).flat_map(|one| one.to_le_bytes()).collect()
    };
    let (five, four): (Vec<u8>, Vec<u8>) = (floats(5), floats(4));
    fs::write(desk.path().join("d.pcd.bin"), &five).unwrap();
    fs::write(desk.path().join("e.bin"), &five).unwrap();
    fs::write(desk.path().join("f.bin"), four).unwrap();
    let ran = desk.run("convert a.xyz b.pts c.txt d.pcd.bin e.bin f.bin --format pcd -o out");
    assert!(ran.out.starts_with("6 scans, 12 points, 6 files"), "{}{}", ran.out, ran.err);
    for name in ["a", "b", "c", "d.pcd", "e", "f"] {
        let read = read_cloud(&desk.path().join(format!("out/{name}.pcd"))).unwrap();
        assert_eq!((read.z[1], &read.intensity[..]), (2.5, &[7.0, 9.0][..]), "{name}");
    }
    fs::write(desk.path().join("g.bin"), &five[..39]).unwrap();
    let ran = desk.run("convert g.bin -o g.pcd");
    assert_eq!(ran.code, Some(2));
    assert!(ran.err.contains("neither points of four floats") && ran.err.contains(".pcd.bin"));
}

#[test]
fn every_scan_of_a_ptx_is_a_cloud() {
    let desk = Desk::new();
    let begin = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 1.5 1\n";
    desk.put("two.ptx", &format!("1\n2\n{begin}1 2 3 0.5\n0 0 0 0.5\n1\n1\n{begin}1 2 9 0.25\n"));
    let ran = desk.run("convert two.ptx --format pcd -o out");
    assert!(ran.out.starts_with("2 scans, 2 points, 2 files"), "{}{}", ran.out, ran.err);
    assert!(ran.err.contains("two.ptx: left out: 1 point at (0, 0, 0)"), "{}", ran.err);
    for (name, z) in [("two-000000", 3.0), ("two-000001", 9.0)] {
        let read = read_cloud(&desk.path().join(format!("out/{name}.pcd"))).unwrap();
        assert_eq!((read.z[0], read.viewpoint.position), (z, [10.0, 20.0, 1.5]));
    }
    desk.put("cut.ptx", &format!("2\n2\n{begin}1 2 3 0.5\n"));
    desk.refused("convert cut.ptx -o cut.pcd", &["cut.ptx is not a ptx file", "1 of 4 points"]);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let desk = desk();
    desk.refused("convert in/scan-000000.pcd -o points", &["says no format", "points.ply"]);
    desk.refused("convert in/scan-000000.pcd -o points.docx", &["says no format"]);
    desk.refused("convert in/manifest.json -o points.ply", &["manifest.json", "no point cloud"]);
    desk.refused("convert nothing.las -o points.ply", &["nothing.las", "no such file"]);
    desk.refused("convert in/scans.mcap -o points.ply", &["several scans", "--format ply"]);
    desk.refused("convert in/scans.mcap -o in/scans.mcap", &["to be read and written"]);
    desk.refused("convert in/scan-000000.pcd --format none -o out", &["nothing is to be written"]);
    desk.refused(
        "convert in/scan-000000.pcd ./in/scan-000000.pcd --format ply -o out",
        &["under one name"],
    );
    let pcd = fs::read(desk.path().join("in/scan-000000.pcd")).unwrap();
    for (name, bytes) in [("a.las", &pcd[..]), ("b.pcd", &pcd[..pcd.len() - 1]), ("c.e57", b"")] {
        fs::write(desk.path().join(name), bytes).unwrap();
        desk.refused(&format!("convert {name} -o points.ply"), &[name, "can be read"]);
    }
}

#[test]
fn derived_name_takes_no_place_of_an_input_or_of_a_file_of_others() {
    let desk = Desk::new();
    let mine = "x_m,y_m,z_m,mine\n1,2,3,4\n";
    desk.put("mine.csv", mine).put("mine.ply", "ply\n").put("other.csv", mine);
    let read = |name: &str| fs::read_to_string(desk.path().join(name)).unwrap();
    desk.refused("convert mine.csv --format csv -o .", &["mine.csv", "is to be read and written"]);
    desk.refused(
        "convert other.csv mine.csv --format pcd,csv -o .",
        &["is to be read and written"],
    );
    desk.refused(
        "convert mine.csv --format ply -o .",
        &["mine.ply", "not known to be written by macropulse", "--replace"],
    );
    assert_eq!((read("mine.csv").as_str(), read("mine.ply").as_str()), (mine, "ply\n"));
    assert_eq!(desk.run("convert mine.csv --format ply -o . --replace").code, Some(0));
    // Now it is ours, and its header says so.
    assert_eq!(desk.run("convert mine.csv --format ply -o .").code, Some(0));
    desk.refused("convert mine.csv --format csv -o . --replace", &["is to be read and written"]);
    assert_eq!(desk.run("convert mine.csv --format npy -o .").code, Some(0));
    desk.refused("convert mine.csv --format npy -o .", &["mine.npy", "--replace"]);
    assert_eq!(desk.run("convert mine.csv -o mine.npy").code, Some(0));
    assert_eq!(read("mine.csv"), mine);
}

#[test]
fn numbered_names_of_a_container_are_looked_at_too() {
    let desk = desk();
    fs::create_dir(desk.path().join("apart")).unwrap();
    desk.put("apart/scans-000001.ply", "mine").put("apart/scan-000001.ply", "mine");
    let words = ["scans-000001.ply", "not known"];
    desk.refused("convert in/scans.mcap --format ply -o apart", &words);
    fs::remove_file(desk.path().join("apart/scans-000001.ply")).unwrap();
    assert_eq!(desk.run("convert in/scans.mcap --format ply -o apart").code, Some(0));
    assert_eq!(fs::read_to_string(desk.path().join("apart/scan-000001.ply")).unwrap(), "mine");
}

#[cfg(unix)]
#[test]
fn links_are_followed_from_typed_names_alone() {
    use std::os::unix::fs::symlink;
    let desk = desk();
    let path = |name: &str| desk.path().join(name);
    fs::create_dir(path("apart")).unwrap();
    desk.put("outside", "mine");
    for link in ["scan-000000.ply", "scans.mcap"] {
        symlink("../outside", path("apart").join(link)).unwrap();
    }
    for format in ["ply", "mcap"] {
        let line = format!("convert in/scan-000000.pcd --format {format} -o apart --replace");
        desk.refused(&line, &["is a link"]);
    }
    assert_eq!(fs::read_to_string(path("outside")).unwrap(), "mine");
    symlink("outside", path("typed.ply")).unwrap();
    symlink("outside", path("typed.mcap")).unwrap();
    for name in ["typed.ply", "typed.mcap"] {
        assert_eq!(desk.run(&format!("convert in/scan-000000.pcd -o {name}")).code, Some(0));
        assert!(path(name).is_symlink());
        assert!(fs::read(path("outside")).unwrap().len() > 1000, "{name}");
    }
    // An input by another of its names.
    fs::hard_link(path("in/scan-000000.pcd"), path("same.pcd")).unwrap();
    symlink("in/scan-000000.pcd", path("link.pcd")).unwrap();
    for name in ["same.pcd", "link.pcd"] {
        let line = format!("convert in/scan-000000.pcd -o {name}");
        desk.refused(&line, &[name, "is to be read and written"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn devices_and_pipes_are_written_into() {
    use std::os::unix::fs::FileTypeExt;
    let desk = desk();
    let from = "convert in/scan-000000.pcd";
    let whole = desk.run(&format!("{from} -o whole.csv"));
    assert_eq!(whole.code, Some(0));
    let whole = fs::read_to_string(desk.path().join("whole.csv")).unwrap();
    for name in ["/dev/stdout", "/dev/fd/1"] {
        let ran = desk.run(&format!("{from} --format csv -o {name}"));
        assert_eq!((ran.code, ran.out.as_str()), (Some(0), whole.as_str()), "{}", ran.err);
    }
    for format in ["csv", "mcap", "laz"] {
        assert_eq!(desk.run(&format!("{from} --format {format} -o /dev/null")).code, Some(0));
    }
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    desk.refused(&format!("{from} -o /dev/null"), &["/dev/null", "--format"]);
    let ran = desk.run("schema sensor -o /dev/stdout");
    assert!(ran.code == Some(0) && ran.out.starts_with('{'), "{}", ran.err);
    let made = std::process::Command::new("mkfifo").arg(desk.path().join("pipe.csv")).status();
    assert!(made.unwrap().success());
    let ran = desk.run(&format!("{from} -o pipe.csv -q"));
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(ran.err.contains("pipe.csv: it is a pipe, and nothing reads from it"), "{}", ran.err);
    let pipe = desk.path().join("pipe.csv");
    let reader = std::thread::spawn(move || fs::read_to_string(pipe).unwrap());
    assert_eq!(desk.run(&format!("{from} -o pipe.csv")).code, Some(0));
    assert_eq!(reader.join().unwrap(), whole);
    let about = fs::symlink_metadata(desk.path().join("pipe.csv")).unwrap();
    assert!(about.file_type().is_fifo());
}

#[test]
fn names_pass_through_every_format_whatever_they_hold() {
    let desk = Desk::new();
    let scene = |name: &str| {
        format!(
            "version = 1\n[sensor]\nposition_m = [0.0, 0.0, 2.0]\n[[object]]\nname = {name:?}\n\
             shape = {{ sphere = {{ radius_m = 1.0 }} }}\nposition_m = [10.0, 0.0, 2.0]\n\
             material = \"white\"\n"
        )
    };
    for (name, told) in [
        ("a]]>b<c>&", "a]]>b<c>&"),
        ("=HYPERLINK(\"x\")", "=HYPERLINK(\"x\")"),
        ("a\nb", "a b"),
        ("+a, \"b\"\nc", "+a, \"b\" c"),
    ] {
        desk.put("s.toml", &scene(name));
        let line = "simulate peregrine s.toml --truth --format csv,e57,las,ply -o out --no-page";
        assert_eq!(desk.run(line).code, Some(0), "{name:?}");
        for ending in ["csv", "e57", "las", "ply"] {
            let ran = desk.run(&format!("convert out/scan-000000.{ending} -o again.pcd"));
            assert_eq!(ran.code, Some(0), "{name:?}, {ending}: {}", ran.err);
            let again = fs::read(desk.path().join("again.pcd")).unwrap();
            let again = String::from_utf8_lossy(&again);
            assert!(again.contains(&format!("# object 0 {told}\n")), "{name:?}, {ending}");
        }
        let csv = fs::read_to_string(desk.path().join("out/scan-000000.csv")).unwrap();
        assert!(!csv.contains(",=") && !csv.contains(",\"+"), "{name:?}");
    }
}
