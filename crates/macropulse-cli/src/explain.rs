//! Pixels to be explained.

use macropulse::codec::ShotLog;
use macropulse::design::Design;
use macropulse_study::record::Pixel;

use crate::fault::Fault;

/// A pixel as typed.
pub fn pixel(typed: &str) -> Result<Pixel, String> {
    let parts = typed.split_once(',');
    parts
        .and_then(|(row, column)| Some((row.trim().parse().ok()?, column.trim().parse().ok()?)))
        .ok_or_else(|| "write it as row,column, both from 0, as in --explain 240,424".to_owned())
}

/// Refuses pixels that the sensor does not have.
pub fn check(design: &Design, pixels: &[Pixel]) -> Result<(), Fault> {
    let (rows, columns) = (design.scan.rows, design.scan.columns);
    let is_outside =
        |(row, column): &&Pixel| u32::from(*row) >= rows || u32::from(*column) >= columns;
    match pixels.iter().find(is_outside) {
        None => Ok(()),
        Some((row, column)) => Err(Fault::Wrong(format!(
            "--explain {row},{column}: {} has rows 0 to {} and columns 0 to {}",
            design.name,
            rows - 1,
            columns - 1
        ))),
    }
}

/// The owned shot of `log` to `pixel`, if there is one.
pub fn shot_of(log: &ShotLog, (row, column): Pixel) -> Option<usize> {
    log.owned.clone().find(|&shot| (log.row[shot], log.column[shot]) == (row, column))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_two_numbers() {
        assert_eq!(pixel("3, 4"), Ok((3, 4)));
        assert!(pixel("3").is_err() && pixel("-1,2").is_err() && pixel("1,2,3").is_err());
    }
}
