//! The surfaces of a tile, numbered in the order that its triangles meet them.
//!
//! In: surfaces of up to sixteen triangles at a time, nearest first. Out: their numbers, and for each number a triangle. A number is
//! what [`super::visibility`] keeps of what a sample sees, and the order of numbers is that of sums: so all triangles that a tile comes
//! by have to be here, whether anything is seen of them or not.

use super::LANES;

/// See the module.
#[derive(Default)]
pub(super) struct Surfaces {
    /// In the tile, each with the triangle that was met first.
    each: Vec<u32>,
    /// For each surface of the scene the tile that last met it, and its number there.
    met: Vec<(u32, u32)>,
    /// How many tiles there were.
    tiles: u32,
}

impl Surfaces {
    /// For another tile, of a scene of so many surfaces.
    pub(super) fn clear(&mut self, surfaces: usize) {
        self.each.clear();
        self.met.resize(surfaces, (0, 0));
        self.tiles += 1;
    }

    /// The number of the surface of each of sixteen triangles at most, which come as surface and triangle.
    #[inline(always)]
    pub(super) fn number(&mut self, those: impl Iterator<Item = (u32, u32)> + Clone) -> [u32; LANES] {
        // They lie anywhere in memory: all are asked for at once. Those that this finds are new to the tile, or met by one before.
        let mut met = [(0, 0); LANES];
        for (met, (surface, _)) in met.iter_mut().zip(those.clone()) {
            *met = self.met[surface as usize];
        }
        for (met, (surface, triangle)) in met.iter_mut().zip(those) {
            if met.0 != self.tiles {
                let now = &mut self.met[surface as usize];
                if now.0 != self.tiles {
                    *now = (self.tiles, self.each.len() as u32);
                    self.each.push(triangle);
                }
                *met = *now;
            }
        }
        met.map(|(_, number)| number)
    }

    /// For each number the triangle that was met first.
    pub(super) fn each(&self) -> &[u32] {
        &self.each
    }
}
