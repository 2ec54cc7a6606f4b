//! The display of a scan in a notebook.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use macropulse::points::PointCloud;
use macropulse_study::view::{Layout, RangePicture};
use serde_json::Value;

/// Returns a cloud as HTML: the text `said`, its range image, and the outcomes of its pixels by its manifest.
pub fn html(cloud: &PointCloud, said: &str, manifest: &Value) -> String {
    let told = escaped(said.trim_matches(['<', '>']));
    let picture = picture(cloud).map_or(String::new(), |png| {
        let png = STANDARD.encode(png);
        format!(
            "<img alt=\"Range image, near red to far blue\" style=\"max-width:100%\" \
                 src=\"data:image/png;base64,{png}\">"
        )
    });
    let outcomes = manifest.get("outcomes").and_then(Value::as_object);
    let outcomes = outcomes.into_iter().flatten().filter(|(_, count)| count.as_u64() != Some(0));
    let cells: Vec<String> = outcomes
        .map(|(name, count)| format!("<td style=\"text-align:left\">{name} {count}</td>"))
        .collect();
    let pixels = match cells.is_empty() {
        true => String::new(),
        false => format!("<table><tr><th>pixels</th>{}</tr></table>", cells.concat()),
    };
    format!("<div><p><code>{told}</code></p>{picture}{pixels}</div>")
}

/// The range image in colours, as PNG; `None` where it cannot be drawn.
fn picture(cloud: &PointCloud) -> Option<Vec<u8>> {
    let distances = cloud.distances();
    let finite = distances.iter().copied().filter(|range| range.is_finite());
    let (near, far) =
        finite.fold((f32::INFINITY, 0.0_f32), |(low, high), r| (low.min(r), high.max(r)));
    let range = cloud.image(cloud.pick).spread(&distances, f32::NAN);
    let mut layout = Layout::new(cloud.rows, cloud.columns);
    let zoom = |pixels: usize, wanted: usize| (wanted / pixels.max(1)).clamp(1, 8);
    let even = zoom(cloud.columns, 800);
    layout.zoom = [even, even.max(zoom(cloud.rows, 160))];
    let far = if near < far { far } else { near + 1.0 };
    RangePicture { layout, range: &range, near: near.min(far - 1e-3), far }.png().ok()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
