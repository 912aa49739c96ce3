//! Where a texture's opacity is beyond doubt: a level's texels in, for every four neighbours whether all are holes, none, or some.
//!
//! Interpolated opacity is compared to a half, and most places lie between four texels on one side of it: one byte tells, where
//! four texels would have to be read.

use rayon::prelude::*;

use super::texture::{HALF, Level};

/// Of the four texels from a texel's number on to the right and down, around the borders, which are holes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Outline(Vec<u8>);

/// None of four texels is a hole.
pub(crate) const SOLID: u8 = 0;

/// All of them are.
pub(crate) const HOLE: u8 = 1;

/// Some are.
pub(crate) const SOME: u8 = 2;

impl Outline {
    pub(crate) fn of(level: &Level) -> Self {
        let (width, height) = (level.width as usize, level.height as usize);
        let is_hole = |x: usize, y: usize| level.texels[y * width + x][3] < HALF;
        let mut all = vec![SOLID; width * height];
        all.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
            let below = (y + 1) % height;
            for (x, four) in row.iter_mut().enumerate() {
                let right = (x + 1) % width;
                let holes = [is_hole(x, y), is_hole(right, y), is_hole(x, below), is_hole(right, below)];
                *four = match holes {
                    [true, true, true, true] => HOLE,
                    [false, false, false, false] => SOLID,
                    _ => SOME,
                };
            }
        });
        Self(all)
    }

    /// For each texel, row by row; nothing of a level whose opacity nobody asks for.
    #[inline]
    pub(crate) fn fours(&self) -> &[u8] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_neighbours_tell_around_the_borders() {
        let texels = (0..12).map(|i| [0, 0, 0, if [1, 2, 5, 6].contains(&i) { 0 } else { HALF }]).collect();
        let outline = Outline::of(&Level { width: 4, height: 3, texels });
        let wanted = [SOME, HOLE, SOME, SOLID, SOME, SOME, SOME, SOLID, SOME, SOME, SOME, SOLID];
        assert_eq!(outline.fours(), wanted);
    }
}
