//! Which files of a folder Macropulse wrote itself, and may so replace.

use crate::opened;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// The line in the head of every page that Macropulse writes.
pub const GENERATOR: &str = "<meta name=\"generator\" content=\"Macropulse\">";

/// How `manifest.json` and other JSON objects of ours begin, without white space.
const JSON: &str = "{\"schema_version\":";

/// The word in the header, or in the trailer, of the files that have room for one.
const WORD: &[u8] = b"macropulse";

/// Endings of files with the word, and of those that no other program writes.
const MARKED: [&str; 8] = ["pcd", "ply", "las", "laz", "e57", "mcap", "parquet", "1"];
const ALONE: [&str; 3] = ["mps", "mpt", "mpw"];

/// Bytes at the beginning, and at the end, that are searched for the word.
const HEAD: u64 = 4096;
const TAIL: u64 = 1 << 16;

/// Most bytes of a manifest or a page that is searched for names.
const LONGEST: u64 = 256 << 20;

/// The files of one folder that Macropulse wrote. These are the files that its manifest or page names and
/// those that carry its mark. Beside a manifest, files that are named like scans are ours, too.
#[derive(Debug, Clone, Default)]
pub struct Own {
    manifest: Option<String>,
    page: Option<String>,
}

impl Own {
    /// Reads what `folder` says of its files.
    pub fn of(folder: &Path) -> Self {
        let text = |name: &str| {
            let path = folder.join(name);
            let is_ours = is_file(&path) && is_marked(&path);
            String::from_utf8(opened::bytes(&path, LONGEST).ok().filter(|_| is_ours)?).ok()
        };
        Self { manifest: text("manifest.json"), page: text("index.html") }
    }

    /// Returns true if the file at `path`, in this folder, is one of ours. A link is not.
    pub fn has(&self, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_named = || {
            [&self.manifest, &self.page].into_iter().flatten().any(|text| {
                text.contains(&format!("\"{name}\"")) || text.contains(&format!("\"./{name}\""))
            })
        };
        let is_scan = self.manifest.is_some() && is_of_scan(&name);
        is_file(path) && (is_scan || is_marked(path) || is_named())
    }
}

/// Returns true if a file is named like one of a scan: a word, a hyphen, a number of at least six digits.
pub fn is_of_scan(name: &str) -> bool {
    let words = ["scan-", "range-", "shots-", "ticks-", "samples-", "explain-"];
    let rest = words.iter().find_map(|word| name.strip_prefix(word));
    rest.is_some_and(|rest| rest.bytes().take_while(u8::is_ascii_digit).count() >= 6)
}

/// Returns true if `path` is a file and no link to one.
fn is_file(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|about| about.is_file())
}

/// Returns true if a file carries a mark of ours.
fn is_marked(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let (head, tail) = ends(path).unwrap_or_default();
    match ending.as_str() {
        "html" | "htm" => String::from_utf8_lossy(&head).contains(GENERATOR),
        "json" => {
            let head = head.iter().filter(|byte| !byte.is_ascii_whitespace());
            head.take(JSON.len()).eq(JSON.as_bytes())
        }
        ending if ALONE.contains(&ending) => true,
        // Text of shots and ticks.
        "csv" => head.starts_with(b"# macropulse "),
        ending if MARKED.contains(&ending) => has_word(&head) || has_word(&tail),
        _ => false,
    }
}

fn has_word(bytes: &[u8]) -> bool {
    bytes.windows(WORD.len()).any(|word| word == WORD)
}

/// The first and the last bytes of a file.
fn ends(path: &Path) -> std::io::Result<(Vec<u8>, Vec<u8>)> {
    let mut file: File = opened::file(path, u64::MAX)?;
    let length = file.metadata()?.len();
    let (mut head, mut tail) = (Vec::new(), Vec::new());
    file.by_ref().take(HEAD).read_to_end(&mut head)?;
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL)))?;
    file.take(TAIL).read_to_end(&mut tail)?;
    Ok((head, tail))
}

#[cfg(test)]
mod tests {
    use super::super::{Format, Manifest, Names, sample_cloud, write_cloud};
    use super::*;
    use std::fs;

    #[test]
    fn file_of_every_format_is_known_beside_its_manifest_and_marked_ones_alone() {
        let folder = tempfile::tempdir().unwrap();
        let unmarked =
            [Format::Npy, Format::Csv, Format::Xyz, Format::Kitti, Format::Png, Format::RangeNpy];
        let path = |format: &Format| folder.path().join(format.file_name(7));
        for &format in Format::ALL {
            write_cloud(format, &sample_cloud(), &Names::default(), &path(&format)).unwrap();
        }
        let alone = Own::of(folder.path());
        for format in Format::ALL {
            assert_eq!(alone.has(&path(format)), !unmarked.contains(format), "{}", format.name());
        }
        Manifest::default().write(folder.path()).unwrap();
        let beside = Own::of(folder.path());
        assert!(Format::ALL.iter().all(|format| beside.has(&path(format))));
    }

    #[test]
    fn files_of_others_stay_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            fs::write(folder.path().join(name), text).unwrap();
            Own::of(folder.path()).has(&folder.path().join(name))
        };
        assert!(!put("index.html", "<!doctype html><title>macropulse</title>"));
        assert!(!put("manifest.json", "{\"name\": \"app\", \"schema_version\": 1}"));
        assert!(!put("scan-000000.csv", "x_m,y_m,z_m\n1,2,3\n"));
        assert!(!put("a.pcd", "# .PCD v0.7\n"));
        assert!(!put("notes.txt", "macropulse"));
        assert!(put("page.html", GENERATOR));
        assert!(put("index.html", &format!("{GENERATOR}<a href=\"./a.png\">a.png</a>")));
        assert!(put("a.png", "") && !put("b.png", ""));
        assert!(put("manifest.json", "{\n  \"schema_version\": 1, \"files\": [\"b.png\"]}"));
        assert!(put("b.png", "") && put("scan-000000.csv", "") && !put("scan.csv", ""));
        assert!(!Own::of(folder.path()).has(&folder.path().join("c.pcd")));
    }

    #[cfg(unix)]
    #[test]
    fn link_is_not_ours_wherever_it_leads() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("page.html"), GENERATOR).unwrap();
        let link = folder.path().join("index.html");
        std::os::unix::fs::symlink("page.html", &link).unwrap();
        assert!(!Own::of(folder.path()).has(&link));
    }
}
