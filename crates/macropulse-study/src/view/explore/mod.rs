//! A page to explore clouds: one HTML file, with the points in it, that needs nothing beside it.
//!
//! The files beside this one hold the page as a browser reads it: `page.html`, `explore.css`, and the
//! scripts. The points are drawn by WebGL 2.

mod packed;
mod scan;

use macropulse::formats::Names;
use macropulse::points::{Outcome, PointCloud};
use serde::Serialize;
use serde_json::json;

use super::colour::outcome_colour;
use super::page::{Section, inline, sections};
use super::svg::escape;
use super::theme;
use scan::Scan;

/// The scripts, in the order in which each uses those before it.
const SCRIPTS: [&str; 9] = [
    include_str!("columns.js"),
    include_str!("colours.js"),
    include_str!("camera.js"),
    include_str!("points.js"),
    include_str!("overlay.js"),
    include_str!("image.js"),
    include_str!("panel.js"),
    include_str!("controls.js"),
    include_str!("main.js"),
];

/// Characters of packed clouds that a page holds; the first cloud is always let in.
const ROOM: usize = 32 << 20;

/// A page in the making.
#[derive(Debug, Clone)]
pub struct Explorer {
    title: String,
    facts: Vec<(String, String)>,
    files: Vec<String>,
    scans: Vec<Scan>,
    /// Clouds for which there was no room.
    left_out: usize,
    sections: Vec<Section>,
    used: usize,
}

impl Explorer {
    /// A page without a cloud.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            facts: Vec::new(),
            files: Vec::new(),
            scans: Vec::new(),
            left_out: 0,
            sections: Vec::new(),
            used: 0,
        }
    }

    /// Adds a line to what is told beside the cloud.
    pub fn fact(&mut self, what: &str, value: &str) {
        self.facts.push((what.to_owned(), value.to_owned()));
    }

    /// Adds a link to a file, by its path from the page.
    pub fn file(&mut self, path: &str) {
        self.files.push(path.to_owned());
    }

    /// Adds a cloud under the name `label`, if there is room: the page holds 32 million characters of clouds.
    /// If a cloud has more than two million points, every second, third and so on is shown. The page says
    /// what it leaves out.
    ///
    /// Lengths are kept to 0.1 mm, times to 0.1 ns, intensities to 0.0001; all of them coarser by tens
    /// where they span more than a thousand million steps.
    pub fn cloud(&mut self, label: &str, cloud: &PointCloud, names: &Names) {
        if self.used >= ROOM {
            return self.leave_out();
        }
        let scan = Scan::of(label, cloud, names);
        self.used += scan.size();
        if self.used > ROOM && !self.scans.is_empty() {
            self.used = ROOM;
            return self.leave_out();
        }
        self.scans.push(scan);
    }

    /// Counts a cloud that is not to be in the page.
    pub fn leave_out(&mut self) {
        self.left_out += 1;
    }

    /// Adds a section below the cloud, as of what was sent and received of one pixel. One called
    /// `Pixel ROW,COLUMN` is linked from that pixel.
    pub fn section(&mut self, section: Section) {
        self.sections.push(section);
    }

    /// How true the page is to the clouds, in words.
    fn kept(&self) -> String {
        let mut kept =
            "This page keeps lengths to 0.1 mm, times to 0.1 ns and intensities to 0.0001; \
                        the files keep all."
                .to_owned();
        if self.left_out > 0 {
            let clouds = if self.left_out == 1 { "cloud is" } else { "clouds are" };
            kept += &format!(
                " {} {clouds} not in it, which would make it too large to open with ease; \
                 `macropulse view FILE` makes a page of any of them.",
                self.left_out
            );
        }
        kept
    }

    /// The page as HTML.
    pub fn html(&self) -> String {
        let about = json!({
            "outcomes": Outcome::ALL.map(|outcome| json!({
                "name": outcome.name(),
                "colour": outcome_colour(outcome),
            })),
        });
        let mut html = String::with_capacity(self.used + (1 << 17));
        let parts = include_str!("page.html").split("{{").enumerate();
        for (at, part) in parts {
            let Some((name, text)) = part.split_once("}}").filter(|_| at > 0) else {
                html += part;
                continue;
            };
            match name {
                "title" => html += &escape(&self.title),
                "style" => {
                    html += &theme::style();
                    html += include_str!("explore.css");
                }
                "facts" => html.extend(self.facts.iter().map(|(what, value)| {
                    format!("<div><dt>{}</dt><dd>{}</dd></div>\n", inline(what), inline(value))
                })),
                "files" => html += &theme::links(&self.files),
                "labels" => html.extend(self.scans.iter().enumerate().map(|(at, scan)| {
                    format!("<option value=\"{at}\">{}</option>\n", escape(scan.label()))
                })),
                "kept" => html += &escape(&self.kept()),
                "sections" => html += &sections(&self.sections),
                "about" => html += &embedded("about", &about),
                "scans" => html.extend(
                    self.scans
                        .iter()
                        .enumerate()
                        .map(|(at, scan)| embedded(&format!("scan-{at}"), scan)),
                ),
                "script" => {
                    html += "<script>\n\"use strict\";\n(() => {\n";
                    html.extend(theme::SCRIPTS.into_iter().chain(SCRIPTS));
                    html += "})();\n</script>\n";
                }
                _ => {}
            }
            html += text;
        }
        html
    }
}

/// JSON that a script finds by its name. No text in it can end the element.
fn embedded(id: &str, value: &impl Serialize) -> String {
    // Names are strings and numbers finite: there is nothing JSON could refuse.
    let json = serde_json::to_string(value).unwrap_or_default().replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{id}\">{json}</script>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(points: usize) -> PointCloud {
        let length: Vec<f32> = (0..points).map(|at| at as f32).collect();
        PointCloud {
            x: length.clone(),
            y: length.clone(),
            z: length.clone(),
            range: length.clone(),
            intensity: length,
            time_ns: vec![0.0; points],
            return_number: vec![1; points],
            number_of_returns: vec![1; points],
            peak: vec![0; points],
            marks: vec![0; points],
            margin: vec![0; points],
            saturated: vec![false; points],
            ..PointCloud::default()
        }
    }

    #[test]
    fn a_page_needs_nothing_beside_it_and_markup_stays_text() {
        let names = ["</script><script>alert(1)</script>".to_owned()];
        let mut page = Explorer::new("<b>");
        page.fact("seed", "<i>");
        page.file("a b.pcd");
        page.cloud("<u>", &cloud(3), &Names { objects: &names, materials: &names });
        page.section(Section::new("Pixel 3,10").paragraph("x"));
        let html = page.html();
        assert!(!html.contains("<script>alert") && !html.contains("<b>") && !html.contains("<i>"));
        assert!(html.contains("<title>&lt;b&gt;</title>") && html.contains("href=\"./a%20b.pcd\""));
        assert!(html.contains("id=\"pixel-3-10\"") && !html.contains("{{"));
        let outside = html.replace("\"http://www.w3.org/2000/svg\"", "");
        for resource in ["http", "url(", "@import", "<link", "<script src", "fetch("] {
            assert!(!outside.contains(resource), "{resource}");
        }
    }

    #[test]
    fn a_cloud_without_a_point_has_a_page() {
        let mut page = Explorer::new("t");
        page.cloud("0", &PointCloud::default(), &Names::default());
        assert!(page.html().contains("\"points\":0"));
    }

    #[test]
    fn a_large_cloud_is_thinned_and_the_page_says_of_how_many() {
        let scan = Scan::of("0", &cloud(scan::MOST_POINTS + 1), &Names::default());
        let json = serde_json::to_value(&scan).unwrap();
        assert_eq!(json["of"], scan::MOST_POINTS + 1);
        assert_eq!(json["points"], scan::MOST_POINTS / 2 + 1);
    }

    #[test]
    fn clouds_without_room_are_counted() {
        let mut page = Explorer::new("t");
        page.cloud("0", &cloud(3), &Names::default());
        page.used = ROOM - 1;
        page.cloud("1", &cloud(3), &Names::default());
        page.cloud("2", &cloud(3), &Names::default());
        assert_eq!((page.scans.len(), page.left_out), (1, 2));
        assert!(page.html().contains("2 clouds are not in it"));
    }
}
