//! Charts one below the other.

use super::chart::Chart;
use super::svg::{Svg, standalone};

/// `charts` one below the other, as a file of its own, called `title` for those who cannot see it.
pub fn stacked(title: &str, charts: &[Chart]) -> String {
    let width = charts.iter().map(|chart| chart.size[0]).fold(0.0, f64::max);
    let height = charts.iter().map(|chart| chart.size[1]).sum();
    let mut svg = Svg::new([width, height], title);
    let mut top = 0.0;
    for chart in charts {
        svg.drawing(top, &chart.svg());
        top += chart.size[1];
    }
    standalone(&svg.finish())
}

#[cfg(test)]
mod tests {
    use super::super::chart::Axis;
    use super::super::svg::is_balanced;
    use super::*;

    #[test]
    fn a_stack_is_as_high_as_its_charts() {
        let chart = Chart::new("<a>", Axis::linear("x"), Axis::linear("y"));
        let svg = stacked("all", &[chart.clone(), chart]);
        assert!(svg.contains("viewBox=\"0 0 704 720\""));
        assert!(svg.contains("translate(0 360)"));
        assert!(is_balanced(&svg));
    }
}
