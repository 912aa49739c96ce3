//! A window of the page onto the section. In: section metres. Out: page millimetres, clipped to its frame.

use super::display_list::Point;

/// A rectangle of the page that shows part of the section at one scale.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    /// Left, top, right, bottom in millimetres.
    pub(crate) frame: [f64; 4],
    /// Page millimetres for a metre.
    pub(crate) scale: f64,
    /// Where the lens centre lies.
    pub(crate) origin: Point,
}

/// A straight line of the page: a point and a unit direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PageLine {
    pub(crate) at: Point,
    pub(crate) along: Point,
}

impl PageLine {
    /// The parameter of the point of the line nearest to `p`.
    pub(crate) fn parameter(&self, p: Point) -> f64 {
        (p[0] - self.at[0]) * self.along[0] + (p[1] - self.at[1]) * self.along[1]
    }

    pub(crate) fn point(&self, t: f64) -> Point {
        [self.at[0] + t * self.along[0], self.at[1] + t * self.along[1]]
    }
}

impl Panel {
    pub(crate) fn page(&self, p: [f64; 2]) -> Point {
        [self.origin[0] + self.scale * p[0], self.origin[1] - self.scale * p[1]]
    }

    pub(crate) fn width(&self) -> f64 {
        self.frame[2] - self.frame[0]
    }

    pub(crate) fn height(&self) -> f64 {
        self.frame[3] - self.frame[1]
    }

    /// Longer than any straight line within the frame.
    pub(crate) fn reach(&self) -> f64 {
        self.width() + self.height()
    }

    pub(crate) fn center(&self) -> Point {
        [0.5 * (self.frame[0] + self.frame[2]), 0.5 * (self.frame[1] + self.frame[3])]
    }

    /// Whether a point lies within the frame by at least `margin`.
    pub(crate) fn holds(&self, p: Point, margin: f64) -> bool {
        p[0] >= self.frame[0] + margin
            && p[0] <= self.frame[2] - margin
            && p[1] >= self.frame[1] + margin
            && p[1] <= self.frame[3] - margin
    }

    /// The value of a trace at a page point.
    pub(crate) fn evaluate(&self, [mu, mv, e]: [f64; 3], p: Point) -> f64 {
        mu * ((p[0] - self.origin[0]) / self.scale) + mv * ((self.origin[1] - p[1]) / self.scale) + e
    }

    /// A trace as a line of the page, when it comes near this panel. The point it holds is the one nearest to
    /// the panel's centre, so that nothing far away spoils the digits.
    pub(crate) fn line(&self, trace: [f64; 3]) -> Option<PageLine> {
        let size = trace[0].abs().max(trace[1].abs());
        if size == 0.0 {
            return None;
        }
        let [mu, mv, e] = trace.map(|x| x / size);
        let length = (mu * mu + mv * mv).sqrt();
        let (nx, ny) = (mu / length, -mv / length);
        let c = self.center();
        let distance = self.evaluate([mu / length, mv / length, e / length], c) * self.scale;
        let near = distance.is_finite() && distance.abs() <= self.reach();
        near.then(|| PageLine { at: [c[0] - distance * nx, c[1] - distance * ny], along: [-ny, nx] })
    }

    /// The part of a line between two parameters that lies within the frame.
    pub(crate) fn clip(&self, line: &PageLine, mut t0: f64, mut t1: f64) -> Option<(f64, f64)> {
        for axis in 0..2 {
            let (low, high) = (self.frame[axis], self.frame[axis + 2]);
            let (at, along) = (line.at[axis], line.along[axis]);
            if along.abs() < 1e-12 {
                if at < low || at > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - at) / along, (high - at) / along);
            t0 = t0.max(a.min(b));
            t1 = t1.min(a.max(b));
        }
        (t1 - t0 > 1e-9).then_some((t0, t1))
    }

    /// The part of a segment within the frame.
    pub(crate) fn clip_segment(&self, a: Point, b: Point) -> Option<(Point, Point)> {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let line = PageLine { at: a, along: [dx / length, dy / length] };
        let (t0, t1) = self.clip(&line, 0.0, length)?;
        // Ends within the frame stay what they are.
        Some((if t0 == 0.0 { a } else { line.point(t0) }, if t1 == length { b } else { line.point(t1) }))
    }

    /// A convex or simple polygon clipped to the frame (Sutherland and Hodgman).
    pub(crate) fn clip_polygon(&self, polygon: &[Point]) -> Vec<Point> {
        let [left, top, right, bottom] = self.frame;
        let mut out = polygon.to_vec();
        out = clip_half(&out, |p| p[0] - left);
        out = clip_half(&out, |p| right - p[0]);
        out = clip_half(&out, |p| p[1] - top);
        clip_half(&out, |p| bottom - p[1])
    }

    /// The frame's corners.
    pub(crate) fn corners(&self) -> [Point; 4] {
        let [l, t, r, b] = self.frame;
        [[l, t], [r, t], [r, b], [l, b]]
    }
}

/// The part of a polygon where `inside` is not negative; `inside` is affine.
pub(crate) fn clip_half(polygon: &[Point], inside: impl Fn(Point) -> f64) -> Vec<Point> {
    let mut out = Vec::with_capacity(polygon.len() + 2);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (fp, fq) = (inside(p), inside(q));
        if fp >= 0.0 {
            out.push(p);
        }
        if (fp < 0.0) != (fq < 0.0) {
            let t = fp / (fp - fq);
            out.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    out
}
