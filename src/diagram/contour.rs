//! Contours of a function on the page. In: a frame and a function of page points. Out: chains of points where it is zero, found
//! on a grid and sharpened by halving, so that each lies on the contour to a thousandth of a millimetre.

use super::display_list::Point;
use std::collections::BTreeMap;

/// Spacing of the grid, millimetres: features smaller than this may be missed.
const STEP: f64 = 1.0;
/// Halvings along an edge of the grid: 2^-20 of a millimetre.
const HALVINGS: usize = 20;

/// An edge of the grid: column and row of its first corner, and whether it goes down.
type Edge = (usize, usize, bool);

/// The zero contours of `value` in a frame; where it has no value there is no contour.
pub(crate) fn contours(frame: [f64; 4], value: impl Fn(Point) -> Option<f64>) -> Vec<Vec<Point>> {
    let [left, top, right, bottom] = frame;
    let (columns, rows) =
        ((((right - left) / STEP) as usize).max(1), (((bottom - top) / STEP) as usize).max(1));
    let (dx, dy) = ((right - left) / columns as f64, (bottom - top) / rows as f64);
    let corner = |i: usize, j: usize| [left + dx * i as f64, top + dy * j as f64];
    let values: Vec<Option<f64>> = (0..=rows)
        .flat_map(|j| (0..=columns).map(move |i| (i, j)))
        .map(|(i, j)| value(corner(i, j)))
        .collect();
    let at = |i: usize, j: usize| values.get(j * (columns + 1) + i).copied().flatten();
    let mut points: BTreeMap<Edge, Point> = BTreeMap::new();
    let mut links: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
    for j in 0..rows {
        for i in 0..columns {
            let (Some(a), Some(b), Some(c), Some(d)) =
                (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
            else {
                continue;
            };
            let edges: [(Edge, f64, f64); 4] = [
                ((i, j, false), a, b),
                ((i + 1, j, true), b, c),
                ((i, j + 1, false), d, c),
                ((i, j, true), a, d),
            ];
            let mut crossed: Vec<Edge> =
                edges.iter().filter(|(_, p, q)| (*p < 0.0) != (*q < 0.0)).map(|(edge, ..)| *edge).collect();
            for &(i, j, down) in &crossed {
                points.entry((i, j, down)).or_insert_with(|| {
                    let to = if down { corner(i, j + 1) } else { corner(i + 1, j) };
                    halve(corner(i, j), to, &value)
                });
            }
            // A saddle: the value in the middle says which corners belong together.
            if crossed.len() == 4 {
                let middle = value([left + dx * (i as f64 + 0.5), top + dy * (j as f64 + 0.5)]).unwrap_or(a);
                let [(upper, ..), (right, ..), (lower, ..), (left, ..)] = edges;
                crossed = if (middle < 0.0) == (a < 0.0) {
                    vec![upper, right, lower, left]
                } else {
                    vec![upper, left, right, lower]
                };
            }
            for pair in crossed.chunks_exact(2) {
                links.entry(pair[0]).or_default().push(pair[1]);
                links.entry(pair[1]).or_default().push(pair[0]);
            }
        }
    }
    chains(&points, links)
}

/// The zero between two points of different sign.
fn halve(mut from: Point, mut to: Point, value: &impl Fn(Point) -> Option<f64>) -> Point {
    let negative = value(from).is_some_and(|v| v < 0.0);
    for _ in 0..HALVINGS {
        let middle = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        match value(middle) {
            Some(v) if (v < 0.0) == negative => from = middle,
            _ => to = middle,
        }
    }
    [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])]
}

/// Links joined to chains: open ones from their ends first, then rings.
fn chains(points: &BTreeMap<Edge, Point>, mut links: BTreeMap<Edge, Vec<Edge>>) -> Vec<Vec<Point>> {
    let mut starts: Vec<Edge> = links.iter().filter(|(_, to)| to.len() == 1).map(|(e, _)| *e).collect();
    starts.extend(links.iter().filter(|(_, to)| to.len() != 1).map(|(e, _)| *e));
    let mut found = Vec::new();
    for start in starts {
        let (mut here, mut chain) = (start, Vec::new());
        while let Some(next) = links.get_mut(&here).and_then(Vec::pop) {
            if chain.is_empty() {
                chain.extend(points.get(&here));
            }
            if let Some(back) = links.get_mut(&next) {
                back.retain(|e| *e != here);
            }
            chain.extend(points.get(&next));
            here = next;
        }
        if chain.len() > 1 {
            found.push(chain);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_one_ring_on_its_radius() {
        let frame = [0.0, 0.0, 40.0, 30.0];
        let chains = contours(frame, |p| Some(libm::hypot(p[0] - 20.0, p[1] - 15.0) - 9.3));
        assert_eq!(chains.len(), 1);
        assert_eq!(chains[0].first(), chains[0].last());
        for p in &chains[0] {
            assert!((libm::hypot(p[0] - 20.0, p[1] - 15.0) - 9.3).abs() < 1e-4);
        }
    }

    #[test]
    fn a_saddle_and_missing_values_are_joined_or_left_out() {
        let frame = [0.0, 0.0, 20.0, 20.0];
        let cross = contours(frame, |p| Some((p[0] - 9.5) * (p[1] - 9.5) - 0.01));
        assert_eq!(cross.len(), 2, "{cross:?}");
        let half = contours(frame, |p| (p[0] < 10.0).then_some(p[1] - 5.2));
        assert_eq!(half.len(), 1);
        assert!(half[0].iter().all(|p| p[0] < 10.0 && (p[1] - 5.2).abs() < 1e-4));
    }
}
