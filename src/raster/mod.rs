//! The rasterizer: triangles and one family of projections in, visibility out. It knows nothing of
//! scenes or light.
//!
//! Before it come `render::frame` and `render::prepared` (camera and vertices in the lens frame) and `render::pattern` (samples); after
//! it `shade`, to which `render::draw` hands what each tile sees.
//!
//! Stages, in the order data meets them:
//!
//! * [`view`]: the camera as plain numbers in the *lens frame* (`x` along `ex`, `y` along `ey`, `z` along
//!   the lens axis, origin at the lens centre; pixel coordinates on the film).
//! * [`batch`]: a tile's samples, sixteen at a time.
//! * [`cull`]: which clusters of triangles may be seen at all.
//! * [`vertex_boxes`], [`triangle_boxes`]: for each vertex, and from these each triangle, the pixels it can reach from each
//!   cell of the aperture.
//! * [`found`]: the triangles that may touch the picture: a [`candidate`] each.
//! * [`order`]: nearest first.
//! * [`loose`]: how the images of small triangles far out of focus move with the lens point.
//! * [`bunches`]: of these, sixteen at a time that lie close together.
//! * [`tile_lists`]: which of the others may touch which tile of 32 x 32 pixels, in that order.
//! * [`bin`]: leads to all of these, from [`found`] to [`tile_lists`].
//! * [`lens_points`]: of those in bunches, the ones that a tile's lens points see there.
//! * [`part`]: what is drawn of a tile, and what of it a box of pixels touches.
//! * [`film`]: a tile's centre, and the function of an edge or face there.
//! * [`surfaces`]: a tile's own numbers for the surfaces that it may see.
//! * [`geometry`]: all that tiles share.
//! * [`waiting`]: a tile's next sixteen triangles, until a sample may see them.
//! * [`sift`]: in a crowd of triangles, those that samples of the tile may meet.
//! * [`loose_queue`]: where most are far out of focus, all that lens points may see, until a batch does not see them hidden.
//! * [`setup`]: the functions of [`film`] of 16 triangles, once a sample may see them.
//! * [`visit`]: one triangle for 16 samples, as these pass it on.
//! * [`kernel`]: one triangle for 16 samples: its functions at 16 lens points, then coverage and depth by
//!   [`regions`] (block by block) or [`scatter`] (lens point by lens point).
//! * [`visibility`]: what is seen.
//! * [`group`]: the samples of a pixel that see the same.
//! * [`tile`]: leads one tile's triangles, and its samples in batches of 16, from [`waiting`] to [`group`].
//!
//! # Edge functions
//!
//! A film point `p` and a lens point `s` stand for the ray from `s` along `D = q_w s - p`, with
//! `q_w = 1 + a.p/f` (it passes the film point's conjugate). The ray passes a directed edge from `va` to
//! `vb` on the side given by the sign of
//!
//! ```text
//! e = D . ((va - s) x (vb - s)) = q_w s.m - p.m + s.(d x p),   m = va x vb,  d = vb - va
//! ```
//!
//! which is bilinear in lens point and film point: nine coefficients an edge. Reversing an edge negates
//! every term exactly, so two triangles that share an edge can never both miss a sample between them.
//! `1/t = D.N / N.(v0 - s)` orders depth along the ray, with `N` the face's normal. This is the per-sample
//! matrix of Haeberli and Akeley (1990) written out: no divide, no clipping, no case `w <= 0`.

pub(crate) mod batch;
pub(crate) mod bin;
mod bunches;
pub(crate) mod candidate;
pub(crate) mod cull;
pub(crate) mod film;
pub(crate) mod found;
pub(crate) mod geometry;
pub(crate) mod group;
pub(crate) mod kernel;
mod lens_points;
mod loose;
mod loose_queue;
mod order;
pub(crate) mod part;
mod regions;
mod scatter;
mod setup;
mod sift;
mod surfaces;
pub(crate) mod tile;
mod tile_lists;
mod triangle_boxes;
pub(crate) mod vertex_boxes;
pub(crate) mod view;
pub(crate) mod visibility;
pub(crate) mod visit;
mod waiting;

/// Pixels on a tile's side. The picture depends on it: one fixed grid, whatever the threads.
pub(crate) const TILE: u32 = 32;

/// What one loop takes at once: samples of a batch, triangles that are set up together, groups that are shaded together.
pub(crate) const LANES: usize = 16;

/// Batches of that many samples that are drawn one by one and shaded together.
pub(crate) const BATCHES: usize = 4;
