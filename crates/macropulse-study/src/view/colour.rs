//! Colours and their meanings.

use macropulse::points::Outcome;

/// Red, green, blue, 0…255 (sRGB).
pub type Rgb = [u8; 3];

/// Background of all pictures.
pub(super) const NIGHT: Rgb = [14, 16, 22];
/// A pixel without a return: a shade off the background, so that the picture keeps its outline.
pub(super) const NOTHING: Rgb = [24, 27, 35];
/// Text on the background.
pub(super) const INK: Rgb = [226, 229, 236];
/// Text of less weight.
pub(super) const PALE: Rgb = [146, 152, 166];

/// Both ends of Turbo are too dark to be told from the background: they are left out.
const TURBO_PART: [f64; 2] = [0.07, 0.88];

/// Colour of a place on a scale from 0 (near, warm) to 1 (far, cool); places outside take the
/// colour of the end. NaN is the dark of a pixel without a return.
pub fn range_colour(place: f64) -> Rgb {
    if place.is_nan() {
        return NOTHING;
    }
    let [low, high] = TURBO_PART;
    let colour = colorous::TURBO.eval_continuous(high - place.clamp(0.0, 1.0) * (high - low));
    [colour.r, colour.g, colour.b]
}

/// Grey of a place on a scale from 0 (dark) to 1 (white). NaN is [`NOTHING`].
pub(super) fn grey(place: f64) -> Rgb {
    if place.is_nan() {
        return NOTHING;
    }
    // The square root is close to what eyes take for even steps.
    let level = (48.0 + 207.0 * place.clamp(0.0, 1.0).sqrt()) as u8;
    [level; 3]
}

/// Colour of an outcome, the same in pictures and in the report.
pub fn outcome_colour(outcome: Outcome) -> Rgb {
    match outcome {
        Outcome::Empty => NOTHING,
        Outcome::Right => [74, 163, 122],
        Outcome::Near => [240, 200, 80],
        Outcome::Wrong => [226, 87, 76],
        Outcome::Missed => [92, 124, 214],
        Outcome::False => [214, 112, 214],
        Outcome::Edge => [110, 214, 222],
    }
}

/// Place of `value` between `near` (0) and `far` (1); NaN if the ends are one.
pub(super) fn place(value: f32, near: f32, far: f32) -> f64 {
    let span = f64::from(far) - f64::from(near);
    if span == 0.0 { f64::NAN } else { (f64::from(value) - f64::from(near)) / span }
}

/// `a` where `share` is 0, `b` where it is 1.
pub(super) fn mix(a: Rgb, b: Rgb, share: f64) -> Rgb {
    let share = share.clamp(0.0, 1.0);
    [0, 1, 2].map(|at| (f64::from(a[at]) * (1.0 - share) + f64::from(b[at]) * share).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_warm_and_far_is_cool() {
        let [near, far] = [0.0, 1.0].map(range_colour);
        assert!(near[0] > 180 && near[2] < 40, "{near:?}");
        assert!(far[2] > 100 && far[0] < 80, "{far:?}");
    }

    #[test]
    fn outside_the_scale_is_its_end() {
        assert_eq!(range_colour(-3.0), range_colour(0.0));
        assert_eq!(range_colour(7.0), range_colour(1.0));
        assert_eq!(place(20.0, 10.0, 30.0), 0.5);
    }

    #[test]
    fn what_has_no_place_has_no_colour() {
        assert_eq!(range_colour(place(5.0, 5.0, 5.0)), NOTHING);
        assert_eq!(range_colour(f64::NAN), NOTHING);
        assert_eq!(grey(f64::NAN), NOTHING);
    }

    #[test]
    fn no_two_outcomes_look_alike() {
        let distance = |a: Rgb, b: Rgb| (0..3).map(|at| a[at].abs_diff(b[at]) as u32).sum::<u32>();
        for (at, a) in Outcome::ALL.into_iter().enumerate() {
            for b in &Outcome::ALL[at + 1..] {
                assert!(distance(outcome_colour(a), outcome_colour(*b)) > 90, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn mixing_ends_where_it_should() {
        assert_eq!(mix(NIGHT, INK, 0.0), NIGHT);
        assert_eq!(mix(NIGHT, INK, 2.0), INK);
    }
}
