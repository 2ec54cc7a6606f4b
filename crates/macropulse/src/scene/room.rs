//! How large the meshes of a scene may be.

use std::path::Path;

use super::error::Error;

/// Bytes of a triangle while it is loaded; 178 of them are what `tests/memory.rs` allows an STL file.
pub(crate) const PER_TRIANGLE: u64 = 220;

/// Most triangles, however much memory there is.
const MOST_TRIANGLES: usize = 1 << 26;

/// Vertices that may stand beside those of triangles: of lines, or of no element at all.
const LOOSE_VERTICES: usize = 1 << 16;

/// How many triangles may still be loaded. A file that holds more is refused while it is read, not when
/// the memory is spent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    triangles: usize,
}

impl Default for Room {
    fn default() -> Self {
        Self { triangles: MOST_TRIANGLES }
    }
}

impl Room {
    /// Returns the room in this number of bytes.
    pub fn of_bytes(bytes: u64) -> Self {
        let triangles = usize::try_from(bytes / PER_TRIANGLE).unwrap_or(usize::MAX);
        Self { triangles: triangles.min(MOST_TRIANGLES) }
    }

    /// Returns the room that is left beside this number of triangles.
    #[must_use]
    pub fn beside(self, triangles: usize) -> Self {
        Self { triangles: self.triangles.saturating_sub(triangles) }
    }

    /// Refuses these numbers of vertices and triangles, read from the file at `path`, if they do not fit.
    pub(super) fn check(
        self,
        (vertices, triangles): (usize, usize),
        path: &Path,
    ) -> Result<(), Error> {
        let most = self.triangles.saturating_mul(3).saturating_add(LOOSE_VERTICES);
        if triangles <= self.triangles && vertices <= most {
            return Ok(());
        }
        let (what, most) = match triangles > self.triangles {
            true => ("triangles", self.triangles),
            false => ("vertices", most),
        };
        let (why, remedy) = match self.triangles {
            MOST_TRIANGLES => ("the most that a scene may have", ""),
            _ => ("for which memory is left", ", or allow more memory (--memory-limit)"),
        };
        Err(Error::mesh(
            path,
            format!("holds more than {most} {what}, {why}"),
            &format!("export it with fewer details{remedy}"),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(room: Room, vertices: usize, triangles: usize) -> Option<String> {
        room.check((vertices, triangles), Path::new("a.obj")).err().map(|error| error.to_string())
    }

    #[test]
    fn memory_is_room_for_triangles_and_their_vertices() {
        let room = Room::of_bytes(10 * PER_TRIANGLE);
        assert_eq!(told(room, 30 + LOOSE_VERTICES, 10), None);
        assert_eq!(told(room.beside(4), 0, 6), None);
        for (room, vertices, triangles) in
            [(room, 0, 11), (room, 31 + LOOSE_VERTICES, 0), (room.beside(4), 0, 7)]
        {
            let told = told(room, vertices, triangles).unwrap();
            assert!(told.starts_with("a.obj: holds more than ") && told.contains("--memory-limit"));
        }
        assert!(told(room.beside(11), 0, 1).is_some());
    }

    #[test]
    fn there_is_a_limit_however_much_memory_there_is() {
        assert_eq!(Room::of_bytes(u64::MAX), Room::default());
        let told = told(Room::default(), 0, MOST_TRIANGLES + 1).unwrap();
        assert!(
            told.contains("more than 67108864 triangles") && !told.contains("memory"),
            "{told}"
        );
    }
}
