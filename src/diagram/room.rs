//! Rooms of labels: rectangles of the page, level or turned with the line they name. In: middle, half sides, direction of
//! the words. Out: whether lines and other rooms come into them.

use super::display_list::Point;

/// A rectangle of the page, its words running along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Room {
    pub(crate) center: Point,
    /// Half its length along the words and half its height, millimetres.
    pub(crate) half: [f64; 2],
    /// The unit direction of the words on the page.
    pub(crate) along: Point,
}

impl Room {
    /// A room whose words are level.
    pub(crate) fn level(center: Point, half: [f64; 2]) -> Self {
        Self { center, half, along: [1.0, 0.0] }
    }

    /// A page point from the middle, along the words and down from them.
    fn own(&self, p: Point) -> Point {
        let (x, y) = (p[0] - self.center[0], p[1] - self.center[1]);
        [x * self.along[0] + y * self.along[1], y * self.along[0] - x * self.along[1]]
    }

    /// The page point so far along the words and down from the middle.
    pub(crate) fn page(&self, [x, y]: Point) -> Point {
        let [c, s] = self.along;
        [self.center[0] + x * c - y * s, self.center[1] + x * s + y * c]
    }

    /// Its corners, beginning above the first letter, and going round; `grow` millimetres outside of it.
    pub(crate) fn corners(&self, grow: f64) -> [Point; 4] {
        let [x, y] = self.half.map(|side| side + grow);
        [[-x, -y], [x, -y], [x, y], [-x, y]].map(|corner| self.page(corner))
    }

    /// Whether a segment comes into the room grown by `clear`.
    pub(crate) fn is_crossed(&self, a: Point, b: Point, clear: f64) -> bool {
        let (a, b) = (self.own(a), self.own(b));
        let (mut t0, mut t1) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let most = self.half[axis] + clear;
            let along = b[axis] - a[axis];
            if along.abs() < 1e-12 {
                if a[axis].abs() > most {
                    return false;
                }
            } else {
                let (s, e) = ((-most - a[axis]) / along, (most - a[axis]) / along);
                t0 = t0.max(s.min(e));
                t1 = t1.min(s.max(e));
            }
        }
        t0 <= t1
    }

    /// Whether two rooms are nearer than `clear`, along and across their words: no side of either parts them.
    pub(crate) fn is_near(&self, other: &Self, clear: [f64; 2]) -> bool {
        let cosine = self.along[0] * other.along[0] + self.along[1] * other.along[1];
        let sine = self.along[0] * other.along[1] - self.along[1] * other.along[0];
        // Words of different directions do not read on: there the smaller clearance does.
        let clear = if cosine > 0.99 { clear } else { [clear[1]; 2] };
        let (c, s) = (cosine.abs(), sine.abs());
        let parted = |one: &Self, two: &Self| {
            let apart = one.own(two.center);
            let reach = [two.half[0] * c + two.half[1] * s, two.half[0] * s + two.half[1] * c];
            (0..2).any(|k| apart[k].abs() >= one.half[k] + reach[k] + clear[k])
        };
        !parted(self, other) && !parted(other, self)
    }

    /// The point of the room nearest to a page point.
    pub(crate) fn nearest(&self, p: Point) -> Point {
        let [x, y] = self.own(p);
        self.page([x.clamp(-self.half[0], self.half[0]), y.clamp(-self.half[1], self.half[1])])
    }
}

/// The way that words along a line run: from left to right, and upward where it is steep.
pub(crate) fn reading(a: Point, b: Point) -> Option<Point> {
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    let length = libm::hypot(x, y);
    if length.is_nan() || length <= 0.0 {
        return None;
    }
    let along = [x / length, y / length];
    // Down the page at up to 70 degrees (y is down): a little beyond, heads would lean the wrong way.
    let leans = along[0] * 0.939_692_620_785_908_4 - along[1] * 0.342_020_143_325_668_7;
    Some(if leans >= 0.0 { along } else { along.map(|x| -x) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_rooms_are_parted_by_a_side_of_either() {
        let one = Room::level([0.0, 0.0], [10.0, 1.0]);
        let slant = std::f64::consts::FRAC_1_SQRT_2;
        let other = |x: f64, y: f64| Room { center: [x, y], half: [10.0, 1.0], along: [slant, slant] };
        assert!(one.is_near(&other(0.0, 0.0), [0.0; 2]));
        // Its upper corner, 6.36 mm above its middle and to the left, lies just in, just out.
        assert!(one.is_near(&other(0.0, 8.7), [0.0; 2]));
        assert!(!one.is_near(&other(0.0, 8.8), [0.0; 2]));
        assert!(one.is_near(&other(0.0, 8.8), [2.0, 0.5]));
        assert!(one.is_crossed([0.0, -5.0], [0.0, 5.0], 0.0) && !one.is_crossed([0.0, 2.0], [5.0, 2.0], 0.9));
        let turned = Room { along: [0.0, -1.0], ..one };
        assert!(
            turned.is_crossed([-3.0, 9.0], [3.0, 9.0], 0.0)
                && !turned.is_crossed([2.0, 0.0], [9.0, 0.0], 0.9)
        );
        let [first, ..] = turned.corners(0.0);
        assert!((first[0] + 1.0).abs() < 1e-12 && (first[1] - 10.0).abs() < 1e-12, "{first:?}");
    }

    #[test]
    fn words_run_to_the_right_or_up_the_page() {
        let run = |to: Point| reading([0.0; 2], to).unwrap();
        assert_eq!(run([-2.0, 0.0]), [1.0, 0.0]);
        assert_eq!(run([0.0, 3.0]), [0.0, -1.0]);
        assert!(run([1.0, 2.0])[0] > 0.0 && run([0.1, 2.0])[1] < 0.0 && run([-0.1, -2.0])[1] < 0.0);
        assert_eq!(reading([1.0, 1.0], [1.0, 1.0]), None);
    }
}
