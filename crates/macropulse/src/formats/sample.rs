//! A cloud for the tests of all formats.

use crate::points::{NO_OBJECT, Outcome, Pick, PointCloud, Surfaces, Truth, Viewpoint};

/// A cloud of 2 × 3 pixels, one of them empty, for the tests of all formats.
pub(super) fn sample_cloud() -> PointCloud {
    let nan = f32::NAN;
    let fired_ns = vec![0.0, 40.946_5, 81.893, 122.84, 163.786, 204.732_5];
    PointCloud {
        scan: 3,
        rows: 2,
        columns: 3,
        viewpoint: Viewpoint { position: [1.5, -2.0, 0.25], turn: [0.6, 0.0, 0.0, -0.8] },
        returns_per_shot: 1,
        pick: Pick::Strongest,
        row: vec![0, 0, 1, 1, 1],
        column: vec![0, 1, 0, 1, 2],
        return_number: vec![1; 5],
        number_of_returns: vec![1; 5],
        x: vec![30.0, 30.5, 29.0, 31.25, 28.0],
        y: vec![1.0, 0.0, 1.5, 0.25, -1.0],
        z: vec![0.5, 0.5, -0.5, -0.25, -0.75],
        intensity: vec![0.8, 0.1, 0.3, 1.0, 0.0],
        range: vec![30.02, 30.5, 29.04, 31.26, 28.03],
        time_ns: [0, 1, 3, 4, 5].map(|pixel| fired_ns[pixel]).to_vec(),
        peak: vec![174, 170, 60, 174, 58],
        marks: vec![174, 174, 174, 174, 58],
        margin: vec![80, 70, 3, 81, 20],
        photons: vec![nan; 5],
        saturated: vec![false; 5],
        fired_ns,
        truth: Truth {
            returns: Surfaces {
                range: vec![30.02, 30.5, 40.0, 31.26, nan],
                object: vec![0, 0, 1, 0, NO_OBJECT],
                material: vec![1, 0, 2, 0, NO_OBJECT],
                cosine: vec![1.0, 0.5, 0.0, 0.999_999_9, nan],
                outcome: vec![
                    Outcome::Right,
                    Outcome::Near,
                    Outcome::Wrong,
                    Outcome::Right,
                    Outcome::False,
                ],
            },
            pixels: Surfaces {
                range: vec![30.02, 30.5, nan, 40.0, 31.26, nan],
                object: vec![0, 0, NO_OBJECT, 1, 0, NO_OBJECT],
                material: vec![1, 0, NO_OBJECT, 2, 0, NO_OBJECT],
                cosine: vec![1.0, 0.5, nan, 0.0, 0.999_999_9, nan],
                outcome: vec![
                    Outcome::Right,
                    Outcome::Near,
                    Outcome::Empty,
                    Outcome::Wrong,
                    Outcome::Right,
                    Outcome::False,
                ],
            },
            ..Truth::default()
        },
        ..PointCloud::default()
    }
}
