//! Loose triangles in bunches of sixteen that lie close together, so that a tile asks for a bunch before it asks for each.
//!
//! In: the candidates of [`super::bin`], nearest first, and the tiles that they touch. Out: those that are loose ([`super::loose`]), in
//! slices of 16,384 places of that order, each sorted into bunches, for [`super::lens_points`]; the lists of tiles are left without them.
//! Bunches are halves of halves, each divided along the longest of three axes: where a triangle is seen through the lens centre, `x`
//! and `y`, and its way over the film.

use super::LANES;
use super::loose::{Image, Sixteen};
use super::tile_lists::Tiles;
use super::view::View;
use glam::DVec3;
use rayon::prelude::*;

/// Places that are looked at together.
pub(super) const SLICE: usize = 1 << 14;

/// Sixteen triangles, or less.
pub(super) struct Bunch {
    pub images: Sixteen,
    /// Their places in the order of depth.
    pub places: [u32; LANES],
}

/// The loose ones among [`SLICE`] candidates.
#[derive(Default)]
pub(super) struct Slice {
    pub bunches: Vec<Bunch>,
    /// The bunches as if each were a triangle, sixteen after sixteen.
    pub wholes: Vec<Sixteen>,
}

/// All loose triangles.
#[derive(Default)]
pub(super) struct Bunches {
    /// None where most of what the tiles list is not loose.
    pub slices: Vec<Slice>,
    /// Whether nothing leans or is turned.
    pub is_level: bool,
    /// How many triangles these are.
    pub count: usize,
}

/// A triangle in fewer tiles is not taken for loose.
const FEW_TILES: u32 = 4;

/// One in so many candidates tells whether most of what the tiles list is loose.
const STRIDE: usize = 29;

impl Bunches {
    /// The loose ones of the candidates in `order`, which touch `tiles`, and are left with [`Tiles::NONE`]; none where most of what
    /// the tiles list is not loose. `corners` tells those of a candidate within the frustum.
    pub(super) fn take(
        view: &View,
        order: &[u32],
        tiles: &mut [Tiles],
        corners: impl Fn(u32) -> Option<[DVec3; 3]> + Sync,
    ) -> Self {
        let of = |place: u32, tiles: Tiles| {
            let loose = (tiles.count() >= FEW_TILES).then(|| Image::of_loose(view, corners(place)?));
            loose.flatten()
        };
        let some = order.iter().zip(&*tiles).step_by(STRIDE);
        let (all, loose) = some.fold((0, 0), |(all, loose), (&place, &tiles)| {
            let count = u64::from(tiles.count());
            (all + count, loose + if of(place, tiles).is_some() { count } else { 0 })
        });
        if 2 * loose <= all {
            return Self::default();
        }
        let slices: Vec<Slice> = order
            .par_chunks(SLICE)
            .zip(tiles.par_chunks_mut(SLICE))
            .enumerate()
            .map(|(slice, (order, tiles))| {
                let mut loose = Vec::new();
                for (place, (&candidate, tiles)) in (slice * SLICE..).zip(order.iter().zip(tiles)) {
                    if let Some(image) = of(candidate, *tiles) {
                        loose.push((place as u32, image));
                        *tiles = Tiles::NONE;
                    }
                }
                Slice::new(&loose)
            })
            .collect();
        let bunches = || slices.iter().flat_map(|slice| &slice.bunches);
        let is_level = bunches().all(|bunch| bunch.images.is_level());
        let count = bunches().map(|bunch| bunch.images.live.count_ones() as usize).sum();
        Self { slices, is_level, count }
    }
}

impl Slice {
    /// Of places and images.
    fn new(loose: &[(u32, Image)]) -> Self {
        let axes = |image: &Image| [image.place.x, image.place.y, image.way()].map(|axis| axis as f32);
        let mut keys: Vec<Key> =
            (0..).zip(loose).map(|(number, (_, image))| Key { axes: axes(image), number }).collect();
        sort(&mut keys);
        let (bunches, wholes): (Vec<Bunch>, Vec<Option<Image>>) = keys
            .chunks(LANES)
            .map(|those| {
                let those = || those.iter().map(|key| &loose[key.number]);
                let images: Vec<Image> = those().map(|(_, image)| *image).collect();
                let mut places = [0; LANES];
                for (out, (place, _)) in places.iter_mut().zip(those()) {
                    *out = *place;
                }
                let whole = Image::around(&images);
                (Bunch { images: Sixteen::new(images.into_iter().map(Some)), places }, whole)
            })
            .unzip();
        let wholes = wholes.chunks(LANES).map(|wholes| Sixteen::new(wholes.iter().copied())).collect();
        Self { bunches, wholes }
    }
}

/// What triangles are sorted by.
struct Key {
    axes: [f32; 3],
    number: usize,
}

/// Sorts so that each sixteen from the start lie close together.
fn sort(keys: &mut [Key]) {
    if keys.len() <= LANES {
        return;
    }
    let length = |axis: usize| {
        let values = || keys.iter().map(|key| key.axes[axis]);
        values().fold(f32::NEG_INFINITY, f32::max) - values().fold(f32::INFINITY, f32::min)
    };
    let lengths = [0, 1, 2].map(length);
    let axis = (1..3).fold(0, |most, axis| if lengths[axis] > lengths[most] { axis } else { most });
    let half = (keys.len() / 2).next_multiple_of(LANES);
    keys.select_nth_unstable_by(half, |a, b| {
        a.axes[axis].total_cmp(&b.axes[axis]).then(a.number.cmp(&b.number))
    });
    let (before, after) = keys.split_at_mut(half);
    sort(before);
    sort(after);
}
