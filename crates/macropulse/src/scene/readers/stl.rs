//! STL, as text and as bytes.
//!
//! Only corners and the ends of their loops count in a text. The number of solids, their names and their
//! normals do not change what light meets.

use std::array;
use std::io::{BufRead, Read};
use std::ops::Range;
use std::path::Path;

use super::lines::{Fault, Lines, numbers};
use super::{DAMAGED, open};
use crate::scene::error::Error;
use crate::scene::mesh::Mesh;
use crate::scene::polygon::Cutter;
use crate::scene::room::Room;

/// Bytes before the facets of a binary file: 80 that say anything, and their number.
const HEADER: usize = 84;

/// Bytes of a facet: its normal and three corners as floats, and two bytes that say anything.
const FACET: usize = 50;

/// Facets that are read at once.
const AT_ONCE: usize = 1024;

pub(super) fn read(path: &Path, room: Room) -> Result<Mesh, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let mut file = open(path)?;
    let length = file.get_ref().metadata().map_err(unreadable)?.len();
    let begins = file.fill_buf().map_err(unreadable)?;
    match is_text(begins, length) {
        true => text(&mut file, path, room),
        false => binary(&mut file, (path, length), room),
    }
}

/// Returns true if a file with this beginning and length is text. Many programs begin a binary file with
/// `solid` as well; its length, or a byte that no text has, gives it away.
fn is_text(begins: &[u8], length: u64) -> bool {
    let count = begins.get(80..HEADER).and_then(|count| count.try_into().ok());
    let facets = count.map(|count| u64::from(u32::from_le_bytes(count)));
    if facets.is_some_and(|facets| HEADER as u64 + facets * FACET as u64 == length) {
        return false;
    }
    let is_wide = begins.starts_with(b"\xff\xfe") || begins.starts_with(b"\xfe\xff");
    let begins = begins.strip_prefix(b"\xef\xbb\xbf").unwrap_or(begins).trim_ascii_start();
    let is_solid = begins.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    is_wide || is_solid && !begins.iter().take(512).any(|byte| *byte == 0)
}

fn binary(file: &mut impl Read, (path, length): (&Path, u64), room: Room) -> Result<Mesh, Error> {
    let damaged = |problem: String| Error::mesh(path, problem, DAMAGED);
    let mut header = [0; HEADER];
    file.read_exact(&mut header)
        .map_err(|_| damaged(format!("is no STL: text begins with solid, bytes with {HEADER}")))?;
    let count = header.last_chunk().map_or(0, |count| u32::from_le_bytes(*count));
    let there = (length - (HEADER as u64).min(length)) / FACET as u64;
    if u64::from(count) > there {
        let problem = format!("says that it has {count} facets, and ends within number {there}");
        return Err(damaged(problem));
    }
    if count == 0 && there > 0 {
        return Err(damaged(format!("says that it has no facets, and has bytes of {there}")));
    }
    room.check((3 * count as usize, count as usize), path)?;
    let mut mesh = Mesh::default();
    mesh.vertices.reserve_exact(3 * count as usize);
    let material = mesh.material("").unwrap_or_default();
    let mut facets = vec![[0; FACET]; AT_ONCE.min(count as usize)];
    for first in (0..count).step_by(AT_ONCE) {
        let facets = &mut facets[..AT_ONCE.min((count - first) as usize)];
        file.read_exact(facets.as_flattened_mut())
            .map_err(|_| damaged(format!("ends within facet {first} or soon behind it")))?;
        for facet in facets {
            let numbers = facet[12..48].as_chunks().0;
            let numbers: [f64; 9] = array::from_fn(|axis| f32::from_le_bytes(numbers[axis]).into());
            let own = add(&mut mesh, numbers.as_chunks().0).map_err(damaged)?;
            mesh.fan(&[own.start, own.start + 1, own.start + 2], material);
        }
    }
    Ok(mesh)
}

fn text(file: &mut impl BufRead, path: &Path, room: Room) -> Result<Mesh, Error> {
    let mut lines = Lines::of(file, path)?;
    let mut text = Text::default();
    text.material = text.mesh.material("").unwrap_or_default();
    lines.each(DAMAGED, |_, line| -> Result<(), Fault> {
        text.line(line)?;
        let corners = text.mesh.vertices.len() + text.corners.len();
        Ok(room.check((corners, text.mesh.triangles.len()), path)?)
    })?;
    if text.is_open || !text.corners.is_empty() {
        return Err(Error::mesh(path, "ends within a facet", DAMAGED));
    }
    Ok(text.mesh)
}

/// The part of a text that has been read so far.
#[derive(Default)]
struct Text {
    mesh: Mesh,
    material: u16,
    cutter: Cutter,
    /// Those of a loop that has not ended.
    corners: Vec<[f64; 3]>,
    /// True if a facet has not ended.
    is_open: bool,
}

impl Text {
    fn line(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split_whitespace();
        while let Some(word) = words.next() {
            let is = |known: &str| word.eq_ignore_ascii_case(known);
            if is("vertex") {
                let corner = numbers(&mut words).map_err(|word| match word {
                    Some(word) => format!("has {word:?} where a number is due"),
                    None => "has a corner of fewer than three numbers".to_owned(),
                })?;
                self.corners.push(corner);
            } else if is("endloop") {
                let (count, material) = (self.corners.len(), self.material);
                if count < 3 {
                    return Err(format!("ends a facet of {count} corners"));
                }
                let own: Vec<u32> = add(&mut self.mesh, &self.corners)?.collect();
                self.cutter.add(&mut self.mesh, &own, material)?;
                self.corners.clear();
            } else if is("facet") {
                self.is_open = true;
            } else if is("endfacet") {
                self.is_open = false;
            } else if is("solid") || is("endsolid") {
                // A name may be any words; a facet on the same line goes on with its normal.
                while let Some(word) = words.next() {
                    let next = words.clone().next().unwrap_or_default();
                    let begins = |known: [&str; 2]| {
                        [word, next].iter().zip(known).all(|(a, b)| a.eq_ignore_ascii_case(b))
                    };
                    if begins(["facet", "normal"]) {
                        self.is_open = true;
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Adds the corners of a facet, which no other shares; gives their indices.
#[inline]
fn add(mesh: &mut Mesh, corners: &[[f64; 3]]) -> Result<Range<u32>, String> {
    let index = |index| u32::try_from(index).map_err(|_| "has more corners than can be counted");
    let count = mesh.vertices.len();
    let own = index(count)?..index(count + corners.len())?;
    mesh.vertices.extend(corners);
    Ok(own)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_told_from_text_by_their_length_or_a_zero() {
        let mut bytes = b"solid of a program".to_vec();
        bytes.resize(80, b' ');
        bytes.extend(1_684_632_163_u32.to_le_bytes());
        assert!(is_text(&bytes, 84), "text, as it says of 10^9 facets and has none");
        assert!(!is_text(&bytes, 84 + 1_684_632_163 * 50));
        bytes.extend([0; 50]);
        assert!(!is_text(&bytes, 134), "a zero");
        assert!(is_text(b"\xef\xbb\xbf \nSOLID\n", 12) && !is_text(b"hello", 5));
    }
}
