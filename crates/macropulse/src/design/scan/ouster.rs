//! The lasers of a turning head from the metadata of an Ouster sensor: JSON with a list of
//! `beam_altitude_angles` and one of `beam_azimuth_angles`, \[OusSdk\].
//!
//! R is the distance that a laser measures, n is `lidar_origin_to_beam_origin_mm`, and θ is the azimuth of
//! the head, counterclockwise. An azimuth and an altitude of the lists are α and ε. The maker has
//!
//! x = (R − n)·cos(θ − α)·cos ε + n·cos θ
//! y = (R − n)·sin(θ − α)·cos ε + n·sin θ
//! z = (R − n)·sin ε
//!
//! which is a beam along azimuth θ − α and elevation ε that begins n before the axis, along the azimuth
//! of the head, and whose clock starts n early.

use serde_json::Value;

use super::laser::{AZIMUTH, ELEVATION, Laser, Limit, MOST_LASERS, ORIGIN};

/// The lasers of the metadata `text`, from the first of its lists to the last.
///
/// # Errors
/// Says in one sentence what is wrong with it.
pub(super) fn lasers(text: &str, origin: &str) -> Result<Vec<Laser>, String> {
    let document: Value = serde_json::from_str(text).map_err(|error| {
        format!("{origin}:{}:{}: is no JSON from here on", error.line(), error.column())
    })?;
    // Sensors with newer firmware put the keys below `beam_intrinsics`.
    let key = |key: &str| document.get("beam_intrinsics").unwrap_or(&document).get(key);
    let angles = |name: &str, limit: &Limit| {
        let list = key(name).and_then(Value::as_array).ok_or_else(|| {
            format!("{origin}: has no list `{name}`, as the metadata of an Ouster sensor do")
        })?;
        let angle = |(at, value): (usize, &Value)| {
            let degrees = value.as_f64().filter(|degrees| degrees.abs() <= limit.most);
            degrees.map(f64::to_radians).ok_or_else(|| {
                let most = limit.most;
                format!(
                    "{origin}: entry {at} of {name} is {value}, but must lie between -{most} and \
                     {most} degrees"
                )
            })
        };
        list.iter().enumerate().map(angle).collect::<Result<Vec<f64>, String>>()
    };
    let altitudes = angles("beam_altitude_angles", &ELEVATION)?;
    let azimuths = angles("beam_azimuth_angles", &AZIMUTH)?;
    let count = altitudes.len();
    if count != azimuths.len() || !(1..=MOST_LASERS).contains(&count) {
        return Err(format!(
            "{origin}: lists {count} altitudes and {} azimuths, but 1 to {MOST_LASERS} of each \
             are read",
            azimuths.len()
        ));
    }
    let before = key("lidar_origin_to_beam_origin_mm").map_or(Some(0.0), Value::as_f64);
    let before = before.map(|millimetres| millimetres * 1e-3);
    let before = before.filter(|metres| metres.abs() <= ORIGIN.most).ok_or_else(|| {
        format!("{origin}: lidar_origin_to_beam_origin_mm must lie between -1000 and 1000")
    })?;
    let laser = |(elevation, azimuth): (f64, f64)| {
        let (sine, cosine) = libm::sincos(azimuth);
        Laser {
            elevation,
            azimuth: -azimuth,
            range_offset: -before,
            // The azimuth of the head, as seen from that of the beam.
            origin: [before * cosine, before * sine, 0.0],
        }
    };
    Ok(altitudes.into_iter().zip(azimuths).map(laser).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const TWO: &str = r#"{"beam_altitude_angles": [20.5, -3.25],
        "beam_azimuth_angles": [4.25, -1.4], "lidar_origin_to_beam_origin_mm": 15.8}"#;

    /// A point of a laser by the maker's formulae is one on the beam.
    #[test]
    fn a_beam_goes_through_the_points_that_the_maker_has() {
        let newer = format!("{{\"beam_intrinsics\": {TWO}, \"lidar_intrinsics\": {{}}}}");
        for text in [TWO, &newer] {
            let lasers = lasers(text, "a.json").unwrap();
            assert_eq!(lasers.len(), 2);
            for (laser, (altitude, azimuth)) in lasers.iter().zip([(20.5, 4.25), (-3.25, -1.4)]) {
                let (head, measured, n) = (0.7_f64, 20.0, 0.0158);
                let turned = head - f64::to_radians(azimuth);
                let (altitude, beam) = (f64::to_radians(altitude), measured - n);
                let maker = [
                    beam * turned.cos() * altitude.cos() + n * head.cos(),
                    beam * turned.sin() * altitude.cos() + n * head.sin(),
                    beam * altitude.sin(),
                ];
                let (sin_a, cos_a) = (head + laser.azimuth).sin_cos();
                let (sin_e, cos_e) = laser.elevation.sin_cos();
                let [x, y, z] = laser.origin;
                let range = measured + laser.range_offset;
                let found = [
                    x * cos_a - y * sin_a + range * cos_e * cos_a,
                    x * sin_a + y * cos_a + range * cos_e * sin_a,
                    z + range * sin_e,
                ];
                for (found, maker) in found.into_iter().zip(maker) {
                    assert_relative_eq!(found, maker, epsilon = 1e-12);
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told() {
        for (wrong, right, said) in [
            ("-93.25", "-3.25", "a.json: entry 1 of beam_altitude_angles is -93.25, but must lie"),
            ("\"far\"", "-3.25", "a.json: entry 1 of beam_altitude_angles is \"far\""),
            ("[4.25]", "[4.25, -1.4]", "a.json: lists 2 altitudes and 1 azimuths"),
            ("beam_angles", "beam_azimuth_angles", "a.json: has no list `beam_azimuth_angles`"),
            ("1e9", "15.8", "a.json: lidar_origin_to_beam_origin_mm must lie"),
            ("[20.5 -3.25]", "[20.5, -3.25]", "a.json:1:"),
        ] {
            assert!(TWO.contains(right), "{right}");
            let told = lasers(&TWO.replace(right, wrong), "a.json").unwrap_err();
            assert!(told.contains(said) && !told.contains('\n'), "{wrong}: {told}");
        }
    }
}
