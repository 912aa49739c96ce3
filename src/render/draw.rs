//! One tile: its samples through the rasterizer, grouped by what they see, shaded and summed.

use super::Picture;
use super::pattern::pattern;
use crate::raster::kernel::{Group, NOTHING};
use crate::raster::setup::TileFilm;
use crate::raster::tile::Geometry;
use crate::raster::view::{Batch, Pattern};
use crate::raster::{self, TILE};
use crate::sampling::hash;
use crate::shade::{Look, Place};
use glam::{DVec3, Vec3, Vec4};
use std::cell::RefCell;

/// What one thread reuses from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    raster: raster::tile::TileScratch,
    groups: Vec<Group>,
    /// By place in the tile's set-ups; made when first asked for.
    looks: RefCell<Vec<Option<Box<Look>>>>,
}

/// Sums over lanes for each value of each four bits of a mask: means of any group at the cost of four loads.
struct LaneSums([[Vec4; 16]; 4]);

impl LaneSums {
    fn new(batch: &Batch) -> Self {
        let lane = |i: usize| Vec4::new(batch.u[i], batch.v[i], batch.x[i], batch.y[i]);
        Self(std::array::from_fn(|part| {
            std::array::from_fn(|mask| {
                (0..4)
                    .filter(|bit| mask >> bit & 1 == 1)
                    .fold(Vec4::ZERO, |sum, bit| sum + lane(4 * part + bit))
            })
        }))
    }

    /// The mean place of `lanes`, which are not none, from the block's corner.
    #[inline]
    fn mean(&self, lanes: u16) -> Vec4 {
        let part = |i: usize| self.0[i][usize::from(lanes >> (4 * i)) & 15];
        (part(0) + part(1) + part(2) + part(3)) * (1.0 / lanes.count_ones() as f32)
    }
}

/// The set bits of a mask, lowest first.
#[derive(Clone, Copy)]
struct Lanes(u16);

impl Iterator for Lanes {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize;
        (self.0 != 0).then(|| {
            self.0 &= self.0 - 1;
            lane
        })
    }
}

/// The rays of a tile, in single precision about its centre.
struct Rays {
    p: Vec3,
    dx: Vec3,
    dy: Vec3,
    focal_length: f32,
    radius: f32,
}

impl Rays {
    /// The direction from the lens point, lens frame: `q_w s - p`.
    #[inline]
    fn at(&self, place: Place) -> Vec3 {
        let p = self.p + self.dx * place.x + self.dy * place.y;
        let weight = (1.0 + p.z / self.focal_length) * self.radius;
        Vec3::new(weight * place.u, weight * place.v, 0.0) - p
    }
}

impl Picture<'_> {
    /// Draws one tile; returns the sum of the estimated squared errors of its pixels.
    pub(super) fn draw_tile(
        &self,
        scratch: &mut TileScratch,
        tile: (u32, u32),
        out: &mut [[f32; 3]],
        cancelled: &dyn Fn() -> bool,
    ) -> f64 {
        let TileScratch { raster, groups, looks } = scratch;
        let pattern = pattern(self.seed, tile, self.samples, self.splits);
        let geometry = Geometry {
            positions: &self.positions,
            triangles: &self.surfaces.triangles,
            cutout: &self.cutout,
        };
        let film = raster.prepare(&self.view, &geometry, &self.bins, self.cells.len(), &pattern, tile);
        looks.get_mut().clear();
        looks.get_mut().resize_with(raster.setups().len(), || None);
        let rays = self.rays(tile);

        // Sums of the even and the odd samples, in the order of the batches.
        let mut sums = vec![[Vec3::ZERO; 2]; (TILE * TILE) as usize];
        for batch in &pattern.batches {
            if cancelled() {
                return 0.0;
            }
            raster.draw(self.level, &geometry, &film, batch, &|visit, block, lane| {
                let (pixel, place) = place(&pattern, batch, block, lane);
                let mut looks = looks.borrow_mut();
                let Some(slot) = looks.get_mut(visit.id as usize) else { return true };
                let look = slot.get_or_insert_with(|| self.look(&film, visit.setup.triangle));
                let key = hash(
                    hash(self.seed, u64::from(tile.0 * TILE + pixel.0)),
                    u64::from(tile.1 * TILE + pixel.1),
                );
                self.shader.is_met(look, visit.setup.triangle, place, key, batch.index[lane])
            });
            raster.group(self.level, batch, groups);
            self.shade(&film, raster.setups(), looks.get_mut(), &pattern, batch, groups, &rays, &mut sums);
        }
        self.resolve(tile, &sums, out)
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one tile, borrowed apart")]
    fn shade(
        &self,
        film: &TileFilm,
        setups: &[raster::setup::Setup],
        looks: &mut [Option<Box<Look>>],
        pattern: &Pattern,
        batch: &Batch,
        groups: &[Group],
        rays: &Rays,
        sums: &mut [[Vec3; 2]],
    ) {
        let means = LaneSums::new(batch);
        let columns = TILE / pattern.block_width;
        let half = 0.5 * TILE as f32;
        for group in groups {
            let block = u32::from(group.block);
            let corner = (block % columns * pattern.block_width, block / columns * pattern.block_height);
            let mut look = None;
            if group.id != NOTHING {
                let at = group.id as usize;
                look = Some(&**looks[at].get_or_insert_with(|| self.look(film, setups[at].triangle)));
            }
            let mut add = |lanes: u16, pixel: u32| {
                let mean = means.mean(lanes);
                let (x, y) = (corner.0 as f32 - half, corner.1 as f32 - half);
                let place = Place { u: mean.x, v: mean.y, x: x + mean.z, y: y + mean.w };
                let ray = rays.at(place);
                let odd = (lanes & batch.odd).count_ones();
                let mut colors = match look {
                    Some(look) => self.shader.radiance(look, place, ray, batch, (x, y), lanes),
                    None => {
                        let sky = self.shader.background(ray);
                        [lanes.count_ones() - odd, odd].map(|count| sky * count as f32)
                    }
                };
                if let Some(falloff) = &self.falloff {
                    let weight = falloff.weight(&self.view, ray.as_dvec3(), place);
                    colors = colors.map(|color| color * weight);
                }
                let [even_sum, odd_sum] = &mut sums[pixel as usize];
                *even_sum += colors[0];
                *odd_sum += colors[1];
            };
            if self.shared {
                add(group.lanes, corner.1 * TILE + corner.0);
            } else {
                for lane in Lanes(group.lanes) {
                    let inside = u32::from(batch.pixel[lane]);
                    let x = corner.0 + inside % pattern.block_width;
                    let y = corner.1 + inside / pattern.block_width;
                    add(1 << lane, y * TILE + x);
                }
            }
        }
    }

    fn look(&self, film: &TileFilm, triangle: u32) -> Box<Look> {
        let corners = self.surfaces.triangles[triangle as usize].map(|i| self.positions[i as usize]);
        Box::new(self.shader.look(triangle, &film.scaled_edges(corners), corners))
    }

    fn resolve(&self, (tx, ty): (u32, u32), sums: &[[Vec3; 2]], out: &mut [[f32; 3]]) -> f64 {
        let (even, odd) = (self.samples.div_ceil(2), self.samples / 2);
        let mut squared = 0.0;
        for y in 0..TILE.min(self.view.height - ty * TILE) {
            for x in 0..TILE.min(self.view.width - tx * TILE) {
                let at = (y * TILE + x) as usize;
                let [a, b] = sums[at];
                out[at] = ((a + b) / self.samples as f32).to_array();
                if odd > 0 {
                    let shown =
                        |sum: Vec3, n: u32| (sum * (self.gain / n as f32)).clamp(Vec3::ZERO, Vec3::ONE);
                    // The mean weighs the halves by their sizes; for equal halves this is a quarter.
                    let n = f64::from(self.samples);
                    let share = f64::from(even) * f64::from(odd) / (n * n);
                    squared += share * (shown(a, even) - shown(b, odd)).as_dvec3().length_squared();
                }
            }
        }
        squared
    }

    fn rays(&self, (tx, ty): (u32, u32)) -> Rays {
        let view = &self.view;
        let center = |tile: u32| f64::from(tile * TILE) + 0.5 * f64::from(TILE);
        let p: DVec3 = view.film + view.film_dx * center(tx) + view.film_dy * center(ty);
        Rays {
            p: p.as_vec3(),
            dx: view.film_dx.as_vec3(),
            dy: view.film_dy.as_vec3(),
            focal_length: view.focal_length as f32,
            radius: view.radius as f32,
        }
    }
}

/// The pixel, in the tile, and the place of lane `lane` at block `block`.
fn place(pattern: &Pattern, batch: &Batch, block: usize, lane: usize) -> ((u32, u32), Place) {
    let columns = TILE / pattern.block_width;
    let block = block as u32;
    let corner = (block % columns * pattern.block_width, block / columns * pattern.block_height);
    let inside = u32::from(batch.pixel[lane]);
    let half = 0.5 * TILE as f32;
    let place = Place {
        u: batch.u[lane],
        v: batch.v[lane],
        x: corner.0 as f32 - half + batch.x[lane],
        y: corner.1 as f32 - half + batch.y[lane],
    };
    ((corner.0 + inside % pattern.block_width, corner.1 + inside / pattern.block_width), place)
}
