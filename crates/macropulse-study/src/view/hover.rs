//! Data of a chart for the script that shows its values at the pointer.

use serde_json::{Value, json};

use super::chart::{Axis, Chart};
use super::plot::Plane;
use crate::text::short;

/// Titles of the axes, the area between them, and the points of every series in it, with the places
/// where they are drawn: as `theme/hover.js` describes them.
pub(super) fn told(chart: &Chart, plane: &Plane) -> Value {
    let edges = [plane.left(), plane.top(), plane.right(), plane.bottom()];
    let [left, top, right, bottom] = edges;
    let edges = edges.map(rounded);
    let series = chart.series.iter().map(|series| {
        let points = series.points.iter().filter_map(|&[x, y]| {
            let [at, height] = plane.place([x, y])?;
            let is_inside = (left - 1.0..=right + 1.0).contains(&at)
                && (top - 1.0..=bottom + 1.0).contains(&height);
            let texts = [text(&chart.x, x), text(&chart.y, y)];
            is_inside.then(|| json!([rounded(at), rounded(height), texts[0], texts[1]]))
        });
        let points: Vec<Value> = points.collect();
        json!({ "name": series.label, "hue": series.hue.class(), "points": points })
    });
    json!({
        "x": chart.x.title,
        "y": chart.y.title,
        "box": edges,
        "series": series.collect::<Vec<Value>>(),
    })
}

/// A place to a tenth of a pixel.
fn rounded(place: f64) -> f64 {
    (place * 10.0).round() / 10.0
}

/// A value in words: the name of a category, or a number of five digits.
fn text(axis: &Axis, value: f64) -> String {
    let category = if value >= 0.0 && value.fract() == 0.0 {
        axis.categories.get(value as usize)
    } else {
        None
    };
    category.cloned().unwrap_or_else(|| number(value))
}

fn number(value: f64) -> String {
    let is_plain = value == 0.0 || (1e-4..1e9).contains(&value.abs());
    if is_plain { short(value) } else { format!("{value:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::super::chart::Style;
    use super::*;

    #[test]
    fn numbers_have_five_digits_at_most() {
        let told = [30.0, 0.1 + 0.2, 123.456_789, 2.5e-7, 123_456.7, -0.05, 0.0].map(number);
        assert_eq!(told, ["30", "0.3", "123.46", "2.500e-7", "123457", "-0.05", "0"]);
    }

    #[test]
    fn a_chart_tells_what_lies_between_its_axes() {
        let x = Axis::categories("lidar", &["a", "b"]);
        let chart = Chart::new("t", x, Axis::linear("points").limits(0.0, 10.0)).series(
            "s",
            Style::Points,
            vec![[0.0, 5.0], [1.0, 11.0], [1.0, f64::NAN]],
        );
        let svg = chart.svg();
        let (_, told) = svg.split_once("<metadata>").unwrap();
        let (told, _) = told.split_once("</metadata>").unwrap();
        let told: Value = serde_json::from_str(&told.replace("&quot;", "\"")).unwrap();
        let points = told["series"][0]["points"].as_array().unwrap();
        assert_eq!(points.len(), 1);
        assert_eq!((&points[0][2], &points[0][3]), (&json!("a"), &json!("5")));
        assert_eq!((&told["x"], &told["y"]), (&json!("lidar"), &json!("points")));
    }
}
