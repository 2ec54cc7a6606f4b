//! The materials of an OBJ: of each its name and its visible colour.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::super::lines::{Lines, numbers};
use super::super::{Reach, luminance, open};
use crate::scene::error::Error;

/// Looks of the materials in material files, by name.
pub(super) type Library = HashMap<String, Looks>;

/// How a material looks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Looks {
    /// How bright it is, from 0 to 1, where that is known.
    pub brightness: Option<f64>,
    /// True if light goes through it or through holes in it.
    pub is_transparent: bool,
}

/// The files that a line `mtllib` of the mesh at `path` names: several, or one with blanks in its
/// name. Some programs part folders by `\`.
///
/// # Errors
/// If one lies where it may not, or is not there.
pub(super) fn files(path: &Path, named: &str, reach: Reach<'_>) -> Result<Vec<PathBuf>, Error> {
    let whole = found(path, named, reach);
    let is_one = named.split_whitespace().nth(1).is_none();
    match whole {
        Ok(Some(file)) => Ok(vec![file]),
        Err(outside) if is_one => Err(outside),
        Ok(None) if is_one => Err(absent(path, named)),
        _ => {
            let each = named.split_whitespace().map(|one| found(path, one, reach));
            let each = each.collect::<Result<Option<Vec<PathBuf>>, Error>>()?;
            each.ok_or_else(|| absent(path, named))
        }
    }
}

/// The file of this name, if it is there.
fn found(path: &Path, named: &str, reach: Reach<'_>) -> Result<Option<PathBuf>, Error> {
    let plain = reach.beside(path, named)?;
    if plain.is_file() || !named.contains('\\') {
        return Ok(Some(plain).filter(|file| file.exists()));
    }
    let turned = reach.beside(path, &named.replace('\\', "/"))?;
    Ok(Some(turned).filter(|file| file.exists()))
}

fn absent(path: &Path, named: &str) -> Error {
    let file = path.parent().unwrap_or(Path::new("")).join(named);
    Error::mesh(
        path,
        format!("names its materials in {}, which is not there", file.display()),
        "put that file beside the mesh, or give the object `material = \"…\"`",
    )
}

/// Adds the materials of the file at `path` to `library`, whose own come first.
///
/// # Errors
/// If it cannot be read, or a colour is none.
pub(super) fn read(path: &Path, library: &mut Library) -> Result<(), Error> {
    let mut file = open(path)?;
    let mut lines = Lines::of(&mut file, path)?.joined();
    // The material that is told about, unless it is known already.
    let mut name: Option<String> = None;
    let remedy = "mend it, or give the object `material = \"…\"`";
    lines.each(remedy, |_, line| told(line.trim(), &mut name, library))
}

/// Takes in a line, of the material called `name`.
fn told(line: &str, name: &mut Option<String>, library: &mut Library) -> Result<(), String> {
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    if word == "newmtl" {
        let new = rest.trim();
        *name = (!library.contains_key(new)).then(|| new.to_owned());
        library.entry(new.to_owned()).or_default();
    } else if let Some(looks) = name.as_ref().and_then(|name| library.get_mut(name)) {
        match word {
            "Kd" => looks.brightness = colour(rest)?,
            // How much it covers, behind the word `-halo` where it covers less at its rim.
            "d" => looks.is_transparent |= last_number(rest).is_some_and(|covers| covers < 1.0),
            "Tr" => looks.is_transparent |= last_number(rest).is_some_and(|clear| clear > 0.0),
            "map_d" => looks.is_transparent = true,
            _ => {}
        }
    }
    Ok(())
}

/// The number that a line ends with, before its comment.
fn last_number(told: &str) -> Option<f64> {
    told.split('#').next()?.split_whitespace().last()?.parse().ok()
}

/// Returns the brightness of a colour in a line `Kd`; `None` for a spectrum, which is not read. The line
/// holds red, green and blue, or one number for all three, or X, Y and Z, where Y is the luminance.
fn colour(told: &str) -> Result<Option<f64>, String> {
    let mut words = told.split_whitespace().take_while(|word| !word.starts_with('#')).peekable();
    if words.next_if_eq(&"spectral").is_some() {
        return Ok(None);
    }
    let is_xyz = words.next_if_eq(&"xyz").is_some();
    let words: Vec<&str> = words.collect();
    let refused = |word| match word {
        Some(word) => format!("has {word:?} where a number of a colour is due"),
        None => {
            format!("has {} numbers, and a colour has three, or one if it is grey", words.len())
        }
    };
    let three = match words.as_slice() {
        [grey] => numbers(&mut [*grey; 3].into_iter()),
        several => numbers(&mut several.iter().copied()),
    };
    let three = three.map_err(refused)?;
    Ok(Some(if is_xyz { three[1].clamp(0.0, 1.0) } else { luminance(three) }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_is_three_numbers_or_one() {
        assert_eq!(colour("1 1 1 # white"), Ok(Some(luminance([1.0; 3]))));
        assert_eq!(colour("0.5"), Ok(Some(luminance([0.5; 3]))));
        assert_eq!(colour("xyz 0.1 0.2 0.3"), Ok(Some(0.2)));
        assert_eq!(colour("spectral a.rfl"), Ok(None));
        for wrong in ["", "1 1", "a", "1 nan 1", "xyz"] {
            assert!(colour(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_first_material_of_a_name_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mtl");
        std::fs::write(&path, "Kd 9\nnewmtl a\nKd 0\nnewmtl b\nnewmtl a\nKd 1\n").unwrap();
        let looks = |brightness| Looks { brightness: Some(brightness), is_transparent: false };
        let mut library = Library::from([("b".to_owned(), looks(0.7))]);
        read(&path, &mut library).unwrap();
        assert_eq!(library, Library::from([("a".into(), looks(0.0)), ("b".into(), looks(0.7))]));
    }

    #[test]
    fn transparency_is_seen_in_any_of_its_lines() {
        for (line, expected) in [
            ("d 0.05", true),
            ("d -halo 0.5 # glass", true),
            ("Tr 0.95", true),
            ("map_d leaf.png", true),
            ("d 1.0", false),
            ("Tr 0", false),
            ("Kd 0.1 0.1 0.1", false),
        ] {
            let (mut name, mut library) = (None, Library::new());
            for line in ["newmtl a", line] {
                told(line, &mut name, &mut library).unwrap();
            }
            assert_eq!(library["a"].is_transparent, expected, "{line}");
        }
    }
}
