//! `macropulse view`: a page to explore clouds.

use std::path::{Path, PathBuf};

use clap::Args;
use macropulse::design::preset_text;
use macropulse::formats::{Clouds, Reading, clear_unfinished, write_atomically, write_named};
use macropulse::opened;
use macropulse::scene::Scene;
use macropulse_study::record::{self, Left, PAGE, describe, explain};
use macropulse_study::view::Explorer;
use serde_json::Value;

use crate::convert::say_left_out;
use crate::fault::Fault;
use crate::folder::{Outputs, check_file};
use crate::memory::MemoryLimit;
use crate::options::Common;
use crate::text::print;

/// Make a page to explore a point cloud: one HTML file that any browser opens, offline
///
/// The page shows the points in 3-D, and the range image beside them. Points are coloured by range,
/// intensity, outcome, ring or return number; a click tells all that is known of a point.
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

    #[command(flatten)]
    memory: MemoryLimit,

    /// Show only the clouds of this topic of an MCAP file [default: those of all topics]
    #[arg(long, value_name = "TOPIC")]
    topic: Option<String>,
}

/// How clouds are read for a page, and what is said of them.
struct Reader<'a> {
    reading: Reading,
    common: &'a Common,
}

impl Reader<'_> {
    /// Adds the clouds of the file at `path`, called `name`, to a page.
    fn add(&self, page: &mut Explorer, name: &str, path: &Path) -> Result<(), Fault> {
        let mut clouds = Clouds::open_with(path, &self.reading)?;
        while let Some(cloud) = clouds.next() {
            let cloud = cloud?;
            let name = match clouds.has_several() {
                true => format!("{name}, scan {}", cloud.scan),
                false => name.to_owned(),
            };
            page.cloud(&name, &cloud, &clouds.names());
        }
        say_left_out(path, &clouds, &self.reading, self.common);
        Ok(())
    }
}

pub fn run(options: &View, common: &Common) -> Result<(), Fault> {
    let path = &options.path;
    let room = options.memory.cloud_room();
    let reader = Reader { reading: Reading { room, topic: options.topic.clone() }, common };
    refuse_name(path)?;
    let left = if path.is_dir() { Some(Left::of(path)?) } else { None };
    let inputs = match &left {
        Some(left) => {
            left.files.iter().filter(|file| *file != PAGE).map(|one| path.join(one)).collect()
        }
        None => vec![path.clone()],
    };
    let output = options.page(&inputs)?;
    let page = match left {
        Some(left) => of_folder((path, &left), &output, &reader)?,
        None => of_file((path, &output), &reader)?,
    };
    if let Some(folder) = output.parent() {
        clear_unfinished(folder);
    }
    let html = page.html();
    match options.output {
        Some(_) => write_named(&output, |out| out.write_all(html.as_bytes())),
        None => write_atomically(&output, |out| out.write_all(html.as_bytes())),
    }?;
    if !common.quiet && !opened::is_standard_output(&output) {
        print(&format!("open {}\n", output.display()))?;
    }
    Ok(())
}

impl View {
    /// The page to write: where one is named, or beside what is shown.
    fn page(&self, inputs: &[PathBuf]) -> Result<PathBuf, Fault> {
        let Some(output) = &self.output else {
            let output = match self.path.is_dir() {
                true => self.path.join(PAGE),
                false => self.path.with_extension("html"),
            };
            let name = output.file_name().into_iter();
            let outputs = Outputs::named(name).beside(inputs).or("name another page with -o");
            outputs.check(output.parent().unwrap_or(Path::new("")))?;
            return Ok(output);
        };
        let ending = output.extension().map(|ending| ending.to_ascii_lowercase());
        let is_page = ending.is_some_and(|ending| ending == "html" || ending == "htm");
        if !is_page && !opened::is_written_through(output) {
            return Err(Fault::Wrong(format!(
                "{}: what is written is a page: give it a name that ends in .html",
                output.display()
            )));
        }
        check_file(output, inputs)?;
        Ok(output.clone())
    }
}

/// Refuses a ready sensor or scene where what came of one is wanted.
fn refuse_name(path: &Path) -> Result<(), Fault> {
    let name = path.to_str().filter(|_| !path.exists()).unwrap_or_default();
    let (is, sensor, scene) = if preset_text(name).is_some() {
        ("sensor", name, "street")
    } else if Scene::builtin(name).is_some() {
        ("scene", "hdl-64e", name)
    } else {
        return Ok(());
    };
    Err(Fault::Wrong(format!(
        "{name}: is a {is}, where a point cloud or the folder of a run is wanted; scan first, as \
         `macropulse simulate {sensor} {scene} -o out`"
    )))
}

fn of_file((path, output): (&Path, &Path), reader: &Reader) -> Result<Explorer, Fault> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut page = Explorer::new(&name);
    page.file(&beside(output, path));
    reader.add(&mut page, &name, path)?;
    Ok(page)
}

fn of_folder(
    (folder, left): (&Path, &Left),
    output: &Path,
    reader: &Reader,
) -> Result<Explorer, Fault> {
    if let Some(first) = left.outside.first() {
        let (folder, count) = (folder.display(), left.outside.len());
        let told = format!(
            "{folder}: {first} leads out of the folder ({count} such in all) and is not shown; name the \
             file itself to see it"
        );
        reader.common.note(&told);
    }
    if left.is_unfinished {
        let folder = folder.display();
        let told = format!(
            "{folder}: the run that writes into it is not over, or was killed: what is shown may be of \
             several runs"
        );
        reader.common.note(&told);
    }
    let clouds = left.clouds();
    if clouds.is_empty() {
        return Err(record::Error::NoCloud { folder: folder.to_owned() }.into());
    }
    let mut page = Explorer::new(&title(folder, left.manifest.as_ref()));
    if let Some(manifest) = &left.manifest {
        describe(&mut page, manifest);
        page.file(&beside(output, &folder.join("manifest.json")));
    }
    let files_of_the_page = left.files.iter().filter(|file| folder.join(file) != output);
    for file in files_of_the_page {
        page.file(&beside(output, &folder.join(file)));
        explain(&mut page, &folder.join(file));
    }
    for file in clouds {
        reader.add(&mut page, file, &folder.join(file))?;
    }
    Ok(page)
}

/// Sensor and scene of a run, or the name of the folder.
fn title(folder: &Path, manifest: Option<&Value>) -> String {
    if let Some(title) = manifest.and_then(record::title) {
        return title;
    }
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
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
}
