//! Returns from surfaces beside the pixel.

use std::ops::RangeInclusive;

use crate::points::{Outcome, Surface};
use crate::scene::{Hits, Traced};

use super::NEAR;

/// Returns the surface of a return of `shot`, as `judged` unless the return is an edge. A wrong or false
/// return is an edge if a part of the macropulse met a surface in the `gate` within [`NEAR`] of it. Its
/// surface is then that one.
///
/// The beam sweeps a part of a pixel during a macropulse (docs/physics.md#mirror-motion). Its parts
/// are traced for the light, so no ray is cast here, and a range at which no light came back stays
/// what it is.
pub fn edge(
    judged: Surface,
    traced: &Traced,
    shot: usize,
    (gate, measured): (&RangeInclusive<f64>, f64),
) -> Surface {
    if !matches!(judged.outcome, Outcome::Wrong | Outcome::False) {
        return judged;
    }
    let shot = shot as u32;
    let met = traced.sub_macropulses.iter().flat_map(|hits| {
        let first = hits.shot.partition_point(|of| *of < shot);
        let of_shot = hits.shot[first..].iter().take_while(move |of| **of == shot);
        (first..).zip(of_shot).map(move |(i, _)| (hits, i))
    });
    let error = |range: f64| (range - measured).abs();
    let source = met
        .filter(|(hits, i)| gate.contains(&hits.range[*i]) && error(hits.range[*i]) <= NEAR)
        .min_by(|(a, i), (b, k)| error(a.range[*i]).total_cmp(&error(b.range[*k])));
    source.map_or(judged, |(hits, i)| surface(hits, i, Outcome::Edge))
}

/// Hit `at` as the surface of a return that came out as `outcome`.
pub fn surface(hits: &Hits, at: usize, outcome: Outcome) -> Surface {
    Surface {
        range: hits.range[at] as f32,
        object: hits.object[at],
        material: hits.material[at],
        cosine: hits.cosine[at],
        outcome,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the hit of one shot at a `range`.
    fn met(shot: u32, range: f64) -> Hits {
        Hits {
            shot: vec![shot],
            weight: vec![1.0],
            range: vec![range],
            cosine: vec![0.5],
            material: vec![3],
            object: vec![7],
            ..Hits::default()
        }
    }

    /// A shot whose last part meets a surface 30 m away.
    fn traced() -> Traced {
        Traced { middle: Hits::default(), sub_macropulses: vec![Hits::default(), met(5, 30.0)] }
    }

    fn outcome(before: Outcome, shot: usize, measured: f64) -> Outcome {
        let judged = Surface { outcome: before, ..Surface::NONE };
        edge(judged, &traced(), shot, (&(1.0..=100.0), measured)).outcome
    }

    #[test]
    fn a_return_from_a_part_of_the_macropulse_is_an_edge_with_its_surface() {
        let judged = Surface { outcome: Outcome::False, ..Surface::NONE };
        let seen = edge(judged, &traced(), 5, (&(1.0..=100.0), 30.1));
        let wanted =
            Surface { range: 30.0, object: 7, material: 3, cosine: 0.5, outcome: Outcome::Edge };
        assert_eq!(seen, wanted);
        assert_eq!(outcome(Outcome::Wrong, 5, 29.66), Outcome::Edge);
    }

    #[test]
    fn a_phantom_stays_false_and_a_point_of_the_pixel_is_none() {
        assert_eq!(outcome(Outcome::False, 5, 30.36), Outcome::False);
        assert_eq!(outcome(Outcome::Wrong, 5, 12.0), Outcome::Wrong);
        assert_eq!(outcome(Outcome::False, 4, 30.0), Outcome::False);
        assert_eq!(outcome(Outcome::Right, 5, 30.0), Outcome::Right);
        assert_eq!(outcome(Outcome::Near, 5, 30.0), Outcome::Near);
    }

    #[test]
    fn a_surface_beyond_the_gate_gives_no_edge() {
        let judged = Surface { outcome: Outcome::False, ..Surface::NONE };
        let seen = edge(judged, &traced(), 5, (&(1.0..=20.0), 30.0));
        assert_eq!(seen.outcome, Outcome::False);
    }
}
