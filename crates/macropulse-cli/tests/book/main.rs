//! The guide as a book: every page of docs is in it, every link of the repository's pages leads
//! somewhere, and mdBook makes pages of them whose links do, too.
#![allow(clippy::unwrap_used, missing_docs)]

mod links;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use links::{Link, of_html, of_markdown};

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The files below `folder` that end in `ending`.
fn files(folder: &Path, ending: &str) -> BTreeSet<PathBuf> {
    let mut found = BTreeSet::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        if entry.path().is_dir() {
            found.extend(files(&entry.path(), ending));
        } else if entry.path().to_string_lossy().ends_with(ending) {
            found.insert(entry.path());
        }
    }
    found
}

/// Every page that people read in the repository.
fn pages() -> BTreeSet<PathBuf> {
    let mut pages = files(&root().join("docs"), ".md");
    for name in ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"] {
        pages.insert(root().join(name));
    }
    let crates = fs::read_dir(root().join("crates")).unwrap().map(Result::unwrap);
    pages.extend(crates.map(|entry| entry.path().join("README.md")).filter(|page| page.exists()));
    pages
}

#[test]
fn every_page_is_in_the_book_once() {
    let docs = root().join("docs");
    let summary = docs.join("SUMMARY.md");
    let mut listed: Vec<_> = of_markdown(&fs::read_to_string(&summary).unwrap())
        .links
        .into_iter()
        .map(|link| docs.join(link.file))
        .collect();
    listed.sort();
    let mut there = files(&docs, ".md");
    there.remove(&summary);
    assert_eq!(listed, there.into_iter().collect::<Vec<_>>());
}

#[test]
fn every_link_leads_somewhere() {
    let (mut count, mut wrong) = (0, Vec::new());
    for page in pages() {
        let text = of_markdown(&fs::read_to_string(&page).unwrap());
        for link in text.links {
            count += 1;
            let of_pages = |file: &Path| of_markdown(&fs::read_to_string(file).unwrap()).anchors;
            if !leads(&page, &link, &of_pages) {
                wrong.push(format!("{}:{}: {}", page.display(), link.line, link.target()));
            }
        }
    }
    assert!(wrong.is_empty(), "these links lead nowhere:\n{}", wrong.join("\n"));
    assert!(count > 200, "only {count} links found");
}

/// Returns true if a link on `page` leads to a file, and to an anchor that `anchors` finds in it.
fn leads(page: &Path, link: &Link, anchors: &dyn Fn(&Path) -> BTreeSet<String>) -> bool {
    let file = match link.file.as_str() {
        "" => page.to_path_buf(),
        file => page.parent().unwrap().join(file),
    };
    file.exists() && link.anchor.as_ref().is_none_or(|anchor| anchors(&file).contains(anchor))
}

/// mdBook, from an environment of Python packages.
fn mdbook() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = macropulse_testbed::python(&here.join("tests/book/requirements.txt")).unwrap();
    python.with_file_name("mdbook")
}

/// The book lies in `target/book/docs`; what its pages link to outside of docs is copied beside it.
#[test]
fn the_book_is_made_and_its_links_hold() {
    let (root, site) = (root(), macropulse_testbed::target().unwrap().join("book"));
    let _ = fs::remove_dir_all(&site);
    let book = site.join("docs");
    let printed = macropulse_testbed::call(
        Command::new(mdbook()).arg("build").arg(root.join("docs")).arg("--dest-dir").arg(&book),
    )
    .unwrap();
    assert!(!printed.contains("WARN") && !printed.contains("ERROR"), "{printed}");

    for page in files(&root.join("docs"), ".md") {
        for link in of_markdown(&fs::read_to_string(&page).unwrap()).links {
            let linked = page.parent().unwrap().join(&link.file).canonicalize();
            let linked = linked.unwrap_or_else(|why| panic!("{}: {why}", link.file));
            let inside = linked.strip_prefix(&root).unwrap();
            if !inside.starts_with("docs") {
                assert!(!link.file.ends_with(".md"), "{}: no page of the book", link.file);
                copy(&linked, &site.join(inside));
            }
        }
    }

    let (mut count, mut wrong) = (0, Vec::new());
    let html = files(&book, ".html");
    for page in html.iter().filter(|page| !page.ends_with("404.html")) {
        for link in of_html(&fs::read_to_string(page).unwrap()).links {
            count += 1;
            if !leads(page, &link, &|file| of_html(&fs::read_to_string(file).unwrap()).anchors) {
                wrong.push(format!("{}: {}", page.display(), link.target()));
            }
        }
    }
    wrong.dedup();
    assert!(wrong.is_empty(), "these links of the book lead nowhere:\n{}", wrong.join("\n"));
    assert!(count > 500, "only {count} links found in {} pages", html.len());
    println!("open {}", book.join("index.html").display());
}

/// Copies a file, or the files of a folder.
fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
            if entry.path().is_file() {
                copy(&entry.path(), &to.join(entry.file_name()));
            }
        }
    } else {
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
    }
}
