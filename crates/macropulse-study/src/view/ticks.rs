//! Ticks of an axis and their labels.

/// No axis has more ticks than this, whatever rounding does to its ends.
const MOST: usize = 200;

/// About `wanted` round values between `low` and `high`, their step 1, 2 or 5 times a power
/// of ten. Empty if there is no span.
pub(super) fn linear_ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) || wanted == 0 {
        return Vec::new();
    }
    let rough = span / wanted as f64;
    let decade = 10_f64.powi(rough.log10().floor() as i32);
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * decade)
        .find(|step| *step >= rough * 0.8)
        .unwrap_or(10.0 * decade);
    if !step.is_normal() {
        return Vec::new();
    }
    // Half a millionth of a step keeps an end that rounding would lose.
    let slack = 5e-7;
    let first = (low / step - slack).ceil() as i64;
    let last = (high / step + slack).floor() as i64;
    // Dividing by the whole inverse gives 0.3 where multiplying by 0.1 gives 0.30000000000000004.
    let inverse = (1.0 / step).round();
    let value = |at: i64| if step < 1.0 { at as f64 / inverse } else { at as f64 * step };
    (first..=last).take(MOST).map(value).collect()
}

/// Powers of ten between `low` and `high`, thinned to about `wanted`. Empty unless both are
/// positive.
pub(super) fn log_ticks(low: f64, high: f64, wanted: usize) -> Vec<f64> {
    if !(low > 0.0 && high > low && high.is_finite()) || wanted == 0 {
        return Vec::new();
    }
    let [first, last] = [(low.log10() - 1e-9).ceil() as i32, (high.log10() + 1e-9).floor() as i32];
    let decades = usize::try_from(last - first + 1).unwrap_or(0);
    let every = decades.div_ceil(wanted).max(1);
    (first..=last)
        .filter(|power| power.rem_euclid(every as i32) == 0)
        .map(|p| 10_f64.powi(p))
        .collect()
}

/// A tick's value with no more digits than its step asks for, thousands apart, true minus sign.
pub(super) fn label(value: f64, step: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if value.abs() >= 1e7 || value.abs() < 1e-4 {
        return power_label(value);
    }
    let digits = if step > 0.0 { (-(step.log10() + 1e-9).floor()).max(0.0) as usize } else { 0 };
    let plain = format!("{:.*}", digits.min(9), value.abs());
    let (whole, fraction) = plain.split_once('.').unwrap_or((&plain, ""));
    let mut text = String::new();
    if value < 0.0 {
        text.push('−');
    }
    text.push_str(&thousands(whole));
    if !fraction.is_empty() {
        text.push('.');
        text.push_str(fraction);
    }
    text
}

/// A power of ten as 10ⁿ; other values with their factor.
pub(super) fn power_label(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return value.to_string();
    }
    let mut power = value.abs().log10().floor() as i32;
    let mut factor = value / 10_f64.powi(power);
    if factor.abs() > 9.999_999 {
        factor /= 10.0;
        power += 1;
    }
    let small: String = power.to_string().chars().map(raised).collect();
    match (power, (factor - 1.0).abs() < 1e-6) {
        (0, true) => "1".into(),
        (1, true) => "10".into(),
        (_, true) => format!("10{small}"),
        _ => format!("{}·10{small}", (factor * 100.0).round() / 100.0),
    }
}

fn raised(digit: char) -> char {
    match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    }
}

/// Digits in groups of three with a narrow space, from 10 000 on.
fn thousands(digits: &str) -> String {
    if digits.len() < 5 {
        return digits.into();
    }
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(linear_ticks(0.0, 1.0, 5), [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]);
        assert_eq!(linear_ticks(27.3, 31.2, 4), [28.0, 29.0, 30.0, 31.0]);
        assert_eq!(linear_ticks(-1.0, 1.0, 4), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(log_ticks(1e-3, 1e3, 10), [1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(log_ticks(1e-18, 1.0, 7), [1e-18, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0]);
    }

    #[test]
    fn an_axis_without_span_has_no_ticks() {
        assert!(linear_ticks(1.0, 1.0, 5).is_empty());
        assert!(linear_ticks(0.0, f64::NAN, 5).is_empty());
        assert!(linear_ticks(0.0, 1e-320, 5).is_empty());
        assert!(linear_ticks(1e300, 1.1e300, 5).len() <= MOST);
        assert!(log_ticks(0.0, 10.0, 5).is_empty());
    }

    #[test]
    fn labels_are_short() {
        assert_eq!(label(0.6, 0.2), "0.6");
        assert_eq!(label(-25.0, 5.0), "−25");
        assert_eq!(label(407_040.0, 1.0), "407\u{202f}040");
        assert_eq!(label(1500.0, 500.0), "1500");
        assert_eq!(power_label(1e-12), "10⁻¹²");
        assert_eq!(power_label(2.5e9), "2.5·10⁹");
        assert_eq!(power_label(1.0), "1");
    }
}
