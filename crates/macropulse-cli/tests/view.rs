//! Pages of clouds from the disk; what is in them is tried in `browser/`.

#![allow(missing_docs)]
#![allow(clippy::unwrap_used)]

use crate::common;

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
    desk.refused("view notes.txt", &["notes.txt", "its first line names the columns"]);
    desk.put("notes.md", "x");
    desk.refused("view notes.md", &["notes.md", "pcd", "laz"]);
    desk.refused("view broken.pcd", &["broken.pcd", "pcd"]);
    desk.refused("view empty", &["empty", "no point cloud", "--format pcd"]);
    desk.refused("view odd", &["manifest.json", "name a cloud instead"]);
}

#[test]
fn page_takes_no_place_of_a_file_of_others() {
    let desk = Desk::new();
    assert_eq!(desk.run("simulate peregrine wall --format pcd -o out").code, Some(0));
    fs::copy(desk.path().join("out/scan-000000.pcd"), desk.path().join("a.pcd")).unwrap();
    desk.put("a.html", "<title>mine</title>");
    desk.refused("view a.pcd", &["a.html", "not known to be written by macropulse", "with -o"]);
    assert_eq!(fs::read_to_string(desk.path().join("a.html")).unwrap(), "<title>mine</title>");
    // A name that is typed says which file is meant.
    assert_eq!(desk.run("view a.pcd -o a.html").code, Some(0));
    assert_eq!(desk.run("view a.pcd").code, Some(0));
    let ran = desk.run("view a.pcd -o /dev/stdout");
    assert!(ran.code == Some(0) && ran.out.ends_with("</html>\n"), "{}", ran.err);
}

#[cfg(unix)]
#[test]
fn nothing_outside_a_folder_is_shown() {
    use std::os::unix::fs::symlink;
    let desk = Desk::new();
    assert_eq!(desk.run("simulate peregrine wall --format pcd -o out").code, Some(0));
    fs::copy(desk.path().join("out/scan-000000.pcd"), desk.path().join("secret.pcd")).unwrap();
    symlink("../secret.pcd", desk.path().join("out/scan-000001.pcd")).unwrap();
    let manifest = r#"{"files": ["scan-000000.pcd", "scan-000001.pcd", "../secret.pcd"]}"#;
    for manifest in [Some(manifest), None] {
        let path = desk.path().join("out/manifest.json");
        match manifest {
            Some(text) => fs::write(path, text).unwrap(),
            None => fs::remove_file(path).unwrap(),
        }
        let ran = desk.run("view out -o page.html");
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(ran.err.contains("scan-000001.pcd leads out of the folder"), "{}", ran.err);
        let html = fs::read_to_string(desk.path().join("page.html")).unwrap();
        assert!(html.contains("id=\"scan-0\"") && !html.contains("id=\"scan-1\""));
        assert!(!html.contains("secret"));
    }
}
