//! `macropulse view`: a page to explore clouds.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use macropulse::formats::{Clouds, write_atomically};
use macropulse_study::record::{PAGE, describe, explain};
use macropulse_study::view::Explorer;
use serde_json::Value;

use crate::fault::Fault;
use crate::options::Common;
use crate::text::print;

/// Make a page to explore a point cloud: one HTML file that any browser opens, offline
///
/// The page shows the points in 3-D, coloured by range, intensity, outcome, ring or return number,
/// and the range image beside them; a click tells all that is known of a point.
#[derive(Args)]
#[command(after_help = "Examples:
  macropulse view out/street
  macropulse view scan-000000.pcd -o cloud.html")]
pub struct View {
    /// Point cloud in any format that can be read, or folder of a run
    #[arg(value_name = "FILE-or-DIR")]
    path: PathBuf,

    /// The page [default: index.html in the folder, or the name of the file with .html]
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
}

/// Endings of the files in a folder that hold clouds, the one that keeps most first. What ends as one
/// of the last may be many things: there the name must begin as that of a scan.
const ENDINGS: [&str; 9] = ["pcd", "ply", "las", "laz", "e57", "mcap", "npy", "csv", "bin"];

/// How many of the endings are of clouds alone.
const OF_CLOUDS: usize = 6;

/// The place of a file of a folder among [`ENDINGS`], if it may hold a cloud.
fn rank(name: &str) -> Option<usize> {
    let ending = Path::new(name).extension()?.to_str()?.to_lowercase();
    let rank = ENDINGS.iter().position(|known| *known == ending)?;
    (rank < OF_CLOUDS || name.starts_with("scan-")).then_some(rank)
}

/// Adds the clouds of the file at `path`.
fn add(page: &mut Explorer, name: &str, path: &Path) -> Result<(), Fault> {
    let mut clouds = Clouds::open(path)?;
    let mut at = 0;
    while let Some(cloud) = clouds.next() {
        let cloud = cloud?;
        let of_several = || format!("{name}, scan {}", cloud.scan);
        let name = if at == 0 && !name.ends_with(".mcap") { name.to_owned() } else { of_several() };
        page.cloud(&name, &cloud, &clouds.names());
        at += 1;
    }
    Ok(())
}

pub fn run(options: &View, common: &Common) -> Result<(), Fault> {
    let path = &options.path;
    let (page, output) = if path.is_dir() {
        let output = options.output.clone().unwrap_or_else(|| path.join(PAGE));
        (of_folder(path, &output)?, output)
    } else {
        let output = options.output.clone().unwrap_or_else(|| path.with_extension("html"));
        (of_file(path, &output)?, output)
    };
    let ending = output.extension().map(|ending| ending.to_ascii_lowercase());
    if ending.is_none_or(|ending| ending != "html" && ending != "htm") {
        return Err(Fault::Wrong(format!(
            "{}: what is written is a page: give it a name that ends in .html",
            output.display()
        )));
    }
    write_atomically(&output, |out| out.write_all(page.html().as_bytes()))?;
    if !common.quiet {
        print(&format!("open {}\n", output.display()))?;
    }
    Ok(())
}

fn of_file(path: &Path, output: &Path) -> Result<Explorer, Fault> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut page = Explorer::new(&name);
    page.file(&beside(output, path));
    add(&mut page, &name, path)?;
    Ok(page)
}

fn of_folder(folder: &Path, output: &Path) -> Result<Explorer, Fault> {
    let manifest = manifest(folder)?;
    let files = match &manifest {
        Some(manifest) => named(&manifest["files"]),
        None => listed(folder)?,
    };
    let clouds = clouds(&files);
    if clouds.is_empty() {
        let folder = folder.display();
        return Err(Fault::Wrong(format!(
            "{folder}: holds no point cloud that can be read; write one with \
             `macropulse simulate … --format pcd -o {folder}`"
        )));
    }
    let mut page = Explorer::new(&title(folder, manifest.as_ref()));
    if let Some(manifest) = &manifest {
        describe(&mut page, manifest);
        page.file(&beside(output, &folder.join("manifest.json")));
    }
    let files_of_the_page = files.iter().filter(|file| folder.join(file) != output);
    for file in files_of_the_page {
        page.file(&beside(output, &folder.join(file)));
        explain(&mut page, &folder.join(file));
    }
    for file in clouds {
        add(&mut page, file, &folder.join(file))?;
    }
    Ok(page)
}

/// Sensor and scene of a run, or the name of the folder.
fn title(folder: &Path, manifest: Option<&Value>) -> String {
    let name = |what: &str| manifest.and_then(|manifest| manifest[what]["name"].as_str());
    if let Some((sensor, scene)) = name("sensor").zip(name("scene")) {
        return format!("{sensor} in {scene}");
    }
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The manifest of a folder, if it has one.
fn manifest(folder: &Path) -> Result<Option<Value>, Fault> {
    let path = folder.join("manifest.json");
    if !path.exists() {
        return Ok(None);
    }
    let name = path.display().to_string();
    let text = fs::read_to_string(&path).map_err(|error| Fault::unreadable(&name, &error))?;
    let manifest = serde_json::from_str(&text).map_err(|error| {
        Fault::Wrong(format!("{name}: is not the manifest of a run: {error}; name a cloud instead"))
    })?;
    Ok(Some(manifest))
}

fn named(list: &Value) -> Vec<String> {
    let names = list.as_array().into_iter().flatten();
    names.filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Names of the clouds in a folder without a manifest.
fn listed(folder: &Path) -> Result<Vec<String>, Fault> {
    let unreadable = |error| Fault::unreadable(&folder.display().to_string(), &error);
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
        if rank(&name).is_some() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// Of several files of one cloud, which differ in their endings, the one that keeps most; files with
/// all scans of a run only where no others hold them.
fn clouds(files: &[String]) -> Vec<&String> {
    let mut chosen: Vec<(usize, &String)> = Vec::new();
    for file in files {
        let Some(rank) = rank(file) else { continue };
        let stem = Path::new(file).with_extension("");
        match chosen.iter_mut().find(|(_, other)| Path::new(other).with_extension("") == stem) {
            Some(other) if rank < other.0 => *other = (rank, file),
            Some(_) => {}
            None => chosen.push((rank, file)),
        }
    }
    let is_of_run = |file: &String| file.to_lowercase().ends_with(".mcap");
    let has_others = chosen.iter().any(|(_, file)| !is_of_run(file));
    chosen.retain(|(_, file)| !has_others || !is_of_run(file));
    // Of one run in several kinds of messages, the first: they sort with what we read before the rest.
    chosen.dedup_by(|(_, one), (_, other)| is_of_run(one) && is_of_run(other));
    chosen.into_iter().map(|(_, file)| file).collect()
}

/// The path of `file` from the folder of `page`; the path from the root where they share none.
fn beside(page: &Path, file: &Path) -> String {
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let (page, file) = (absolute(page), absolute(file));
    let mut up = String::new();
    for folder in page.ancestors().skip(1) {
        if let Ok(below) = file.strip_prefix(folder) {
            return up + &below.display().to_string();
        }
        up += "../";
    }
    file.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_linked_by_its_way_from_the_page() {
        let way = |page: &str, file: &str| beside(Path::new(page), Path::new(file));
        assert_eq!(way("/a/page.html", "/a/b.pcd"), "b.pcd");
        assert_eq!(way("/a/c/page.html", "/a/b/d.pcd"), "../b/d.pcd");
        assert_eq!(way("page.html", "b.pcd"), "b.pcd");
    }

    #[test]
    fn each_cloud_is_taken_once() {
        let files = ["scan-0.pcd", "range-0.png", "scan-1.PCD", "scan-0.csv"].map(str::to_owned);
        assert_eq!(clouds(&files), ["scan-0.pcd", "scan-1.PCD"]);
        let files = ["range-0.npy", "scan-0.npy", "scans.mcap", "shots-0.csv"].map(str::to_owned);
        assert_eq!(clouds(&files), ["scan-0.npy"]);
        assert_eq!(clouds(&files[2..]), ["scans.mcap"]);
    }
}
