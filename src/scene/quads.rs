//! Quads: two triangles of a patch that together are a convex quadrilateral, drawn as one.
//!
//! In: triangles, and the patch of each. Out: for a triangle the corner of its partner that it lacks. They are sought among
//! neighbours in the file, where exporters and [`super::triangulate`] leave the halves of a face: with an edge in common, turned the
//! same way, in one plane as well as single precision tells (`|n.(d - a)| <= 2e-6 |n| l`, `l` the longest side), and with every corner
//! of the four turned by more than a thousandth of a radian. What a ray meets of such a quadrilateral is what lies inside its four edges,
//! from wherever it is seen.

use super::clusters::Clusters;
use super::surfaces::Surfaces;
use glam::DVec3;
use rayon::prelude::*;

/// For each triangle its partner's corner, or none.
#[derive(Clone, Debug, Default)]
pub(crate) struct Quads(Vec<Option<Half>>);

/// Half of a quad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Half {
    /// The corner that the triangle lacks.
    corner: u32,
    /// Which of its own corners lies opposite to that.
    across: u8,
    is_first: bool,
}

/// Most distance of the fourth corner from the plane of the others, over the longest side.
const PLANE: f64 = 2e-6;

/// Where no more than one triangle in so many is half of a quad, none is drawn as one: each sixteen triangles with a quad among them take
/// a fourth edge.
const FEW: usize = 8;

/// Least turn at a corner.
const TURN: f64 = 1e-3;

impl Quads {
    /// Those of triangles with these patches. None lies in two clusters, of which one may be passed over.
    pub(super) fn new(surfaces: &Surfaces, patches: &[u32]) -> Self {
        let mut halves = vec![None; patches.len()];
        let each = halves.par_chunks_mut(Clusters::SIZE).enumerate();
        let found = each.map(|(cluster, halves)| {
            let first = cluster * Clusters::SIZE;
            let (mut at, mut found) = (0, 0);
            while at + 1 < halves.len() {
                let t = first + at;
                match joined(surfaces, [t, t + 1]).filter(|_| patches[t] == patches[t + 1]) {
                    Some(pair) => {
                        halves[at..at + 2].copy_from_slice(&pair.map(Some));
                        (at, found) = (at + 2, found + 2);
                    }
                    None => at += 1,
                }
            }
            found
        });
        let found: usize = found.sum();
        if found * FEW > halves.len() { Self(halves) } else { Self::default() }
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The corners of the quad that triangle `t`, with these corners, is half of, in turn; the halves share the first and the third. And
    /// whether it is the first half.
    pub(crate) fn of(&self, t: u32, corners: [u32; 3]) -> Option<([u32; 4], bool)> {
        let half = (*self.0.get(t as usize)?)?;
        let [b, c, a] = std::array::from_fn(|i| corners[(usize::from(half.across) + i) % 3]);
        Some(([a, b, c, half.corner], half.is_first))
    }
}

/// The halves that two triangles are, if they are.
fn joined(surfaces: &Surfaces, pair: [usize; 2]) -> Option<[Half; 2]> {
    let [one, other] = pair.map(|t| surfaces.triangles[t]);
    // The corner across from an edge that the other has the other way round.
    let across = |one: [u32; 3], other: [u32; 3]| {
        (0..3).find(|&i| {
            let (from, to) = (one[(i + 1) % 3], one[(i + 2) % 3]);
            (0..3).any(|j| other[j] == to && other[(j + 1) % 3] == from)
        })
    };
    let (of_one, of_other) = (across(one, other)?, across(other, one)?);
    let (first, last) = (one[of_one], other[of_other]);
    let corners = [first, one[(of_one + 1) % 3], last, one[(of_one + 2) % 3]];
    let half = |corner: u32, across: usize, is_first: bool| Half { corner, across: across as u8, is_first };
    is_convex(corners.map(|v| surfaces.positions[v as usize]))
        .then(|| [half(last, of_one, true), half(first, of_other, false)])
}

/// Whether these are the corners of a plane convex quadrilateral, in turn.
fn is_convex(corners: [DVec3; 4]) -> bool {
    let sides: [DVec3; 4] = std::array::from_fn(|i| corners[(i + 1) % 4] - corners[i]);
    // The plane of the first half, which is the one that is drawn.
    let normal = sides[3].cross(sides[0]);
    let longest = sides.iter().fold(0.0, |most: f64, side| most.max(side.length()));
    let is_plane = normal.dot(corners[2] - corners[0]).abs() <= PLANE * normal.length() * longest;
    let turns = |i: usize| {
        let (before, after) = (sides[(i + 3) % 4], sides[i]);
        before.cross(after).dot(normal) > TURN * before.length() * after.length() * normal.length()
    };
    is_plane && (0..4).all(turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(corners: [[f64; 3]; 4], triangles: [[u32; 3]; 2]) -> Option<[u32; 4]> {
        let positions = corners.map(DVec3::from_array).to_vec();
        let surfaces = Surfaces { positions, triangles: triangles.to_vec(), ..Surfaces::default() };
        let quads = Quads::new(&surfaces, &[0, 0]);
        let [one, other] = [0, 1].map(|t: u32| quads.of(t, triangles[t as usize]));
        assert_eq!(one.is_some(), other.is_some());
        if let (Some((one, one_is_first)), Some((other, other_is_first))) = (one, other) {
            assert_eq!(one, std::array::from_fn(|i| other[(i + 2) % 4]));
            assert!(one_is_first && !other_is_first);
        }
        one.map(|(corners, _)| corners)
    }

    #[test]
    fn halves_of_a_convex_face_are_one_and_others_are_not() {
        let square = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
        // However each begins.
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let turn = |t: [u32; 3], by: usize| std::array::from_fn(|k| t[(k + by) % 3]);
            let quad = found(square, [turn([0, 1, 2], i), turn([0, 2, 3], j)]);
            // The halves share the first and the third.
            assert!(quad == Some([0, 1, 2, 3]) || quad == Some([2, 3, 0, 1]), "{quad:?}");
        }
        // Turned the other way, a fold, an arrowhead, three corners in a row.
        assert_eq!(found(square, [[0, 1, 2], [0, 3, 2]]), None);
        for last in [[0.0, 1.0, 1.001], [0.7, 0.3, 1.0], [-1.0, -1.0, 1.0], [2.0, 2.0, 1.0]] {
            assert_eq!(
                found([square[0], square[1], square[2], last], [[0, 1, 2], [0, 2, 3]]),
                None,
                "{last:?}"
            );
        }
        // What single precision rounds is plane.
        assert!(
            found([square[0], square[1], square[2], [0.0, 1.0, 1.000_001]], [[0, 1, 2], [0, 2, 3]]).is_some()
        );
    }

    #[test]
    fn halves_of_different_patches_or_clusters_stay_apart() {
        let positions =
            [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]].map(DVec3::from_array);
        let mut surfaces = Surfaces { positions: positions.to_vec(), ..Surfaces::default() };
        surfaces.triangles = vec![[0, 1, 2], [0, 2, 3]];
        assert!(Quads::new(&surfaces, &[0, 1]).is_empty());
        // The last of one cluster and the first of the next.
        surfaces.triangles = vec![[0, 1, 1]; Clusters::SIZE - 1];
        surfaces.triangles.extend([[0, 1, 2], [0, 2, 3]]);
        assert!(Quads::new(&surfaces, &vec![0; Clusters::SIZE + 1]).is_empty());
        // One quad among few triangles, and among many.
        for (others, is_some) in [(10, true), (20, false)] {
            surfaces.triangles.drain(..);
            surfaces.triangles.extend([[0, 1, 2], [0, 2, 3]]);
            surfaces.triangles.extend(vec![[0, 1, 1]; others]);
            assert_eq!(!Quads::new(&surfaces, &vec![0; others + 2]).is_empty(), is_some);
        }
    }
}
