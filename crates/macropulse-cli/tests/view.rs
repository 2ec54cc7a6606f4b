//! Pages of clouds from the disk; what is in them is tried in `browser/`.

#![allow(missing_docs)]
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::Desk;

#[test]
fn a_folder_and_a_file_each_get_a_page() {
    let desk = Desk::new();
    assert_eq!(desk.run("simulate peregrine wall --format pcd -o out").code, Some(0));
    let page = desk.path().join("out/index.html");
    fs::remove_file(&page).unwrap();
    let ran = desk.run("view out");
    assert_eq!((ran.code, ran.out.as_str()), (Some(0), "open out/index.html\n"), "{}", ran.err);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.contains("<title>peregrine in wall</title>"));
    assert!(html.contains("href=\"./scan-000000.pcd\"") && !html.contains("href=\"./index.html\""));
    assert_eq!(desk.run("view out/scan-000000.pcd -q").out, "");
    assert!(desk.path().join("out/scan-000000.html").is_file());
    assert_eq!(desk.run("view out/scan-000000.pcd -o elsewhere.html").code, Some(0));
    let html = fs::read_to_string(desk.path().join("elsewhere.html")).unwrap();
    assert!(html.contains("href=\"./out/scan-000000.pcd\""));
}

#[test]
fn a_folder_without_a_manifest_shows_every_cloud_in_it() {
    let desk = Desk::new();
    assert_eq!(desk.run("simulate peregrine wall --scans 2 --format pcd -o out").code, Some(0));
    fs::remove_file(desk.path().join("out/manifest.json")).unwrap();
    assert_eq!(desk.run("view out").code, Some(0));
    let html = fs::read_to_string(desk.path().join("out/index.html")).unwrap();
    assert!(html.contains("<title>out</title>") && html.contains("id=\"scan-1\""));
}

#[test]
fn what_cannot_be_shown_is_one_sentence() {
    let desk = Desk::new();
    fs::create_dir(desk.path().join("empty")).unwrap();
    fs::create_dir(desk.path().join("odd")).unwrap();
    desk.put("notes.txt", "x").put("broken.pcd", "x\n").put("odd/manifest.json", "{");
    desk.refused("view nowhere.pcd", &["nowhere.pcd", "no such file"]);
    desk.refused("view notes.txt", &["notes.txt", "pcd", "laz"]);
    desk.refused("view broken.pcd", &["broken.pcd", "pcd"]);
    desk.refused("view empty", &["empty", "no point cloud", "--format pcd"]);
    desk.refused("view odd", &["manifest.json", "name a cloud instead"]);
}
