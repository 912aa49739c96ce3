//! Clusters: triangles that come one after another in the scene, and the box that holds them; made once when a scene is loaded, so that
//! what is out of view is passed over at one look.
//!
//! In: triangles. Out: for each [`Clusters::SIZE`] of them their box, in the world, and the range of their vertices. Neighbours in a file are
//! neighbours in space as a rule; where they are not, boxes are large, and nothing is passed over.

use super::surfaces::{Surfaces, bounds};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// Some triangles.
#[derive(Clone, Debug)]
pub(crate) struct Cluster {
    /// The box that holds them, metres in the world.
    pub low: DVec3,
    pub high: DVec3,
    /// Their vertices have numbers in this range.
    pub vertices: Range<u32>,
}

/// The clusters of a scene, in the order of its triangles.
#[derive(Clone, Debug, Default)]
pub struct Clusters(pub(crate) Vec<Cluster>);

impl Clusters {
    /// Triangles of a cluster.
    pub(crate) const SIZE: usize = 256;

    /// Whether they are empty, or can be of so many triangles and vertices.
    pub(super) fn are_of(&self, [triangles, vertices]: [usize; 2]) -> bool {
        let is_within = |cluster: &Cluster| cluster.vertices.end as usize <= vertices;
        self.0.is_empty() || self.0.len() == triangles.div_ceil(Self::SIZE) && self.0.iter().all(is_within)
    }

    pub(super) fn new(surfaces: &Surfaces) -> Self {
        let of = |triangles: &[[u32; 3]]| {
            let corners = triangles.as_flattened();
            let [low, high] = bounds(corners.iter().map(|&v| surfaces.positions[v as usize]));
            let [first, last] =
                corners.iter().fold([u32::MAX, 0], |[first, last], &v| [first.min(v), last.max(v)]);
            Cluster { low, high, vertices: first..last + 1 }
        };
        Self(surfaces.triangles.par_chunks(Self::SIZE).map(of).collect())
    }
}

impl Cluster {
    /// The corners of its box.
    pub(crate) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|at| {
            let [x, y, z] =
                [0, 1, 2].map(|axis| if at >> axis & 1 == 1 { self.high[axis] } else { self.low[axis] });
            DVec3::new(x, y, z)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_triangle_lies_in_the_box_of_its_cluster() {
        let mut surfaces = Surfaces::default();
        let at = |i: u32| DVec3::new(f64::from(i % 7), f64::from(i % 1013), -f64::from(i));
        surfaces.positions = (0..1500).map(at).collect();
        surfaces.triangles = (0..700).map(|t| [2 * t + 2, 2 * t, 2 * t + 1]).collect();
        let clusters = Clusters::new(&surfaces).0;
        assert_eq!(clusters.len(), 3);
        assert_eq!(clusters[2].vertices, 1024..1401);
        for (t, corners) in surfaces.triangles.iter().enumerate() {
            let cluster = &clusters[t / Clusters::SIZE];
            for &v in corners {
                let at = surfaces.positions[v as usize];
                assert!(cluster.vertices.contains(&v) && at.clamp(cluster.low, cluster.high) == at, "{t}");
            }
        }
        assert_eq!(clusters[0].corners()[6], DVec3::new(0.0, 512.0, 0.0));
    }
}
