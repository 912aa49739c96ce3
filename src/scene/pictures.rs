//! The textures of one scene: names of picture files in, decoded textures out, each file once for each use.
//!
//! Many are decoded at a time, but no more than memory holds: what each will take is read from its head first, and one
//! that does not fit is refused before any of its texels is made. Whether they fit does not depend on how many threads
//! there are: it must be so one after the other.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::decode::{Cost, Use, cost, decode};
use super::digest::{self, Digest};
use super::source::Source;
use super::texture::Texture;
use crate::error::{Error, ErrorKind, Result, memory};

/// Longest picture file, in bytes.
const PICTURE_LIMIT: u64 = 256 << 20;

/// Most memory for the textures of all meshes, in bytes.
const TEXTURES_LIMIT: u64 = 8 << 30;

/// Most bytes of picture files held at a time only to read their heads.
const HEADS: u64 = 64 << 20;

/// A texture, or why there is none, and the digest of its file.
pub(crate) type Decoded = (Result<Arc<Texture>>, Digest);

/// What is decoded.
#[derive(Default)]
pub(crate) struct Pictures {
    textures: HashMap<(PathBuf, Use), Decoded>,
    bytes: u64,
}

impl Pictures {
    /// What came of a file.
    pub(crate) fn get(&self, path: &Path, what_for: Use) -> Option<Decoded> {
        self.textures.get(&(path.to_path_buf(), what_for)).cloned()
    }

    /// Bytes of memory that all textures take.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Decodes what is not decoded yet, in at most `most` further bytes; `tell` gets the files done and all.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`], naming the picture that does not fit.
    pub(crate) fn decode(
        &mut self,
        source: &dyn Source,
        mut wanted: Vec<(PathBuf, Use)>,
        most: u64,
        tell: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<()> {
        let mut seen = BTreeSet::new();
        wanted.retain(|(path, what_for)| {
            !self.textures.contains_key(&(path.clone(), *what_for))
                && seen.insert((path.clone(), *what_for == Use::Opacity))
        });
        let costs = costs(source, &wanted, most)?;
        let total = wanted.len() as u64;
        let done = AtomicU64::new(0);
        let mut left = most.min(TEXTURES_LIMIT.saturating_sub(self.bytes));
        let mut begin = 0;
        while begin < wanted.len() {
            let group = begin..begin + next_group(&costs[begin..], left);
            begin = group.end;
            let (some, costs) = (&wanted[group.clone()], &costs[group]);
            if let ([(path, _)], [cost]) = (some, costs)
                && cost.working + cost.kept > left
            {
                return Err(does_not_fit(path, *cost, left));
            }
            let decoded: Vec<Decoded> = some
                .par_iter()
                .zip(costs)
                .map(|((path, what_for), expected)| {
                    let decoded = read(source, path, *what_for, *expected);
                    tell(done.fetch_add(1, Ordering::Relaxed) + 1, total);
                    decoded
                })
                .collect();
            let bytes = |decoded: &Decoded| decoded.0.as_ref().map_or(0, |texture| texture.bytes());
            let taken = decoded.iter().map(bytes).sum::<u64>();
            self.bytes += taken;
            left = left.saturating_sub(taken);
            self.textures.extend(some.iter().cloned().zip(decoded));
        }
        Ok(())
    }
}

/// Reads and decodes one file.
fn read(source: &dyn Source, path: &Path, what_for: Use, expected: Cost) -> Decoded {
    match source.read(path, PICTURE_LIMIT) {
        Ok(bytes) => {
            let texture = cost(&bytes, path).and_then(|cost| {
                // Memory was asked for by the head that the file had.
                if cost == expected {
                    decode(&bytes, path, what_for)
                } else {
                    Err("it changed while it was read".to_owned())
                }
            });
            (texture.map(Arc::new).map_err(Error::invalid), digest::of_bytes(&bytes))
        }
        Err(e) => (Err(e), digest::ABSENT),
    }
}

/// What each file will take: one that cannot be decoded is read all the same, and then says so; nothing for one that cannot be read.
fn costs(source: &dyn Source, wanted: &[(PathBuf, Use)], most: u64) -> Result<Vec<Cost>> {
    let lengths: Vec<Cost> = wanted
        .iter()
        .map(|(path, _)| source.length(path).ok().filter(|&length| length <= PICTURE_LIMIT))
        .map(|length| Cost { working: length.unwrap_or(0), kept: 0 })
        .collect();
    if let Some(at) = lengths.iter().position(|length| length.working > most) {
        return Err(does_not_fit(&wanted[at].0, lengths[at], most));
    }
    let mut costs = Vec::new();
    while costs.len() < wanted.len() {
        let begin = costs.len();
        let some = &wanted[begin..begin + next_group(&lengths[begin..], most.min(HEADS))];
        costs.par_extend(some.par_iter().zip(&lengths[begin..]).map(|((path, _), &length)| {
            let bytes = source.read(path, PICTURE_LIMIT).ok();
            bytes.and_then(|bytes| cost(&bytes, path).ok()).unwrap_or(length)
        }));
    }
    Ok(costs)
}

/// How many of the first may be under way together in `most` bytes: at least one.
fn next_group(costs: &[Cost], most: u64) -> usize {
    let at_once = 2 * rayon::current_num_threads();
    let mut sum = 0u64;
    let fits = |cost: &Cost| {
        sum = sum.saturating_add(cost.working + cost.kept);
        sum <= most
    };
    costs.iter().take(at_once).map(fits).take_while(|&fits| fits).count().clamp(1, costs.len())
}

fn does_not_fit(path: &Path, cost: Cost, left: u64) -> Error {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (needs, left) = (memory(cost.working + cost.kept), memory(left));
    let message = format!("the texture `{name}` needs {needs} to decode, and {left} are left");
    Error::new(ErrorKind::TooLarge, message).remedy("make the textures smaller, or allow more memory")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_what_fits_and_at_least_one() {
        let costs = [3, 3, 9, 1].map(|working| Cost { working, kept: 0 });
        assert_eq!(next_group(&costs, 6), 2.min(2 * rayon::current_num_threads()));
        assert_eq!(next_group(&costs[2..], 6), 1, "alone, to be refused");
        assert_eq!(next_group(&costs[3..], 6), 1);
    }

    #[test]
    fn what_is_no_picture_is_read_and_so_takes_its_length() {
        let source = crate::scene::Memory::new().with("k.png", vec![0; 1000]);
        let wanted = ["k.png", "none.png"].map(|name| (PathBuf::from(name), Use::Diffuse));
        let costs = costs(&source, &wanted, u64::MAX).expect("they fit");
        assert_eq!(costs.iter().map(|cost| cost.working).collect::<Vec<_>>(), [1000, 0]);
    }
}
