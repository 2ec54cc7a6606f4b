//! Figures that others have published, each with its source: ours are as near as each may differ.
//!
//! They are those of `macropulse validate`, listed in docs/validation.md.
#![allow(clippy::unwrap_used)]

use std::sync::LazyLock;

use macropulse_study::validate::{Figure, Within, published};

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

/// What was asked for is among them.
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
