//! A varied key and its values.

use std::str::FromStr;

use super::Error;
use macropulse::scene::apart;

/// More values than this of one key are taken for a slip.
const MOST_VALUES: usize = 1000;

/// Digits of the values of a range: what lies beyond is rounding.
const DIGITS: usize = 9;

/// How to write values.
const REMEDY: &str = "write a list as 0,0.1,0.2, equal steps as 50..200:7 (7 values), or equal \
                      ratios as 1e6..1e10:log9 (9 values)";

/// A key with the values it takes, in the order in which they are shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Dotted key of the sensor file, of the environment, or of the scene behind `scene:`; `sensor`
    /// for sensors.
    pub key: String,
    /// The values as TOML.
    pub values: Vec<String>,
    /// How the values lie.
    pub spread: Spread,
}

/// How the values of an axis lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Numbers, shown in equal steps.
    Steps,
    /// Positive numbers, shown in equal ratios.
    Ratios,
    /// Names, or other values without an order.
    Names,
}

impl Axis {
    /// The axis of several sensors.
    pub(super) fn of_sensors(sensors: &[String]) -> Result<Self, Error> {
        Self::new("sensor", sensors.to_vec(), Spread::Names)
    }

    fn new(key: &str, values: Vec<String>, spread: Spread) -> Result<Self, Error> {
        if values.len() > MOST_VALUES {
            let count = values.len();
            return Error::asked(format!(
                "{key}: {count} values are too many; {MOST_VALUES} at most"
            ));
        }
        let twice = |at: usize| values[..at].iter().any(|before| is_same(before, &values[at]));
        if let Some(at) = (0..values.len()).find(|at| twice(*at)) {
            return Error::asked(format!("{key}: the value {} is given twice", values[at]));
        }
        Ok(Self { key: key.to_owned(), values, spread })
    }

    /// True if the key belongs to the scene or its environment, not to the sensor.
    pub(super) fn is_of_scene(&self) -> bool {
        !apart(&[(self.key.clone(), String::new())]).of_scene.is_empty()
    }

    /// Place of value number `index` on the axis: the value itself, or `index` for names.
    pub fn place(&self, index: usize) -> f64 {
        let number = self.values.get(index).and_then(|value| value.parse().ok());
        number.filter(|_| self.spread != Spread::Names).unwrap_or(index as f64)
    }
}

impl FromStr for Axis {
    type Err = Error;

    /// `KEY=VALUES`, where the values are a list with commas, `FROM..TO:N` for N values in equal
    /// steps, or `FROM..TO:logN` in equal ratios; both ends are among them.
    fn from_str(typed: &str) -> Result<Self, Error> {
        let Some((key, values)) = typed.split_once('=') else {
            return Error::asked(format!("{typed}: names no values; add = and {REMEDY}"));
        };
        let (key, values) = (key.trim(), values.trim());
        if key.is_empty() || values.is_empty() {
            return Error::asked(format!("{typed}: a key and its values are wanted; {REMEDY}"));
        }
        match values.split_once("..") {
            Some(range) => of_range(key, range),
            None => of_list(key, values),
        }
    }
}

fn of_list(key: &str, typed: &str) -> Result<Axis, Error> {
    let values: Vec<String> = items(typed).iter().map(|item| item.trim().to_owned()).collect();
    if values.iter().any(String::is_empty) {
        return Error::asked(format!("{key}: a value is missing in {typed}; {REMEDY}"));
    }
    let numbers: Option<Vec<f64>> = values.iter().map(|value| value.parse().ok()).collect();
    let Some(numbers) = numbers else {
        if let [one] = &values[..]
            && one.contains(':')
            && one.split(':').all(|part| part.parse::<f64>().is_ok())
        {
            return Error::asked(format!("{key}: {one} is no list and no range; {REMEDY}"));
        }
        return Axis::new(key, values, Spread::Names);
    };
    if let Some(wrong) = numbers.iter().position(|number| !number.is_finite()) {
        return Error::asked(format!("{key}: {} cannot be a value; {REMEDY}", values[wrong]));
    }
    let fold = |[low, high]: [f64; 2], value: &f64| [low.min(*value), high.max(*value)];
    let [low, high] = numbers.iter().fold([f64::INFINITY, f64::NEG_INFINITY], fold);
    // Two decades and more are not to be read in equal steps.
    let spread = if low > 0.0 && high / low >= 100.0 { Spread::Ratios } else { Spread::Steps };
    Axis::new(key, values, spread)
}

/// The parts of `typed` between commas that stand in no bracket.
fn items(typed: &str) -> Vec<&str> {
    let (mut items, mut depth, mut begin) = (Vec::new(), 0, 0);
    for (at, letter) in typed.char_indices() {
        match letter {
            '[' | '{' => depth += 1,
            ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                items.push(&typed[begin..at]);
                begin = at + 1;
            }
            _ => {}
        }
    }
    items.push(&typed[begin..]);
    items
}

fn of_range(key: &str, (from, rest): (&str, &str)) -> Result<Axis, Error> {
    let Some((to, count)) = rest.split_once(':') else {
        return Error::asked(format!(
            "{key}: {from}..{rest} does not say how many values; {REMEDY}"
        ));
    };
    let number = |typed: &str| match typed.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Error::asked(format!("{key}: {typed} is no end of a range; {REMEDY}")),
    };
    let (low, high) = (number(from)?, number(to)?);
    let (in_ratios, count) = match count.trim().strip_prefix("log") {
        Some(count) => (true, count),
        None => (false, count),
    };
    let count = match count.trim().parse::<usize>() {
        Ok(count) if (2..=MOST_VALUES).contains(&count) => count,
        Ok(count) => {
            return Error::asked(format!(
                "{key}: a range has 2 to {MOST_VALUES} values, not {count}"
            ));
        }
        Err(_) => {
            let count = count.trim();
            return Error::asked(format!("{key}: {count} is no number of values; {REMEDY}"));
        }
    };
    if in_ratios && !(low > 0.0 && high > 0.0) {
        return Error::asked(format!("{key}: equal ratios need both ends above 0"));
    }
    let value = |at: usize| {
        let share = at as f64 / (count - 1) as f64;
        match at {
            0 => low,
            _ if at == count - 1 => high,
            _ if in_ratios => rounded(low * libm::pow(high / low, share)),
            _ => rounded(low + (high - low) * share),
        }
    };
    let values = (0..count).map(|at| text(value(at))).collect();
    Axis::new(key, values, if in_ratios { Spread::Ratios } else { Spread::Steps })
}

fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// A number as TOML, without a point where it is whole: some keys count.
fn text(value: f64) -> String {
    match value.abs() {
        _ if value == 0.0 => "0".to_owned(),
        size if (1e-4..1e15).contains(&size) => value.to_string(),
        _ => format!("{value:e}"),
    }
}

/// True if two values are equal, even if they are written differently.
fn is_same(one: &str, other: &str) -> bool {
    match (one.parse::<f64>(), other.parse::<f64>()) {
        (Ok(one), Ok(other)) => one == other,
        _ => one == other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(typed: &str) -> Vec<String> {
        Axis::from_str(&format!("a.b={typed}")).unwrap().values
    }

    fn told(typed: &str) -> String {
        Axis::from_str(typed).unwrap_err().to_string()
    }

    #[test]
    fn a_list_is_kept_as_typed() {
        assert_eq!(values("0, 0.10,1e3"), ["0", "0.10", "1e3"]);
        assert_eq!(values("matched,blind"), ["matched", "blind"]);
        assert_eq!(values("{ prime = 29, x = [1,2] },{}"), ["{ prime = 29, x = [1,2] }", "{}"]);
        let axis = Axis::from_str("a = 3,x").unwrap();
        assert_eq!((axis.spread, axis.place(0), axis.place(1)), (Spread::Names, 0.0, 1.0));
    }

    #[test]
    fn a_range_has_both_ends_and_round_values_between() {
        assert_eq!(values("50..200:7"), ["50", "75", "100", "125", "150", "175", "200"]);
        assert_eq!(values("0..0.3:4"), ["0", "0.1", "0.2", "0.3"]);
        assert_eq!(values("1..-1:3"), ["1", "0", "-1"]);
        assert_eq!(
            values("1e6..1e10:log5"),
            ["1000000", "10000000", "100000000", "1000000000", "10000000000"]
        );
        assert_eq!(values("1e-6..1e-4:log3"), ["1e-6", "1e-5", "0.0001"]);
        assert_eq!(values("1e6..1e7:log3")[1], "3162277.66");
        assert_eq!(values("0..1e20:2")[1], "1e20");
    }

    #[test]
    fn decades_are_shown_in_equal_ratios() {
        let spread = |typed: &str| Axis::from_str(typed).unwrap().spread;
        assert_eq!(spread("a=1..100:log3"), Spread::Ratios);
        assert_eq!(spread("a=1,10,100"), Spread::Ratios);
        assert_eq!(spread("a=0,10,100"), Spread::Steps);
        assert_eq!(spread("a=1..100:3"), Spread::Steps);
        assert_eq!(Axis::from_str("a=1,10,100").unwrap().place(1), 10.0);
    }

    #[test]
    fn what_cannot_be_is_refused_with_a_remedy() {
        for (typed, word) in [
            ("a", "names no values"),
            ("=1", "a key and its values"),
            ("a=", "a key and its values"),
            ("a=1,,2", "a value is missing"),
            ("a=1,nan", "nan cannot be a value"),
            ("a=inf..1:3", "inf is no end"),
            ("a=1..x:3", "x is no end"),
            ("a=1..2", "how many values"),
            ("a=1..2:1000000000", "2 to 1000 values, not 1000000000"),
            ("a=1..2:1", "2 to 1000 values, not 1"),
            ("a=1..2:-3", "-3 is no number of values"),
            ("a=0..2:log3", "both ends above 0"),
            ("a=1..1:3", "1 is given twice"),
            ("a=0.1,0.10", "0.10 is given twice"),
        ] {
            assert!(told(typed).contains(word), "{typed}: {}", told(typed));
        }
        let long: Vec<String> = (0..=MOST_VALUES).map(|value| value.to_string()).collect();
        assert!(told(&format!("a={}", long.join(","))).contains("too many"));
    }
}
