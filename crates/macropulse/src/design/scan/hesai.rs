//! The lasers of a turning head from the angle correction file of a Hesai sensor. The file is a table of text
//! with a line for each laser: its number from 1, its elevation and its azimuth, degrees \[Nebula\].
//!
//! With φ the azimuth of the head, clockwise from y, and α and ε the angles of a line, the driver has
//!
//! x = R·cos ε·sin(φ + α)
//! y = R·cos ε·cos(φ + α)
//! z = R·sin ε
//!
//! which is a beam whose azimuth is −α from that of the head, to the left, and whose elevation is ε. Lasers
//! fire in the order of their numbers: the times between them stand in another file of the maker.

use super::laser::{AZIMUTH, ELEVATION, Laser, Limit, MOST_LASERS};

/// The headings of the columns, in lower case; the first has one of two names.
const HEADINGS: [&[&str]; 3] = [&["laser id", "channel"], &["elevation"], &["azimuth"]];

/// The lasers of the table `text`, in the order of their numbers.
///
/// Lines before the headings are passed over.
///
/// # Errors
/// Says in one sentence, with the line, what is wrong with it.
pub(super) fn lasers(text: &str, origin: &str) -> Result<Vec<Laser>, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate();
    if !lines.by_ref().any(|(_, line)| is_headings(line)) {
        return Err(format!(
            "{origin}: has no line `Laser id,Elevation,Azimuth`, as the angle correction file of a Hesai \
             sensor does; angles of other sensors are listed under scan.spinning.lasers"
        ));
    }
    let mut by_number: Vec<Option<Laser>> = Vec::new();
    for (at, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let refused = |said: String| format!("{origin}:{}: {said}", at + 1);
        let (number, laser) = laser(line).map_err(refused)?;
        by_number.resize(by_number.len().max(number), None);
        if by_number[number - 1].replace(laser).is_some() {
            return Err(refused(format!("laser {number} stands twice: leave one line out")));
        }
    }
    if by_number.is_empty() {
        return Err(format!("{origin}: lists no laser below its headings"));
    }
    match by_number.iter().position(Option::is_none) {
        Some(at) => Err(format!("{origin}: laser {} is missing", at + 1)),
        None => Ok(by_number.into_iter().flatten().collect()),
    }
}

fn cells(line: &str) -> Vec<&str> {
    line.split(',').map(str::trim).collect()
}

fn is_headings(line: &str) -> bool {
    let cells = cells(line);
    let is_one =
        |(cell, names): (&&str, &[&str])| names.iter().any(|name| cell.eq_ignore_ascii_case(name));
    cells.len() == HEADINGS.len() && cells.iter().zip(HEADINGS).all(is_one)
}

/// The number of a laser, from 1, and what its line says of it.
fn laser(line: &str) -> Result<(usize, Laser), String> {
    let cells = cells(line);
    let [number, elevation, azimuth] = cells[..] else {
        return Err(format!(
            "has {} cells, but a laser has three: its number, elevation and azimuth",
            cells.len()
        ));
    };
    let number: usize = number.parse().unwrap_or(0);
    if !(1..=MOST_LASERS).contains(&number) {
        return Err(format!("the first cell must be a number from 1 to {MOST_LASERS}"));
    }
    let angle = |cell: &str, limit: &Limit| {
        let Limit { what, most } = limit;
        let degrees = cell.parse().ok().filter(|degrees: &f64| degrees.abs() <= *most);
        degrees.map(f64::to_radians).ok_or_else(|| {
            format!("the {what} is `{cell}`, but must lie between -{most} and {most} degrees")
        })
    };
    let elevation = angle(elevation, &ELEVATION)?;
    let azimuth = -angle(azimuth, &AZIMUTH)?;
    Ok((number, Laser { elevation, azimuth, range_offset: 0.0, origin: [0.0; 3] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const TWO: &str = "Laser id,Elevation,Azimuth\r\n2,13.5,-1.25\r\n1,14.4,3.3\r\n";

    /// A point of a laser by the driver's formulae is one on the beam.
    #[test]
    fn a_beam_goes_through_the_points_that_the_driver_has() {
        let newer = TWO.replace("Laser id", "Channel");
        for text in [TWO, &newer, &format!("EEFF,1.1\n{TWO}")] {
            let lasers = lasers(text, "a.csv").unwrap();
            assert_eq!(lasers.len(), 2);
            for (laser, [elevation, azimuth]) in lasers.iter().zip([[14.4, 3.3], [13.5, -1.25_f64]])
            {
                let (head, range) = (0.7_f64, 20.0);
                let (e, turned) = (f64::to_radians(elevation), head + azimuth.to_radians());
                let driver = [
                    range * e.cos() * turned.sin(),
                    range * e.cos() * turned.cos(),
                    range * e.sin(),
                ];
                // The head looks along azimuth 90° − φ, counted from x to the left.
                let (sin_a, cos_a) = (std::f64::consts::FRAC_PI_2 - head + laser.azimuth).sin_cos();
                let (sin_e, cos_e) = laser.elevation.sin_cos();
                let found = [range * cos_e * cos_a, range * cos_e * sin_a, range * sin_e];
                for (found, driver) in found.into_iter().zip(driver) {
                    assert_relative_eq!(found, driver, epsilon = 1e-12);
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let told = |text: &str| lasers(text, "a.csv").unwrap_err();
        for (wrong, right, said) in [
            (
                "2,95.0",
                "2,13.5",
                "a.csv:2: the elevation is `95.0`, but must lie between -90 and 90",
            ),
            ("2,13.5,left", "2,13.5,-1.25", "a.csv:2: the azimuth is `left`"),
            ("1,13.5", "2,13.5", "a.csv:3: laser 1 stands twice"),
            ("3,13.5", "2,13.5", "a.csv: laser 2 is missing"),
            ("0,13.5", "2,13.5", "a.csv:2: the first cell must be a number from 1 to 1024"),
            ("1,14.4", "1,14.4,3.3", "a.csv:3: has 2 cells, but a laser has three"),
            (
                "Laser,Elevation,Azimuth",
                "Laser id,Elevation,Azimuth",
                "a.csv: has no line `Laser id",
            ),
        ] {
            assert!(TWO.contains(right), "{right}");
            let message = told(&TWO.replace(right, wrong));
            assert!(message.starts_with(said) && !message.contains('\n'), "{wrong}: {message}");
        }
        assert!(told("Channel,Elevation,Azimuth\n").ends_with("lists no laser below its headings"));
        assert!(told("").starts_with("a.csv: has no line"));
    }
}
