//! `macropulse speed` as its user types it.

#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use common::Desk;

#[test]
fn every_figure_is_there_and_positive() {
    let figures = Desk::new().json("speed --json -j 1");
    for key in [
        "rays_per_s",
        "generate_x_real_time",
        "decode_x_real_time",
        "decode_noisy_x_real_time",
        "clean_scans_per_s",
        "full_scans_per_s",
    ] {
        assert!(figures[key].as_f64().unwrap() > 0.0, "{key} in {figures}");
    }
    assert_eq!(figures["threads"], 1);
}
