//! Forward after inverse: the plane of focus of the camera that the solver found, against the plane that was wanted.

use glam::DVec3;
use groundglass::camera::{Camera, Standard};
use groundglass::geometry::Plane;
use groundglass::optics::{Adjust, FocusTarget, Optics, solve};
use groundglass::quantity::{Angle, Length};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn logarithmic(&mut self, low: f64, high: f64) -> f64 {
        libm::exp(self.range(libm::log(low), libm::log(high)))
    }
}

pub struct Found {
    pub solved: u32,
    pub refused: u32,
    /// Planes as unit 4-vectors with lengths in focal lengths: the largest gap, over what rounding of the numbers that
    /// go in and come out alone can do: a plane close to the lens is given by a point far from it, a film that stands
    /// nearly along the rail is placed by a long extension.
    pub gap: f64,
    /// The plane's miss at the wanted point, over the point's distance and its ratio to the focal length.
    pub miss: f64,
}

/// Solves for `wanted` random planes that can be had, half of them by the front, half by the rear standard.
pub fn forward_after_inverse(wanted: u32) -> Found {
    let mut random = Random(7);
    let mut found = Found { solved: 0, refused: 0, gap: 0.0, miss: 0.0 };
    while found.solved < wanted {
        let mut camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z).expect("a frame");
        let f = random.logarithmic(0.01, 1.0);
        camera.focal_length = Length::metres(f);
        let turned = Standard {
            tilt: Angle::degrees(random.range(-30.0, 30.0)),
            swing: Angle::degrees(random.range(-30.0, 30.0)),
            rise: Length::metres(random.range(-0.2, 0.2) * f),
            shift: Length::metres(random.range(-0.2, 0.2) * f),
        };
        let adjust = if random.next() < 0.5 { Adjust::Front } else { Adjust::Rear };
        match adjust {
            Adjust::Front => camera.rear = turned,
            Adjust::Rear => camera.front = turned,
        }
        let lens = camera.lens_frame().origin;
        let distance = random.logarithmic(1.2, 1e5) * f;
        let point = lens + DVec3::new(random.range(-0.5, 0.5), random.range(-0.5, 0.5), -1.0) * distance;
        // From square to the view to nearly through the lens.
        let lean = random.logarithmic(1e-9, 1e3);
        let normal =
            DVec3::new(random.range(-1.0, 1.0) * lean, random.range(-1.0, 1.0) * lean, 1.0).normalize();
        // Planes with J < f are cheap to tell, and dear to refuse: the solver then seeks the nearest.
        let offset = normal.dot(point - lens);
        let n = camera.rear.rotation().z_axis;
        if offset.abs() < 1.5 * f || (adjust == Adjust::Front && n.cross(normal).length() * f > offset.abs())
        {
            continue;
        }
        let Ok(solved) = solve(&camera, &FocusTarget::Plane { point, normal }, adjust) else {
            found.refused += 1;
            continue;
        };
        let optics = Optics::new(&solved).expect("what was solved");
        let (got, want) = (optics.focus_plane(), Plane { m: normal, e: -offset });
        let unit = |p: Plane| p.m.extend(p.e / f).normalize();
        let (a, b) = (unit(got), unit(want));
        let reach = (solved.extension.as_metres() / -optics.film_plane().e).max(1.0);
        let away = (point - lens).length();
        let oblique = (away / (f + offset.abs())).max(1.0);
        let gap = (a - b).length().min((a + b).length()) / reach / oblique;
        let miss = got.distance(point - lens).abs() / away / (away / f) / reach;
        assert!(gap.is_finite() && miss.is_finite(), "{camera:?} for {point}, {normal}");
        (found.gap, found.miss) = (found.gap.max(gap), found.miss.max(miss));
        found.solved += 1;
    }
    found
}
