//! How many records of each kind an OBJ has, and what reading it will take: bytes in, counts and a refusal out.
//!
//! For [`super::normalize`], which checks indices against them, before it holds anything itself.

use super::mesh::NONE;
use super::text::statements;
use crate::error::{Error, ErrorKind, Result};

/// How many records of each kind.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    pub(super) positions: i64,
    pub(super) texcoords: i64,
    pub(super) normals: i64,
    faces: u64,
    corners: u64,
    /// Statements of materials and libraries, and the bytes of their names.
    names: [u64; 2],
}

impl Counts {
    /// Counts; no further than what `most` bytes hold.
    pub(super) fn of_file(bytes: &[u8], most: u64) -> Result<Self> {
        let mut counts = Self::default();
        let mut list = statements(bytes)?;
        for statement in list.by_ref() {
            if counts.memory() > most {
                return Err(too_large());
            }
            match statement.keyword() {
                "v" => counts.positions += 1,
                "vt" => counts.texcoords += 1,
                "vn" => counts.normals += 1,
                "usemtl" | "mtllib" => {
                    counts.names[0] += 1;
                    counts.names[1] += statement.rest().len() as u64;
                }
                "f" => {
                    counts.faces += 1;
                    counts.corners += statement.operands().count() as u64;
                }
                _ => {}
            }
        }
        list.finish()?;
        Ok(counts)
    }

    /// What reading takes at its peak besides the texts, in bytes: for each record `tobj`'s list, hash map and copy, and
    /// ours; for each face two lists that may have grown to double; for each corner its indices twice and a triangle; each name
    /// twice, and a place in a list and in a map.
    pub(super) fn memory(&self) -> u64 {
        let records = (self.positions + self.texcoords + self.normals).unsigned_abs();
        let [names, bytes] = self.names;
        records * 160 + self.faces * 320 + self.corners * 96 + names * 160 + bytes * 2
    }

    /// Asks for the memory that reading takes at its peak, all at once, and gives it back: better a refusal now than
    /// an abort half-way.
    pub(super) fn check_memory(&self, bytes: u64, most: u64) -> Result<()> {
        let records = (self.positions + self.texcoords + self.normals).unsigned_abs();
        let wanted = bytes + self.memory();
        let there_is = usize::try_from(wanted).is_ok_and(|n| Vec::<u8>::new().try_reserve_exact(n).is_ok());
        if wanted > most || records > u64::from(NONE / 4) || !there_is {
            return Err(too_large());
        }
        Ok(())
    }
}

pub(super) fn too_large() -> Error {
    Error::new(ErrorKind::TooLarge, "reading the mesh takes more memory than there is, or than was allowed")
        .remedy("allow more memory, or split or thin out the mesh")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_asked_for_before_it_is_used() {
        let counts = Counts { positions: i64::from(u32::MAX), ..Counts::default() };
        assert_eq!(
            counts.check_memory(1 << 20, u64::MAX).expect_err("too large").kind(),
            ErrorKind::TooLarge
        );
    }

    #[test]
    fn names_are_counted_before_they_are_kept() {
        let obj: String = (0..1000).map(|i| format!("usemtl {i:07}\n")).collect();
        let counts = Counts::of_file(obj.as_bytes(), u64::MAX).expect("counted");
        assert_eq!(counts.memory(), 1000 * (160 + 2 * 7));
        assert!(Counts::of_file(obj.as_bytes(), 100_000).is_err());
    }
}
