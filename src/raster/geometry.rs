//! What all tiles share, in the lens frame: for [`super::tile`], [`super::waiting`] and [`super::loose_queue`].

use super::bin::Bins;
use super::view::View;
use glam::DVec3;

/// The geometry to draw, in the lens frame.
pub(crate) struct Geometry<'a> {
    pub view: &'a View,
    pub bins: &'a Bins,
    pub positions: &'a [DVec3],
    /// How many surfaces triangles are part of.
    pub surfaces: usize,
    /// Seconds from any start.
    pub clock: Option<&'a (dyn Fn() -> f64 + Sync)>,
    /// Whether what is drawn is no longer wanted.
    pub stop: &'a dyn Fn() -> bool,
}

impl Geometry<'_> {
    /// Nothing where there is no clock.
    pub(super) fn now(&self) -> f64 {
        self.clock.map_or(0.0, |clock| clock())
    }
}
