//! Figures that others have published, each with its source: ours are as near as each may differ.
//!
//! They are those of `macropulse validate`, listed in docs/validation.md.
#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use macropulse::sim::Watch;
use macropulse_study::validate::{Figure, Findings, Within, places, published};

static PUBLISHED: LazyLock<Vec<Figure>> = LazyLock::new(|| published().unwrap());

/// `figure`, ours being beyond what it may differ by, or off by a unit where that is nothing.
fn moved(figure: &Figure) -> Figure {
    let by = match figure.within {
        Within::Exactly => 1.0,
        Within::Share(share) => 2.1 * share * figure.published.abs(),
        Within::Absolute(most) => 2.1 * most,
        Within::AtMost => figure.published - figure.ours + 1e-9,
        Within::AtLeast => figure.published - figure.ours - 1e-9,
    };
    Figure { ours: figure.ours + by, ..figure.clone() }
}

#[test]
fn every_published_figure_is_met_and_would_not_be_if_ours_were_another() {
    let figures = &*PUBLISHED;
    assert!(figures.len() > 150, "{} figures", figures.len());
    for figure in figures {
        let what = format!("{}, {}: {} published", figure.topic, figure.what, figure.published);
        assert!(figure.holds(), "{what}, {} here, {:?}", figure.ours, figure.within);
        assert!(!moved(figure).holds(), "{what}: {:?} lets everything pass", figure.within);
    }
}

/// All topics and sources that were asked for are among the figures.
#[test]
fn no_topic_and_no_source_is_left_out() {
    for (topic, source, least) in [
        ("detectors", "a published Monte Carlo", 12),
        ("light", "G173", 5),
        ("eye safety", "IEC60825", 18),
        ("scanners", "VLP16", 18),
        ("scanners", "HDL64", 4),
        ("scanners", "Mid40", 6),
        ("interference", "computed apart", 4),
        ("multiple access", "YK13", 18),
        ("multiple access", "computed apart", 3),
        ("materials", "SB", 7),
        ("samples", "computed apart", 12),
    ] {
        let of = |figure: &&Figure| figure.topic == topic && figure.source == source;
        let found = PUBLISHED.iter().filter(of).count();
        assert!(found >= least, "{found} of {topic}, {source}");
    }
}

/// Published figures stand on the page as they come out, and so do the forecasts of one sensor; those of all sensors
/// take minutes and are compared before a release.
#[test]
fn published_figures_stand_on_the_page() {
    let page = include_str!("../../../docs/validation.md");
    let watch = Watch { done: &|_| (), stop: &|| false };
    let forecasts = places("vlp-16", 1, &watch).unwrap();
    let findings = Findings { seed: 1, published: PUBLISHED.clone(), forecasts };
    let written = findings.markdown();
    let [before, written_before] =
        [page, &*written].map(|text| text.split_once("## Codes").unwrap().1);
    let [(figures, rows), (written_figures, written_rows)] =
        [before, written_before].map(|text| text.split_once("## Forecasts").unwrap());
    assert_eq!(figures, written_figures);
    let of_sensor = written_rows.lines().filter(|row| row.starts_with("| vlp-16 |"));
    let missing: Vec<_> = of_sensor.clone().filter(|row| !rows.contains(row)).collect();
    assert!(of_sensor.count() > 2 && missing.is_empty(), "{missing:#?}");
}
