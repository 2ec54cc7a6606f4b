//! Files with clouds.

use macropulse::formats::{Clouds, read_range_png};

use crate::{assert_told, with_files};

/// Reads `bytes` as a file of this `ending` to its end.
pub fn read(ending: &str, bytes: &[u8]) {
    let name = format!("cloud.{ending}");
    with_files(&[(&name, bytes)], |folder| match Clouds::open(&folder.join(&name)) {
        Ok(clouds) => {
            for cloud in clouds {
                match cloud {
                    Ok(cloud) => assert!(cloud.x.len() == cloud.returns()),
                    Err(error) => assert_told(&error),
                }
            }
        }
        Err(error) => assert_told(&error),
    });
}

/// Reads `bytes` as a range image of 16 bits.
pub fn range_image(bytes: &[u8]) {
    with_files(&[("range.png", bytes)], |folder| {
        if let Err(error) = read_range_png(&folder.join("range.png")) {
            assert_told(&error);
        }
    });
}
