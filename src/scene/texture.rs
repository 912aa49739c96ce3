//! Textures: linear-light mip levels, with what is known of them: holes, where these end, and where colours are smooth.
//!
//! Texels come from [`super::decode`], row 0 the top, red, green and blue in linear light, alpha as it is, not premultiplied.

use std::sync::Arc;

use rayon::prelude::*;

use super::mip::next_level;
use super::outline::Outline;
use super::smooth::Smooth;

/// An alpha below this is a hole.
pub(super) const HALF: u16 = 1 << 15;

/// One mip level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// Texels from left to right, at least 1.
    pub width: u32,
    /// Texels from top to bottom, at least 1.
    pub height: u32,
    /// Row by row from the top left: red, green, blue in linear light and opacity, 65535 for 1.
    pub texels: Vec<[u16; 4]>,
}

/// A picture on a surface.
///
/// # Guarantees
/// At least one level; the last is 1 x 1; each has `width * height` texels and is the exact area-weighted mean of
/// the one before it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// From full resolution down to one texel.
    pub levels: Arc<[Level]>,
    /// Some texel of level 0 has an opacity below one half.
    pub has_holes: bool,
    /// Where level 0 is smooth.
    pub(crate) smooth: Arc<Smooth>,
    /// Where each level's holes end; none where there are none.
    pub(crate) outlines: Vec<Outline>,
}

impl Texture {
    /// Builds the levels over level 0; none when its size does not match its texels or is zero.
    pub fn from_level(level: Level) -> Option<Self> {
        let size = u64::from(level.width) * u64::from(level.height);
        if size == 0 || size != level.texels.len() as u64 {
            return None;
        }
        let has_holes = level.texels.par_iter().any(|texel| texel[3] < HALF);
        let smooth = Smooth::of(&level);
        let mut levels = vec![level];
        while let Some(next) = levels.last().and_then(next_level) {
            levels.push(next);
        }
        let outlines = if has_holes { levels.iter().map(Outline::of).collect() } else { Vec::new() };
        Some(Self { levels: levels.into(), has_holes, smooth: Arc::new(smooth), outlines })
    }

    /// Whether it can be drawn: it has levels, each half of the one before, with all their texels and outlines. (The coarsest may be left out.)
    pub(crate) fn is_whole(&self) -> bool {
        let size = |level: &Level| level.width as usize * level.height as usize;
        let sides = |level: &Level| [level.width, level.height];
        let halves = |pair: &[Level]| sides(&pair[1]) == sides(&pair[0]).map(|side| (side / 2).max(1));
        let mut outlined = self.levels.iter().zip(&self.outlines);
        let has_outlines = self.outlines.len() >= self.levels.len()
            && outlined.all(|(level, outline)| outline.fours().len() == size(level));
        !self.levels.is_empty()
            && self.levels.iter().all(|level| size(level) > 0 && size(level) == level.texels.len())
            && self.levels.windows(2).all(halves)
            && (has_outlines || self.outlines.is_empty() && !self.has_holes)
    }

    /// The mean colour: its last level.
    pub(crate) fn mean(&self) -> [f32; 3] {
        let texel = self.levels.last().and_then(|level| level.texels.first()).copied().unwrap_or_default();
        [0, 1, 2].map(|i| f32::from(texel[i]) / 65535.0)
    }

    /// The same with all of it opaque, whatever its texels say; no copy of these.
    pub(crate) fn without_holes(&self) -> Self {
        let (levels, smooth) = (Arc::clone(&self.levels), Arc::clone(&self.smooth));
        Self { levels, has_holes: false, smooth, outlines: Vec::new() }
    }

    /// The same with all of it white, for its holes alone.
    pub(crate) fn white(&self) -> Self {
        let mut levels = self.levels.to_vec();
        for texel in levels.iter_mut().flat_map(|level| &mut level.texels) {
            texel[..3].fill(u16::MAX);
        }
        Self { levels: levels.into(), smooth: Arc::default(), ..self.clone() }
    }

    /// Bytes of memory that it takes.
    pub(crate) fn bytes(&self) -> u64 {
        let outlines: u64 = self.outlines.iter().map(|outline| outline.fours().len() as u64).sum();
        self.levels.iter().map(|level| level.texels.len() as u64 * 8).sum::<u64>() + outlines
    }
}
