//! `macropulse convert`: what arrives, what is said to be left out, what is refused.
#![allow(missing_docs)]

mod common;

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
