//! How far the plane of sharp focus moves with a small change of the camera: what a photographer must set how exactly.

use super::Optics;
use crate::camera::{Camera, Standard};
use crate::geometry::HomogeneousPoint;
use crate::quantity::Angle;
use glam::DVec3;

/// What a small change of one movement does to the plane of sharp focus at its far end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensitivity {
    /// The far end in lens space, metres: of nine film points (corners, middles of the edges, centre) the sharp object
    /// point that lies farthest from the lens.
    pub far_end: DVec3,
    /// Between these points the plane runs out of sight: somewhere in the picture what is sharp is infinitely far away.
    pub runs_out: bool,
    /// Metres, square to the plane, for a change of [`Sensitivity::ANGLE`]: front tilt and swing.
    pub front: [f64; 2],
    /// The same for rear tilt and swing.
    pub rear: [f64; 2],
    /// The same for a change of [`Sensitivity::LENGTH`] of the extension.
    pub extension: f64,
}

impl Sensitivity {
    /// The change of an angle, degrees.
    pub const ANGLE: f64 = 0.01;
    /// The change of the extension, metres.
    pub const LENGTH: f64 = 1e-5;

    /// The angle that matters most: its name, and how far it moves the plane.
    pub fn largest_angle(&self) -> (&'static str, f64) {
        let all = [
            ("front tilt", self.front[0]),
            ("front swing", self.front[1]),
            ("rear tilt", self.rear[0]),
            ("rear swing", self.rear[1]),
        ];
        all.into_iter().fold(("front tilt", 0.0), |most, next| if next.1 > most.1 { next } else { most })
    }
}

impl Optics {
    /// Of nine film points (corners, middles of the edges, centre) the sharp object point that lies farthest before the lens, if one is
    /// finite; and the least and the largest of their weights: negative where what is sharp lies before the lens, 0 at infinity,
    /// positive where it would lie behind it.
    pub(super) fn far_end(&self) -> (Option<DVec3>, [f64; 2]) {
        let film = self.camera.film;
        let (w, h) = (0.5 * film.width.as_metres(), 0.5 * film.height.as_metres());
        let (mut far_end, mut weights): (Option<DVec3>, [f64; 2]) =
            (None, [f64::INFINITY, f64::NEG_INFINITY]);
        // A plane at infinity has no finite point: what rounding makes of one is none.
        let is_infinite = self.focus_plane().m == DVec3::ZERO;
        for (i, j) in (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j))) {
            let on_film = self.film_point(f64::from(i) * w, f64::from(j) * h);
            let mut object = self.object_of(HomogeneousPoint::finite(on_film));
            // An affine function of the film's point: 0 where what is sharp is at infinity, and of the size of its own rounding there.
            let rounding = 8.0 * f64::EPSILON * (1.0 + on_film.length() / self.f);
            if is_infinite || object.w.abs() <= rounding {
                object.w = 0.0;
            }
            weights = [weights[0].min(object.w), weights[1].max(object.w)];
            let object = object.to_affine();
            let is_seen = object.is_finite() && self.a.dot(object) > 0.0;
            if is_seen && far_end.is_none_or(|far| object.length() > far.length()) {
                far_end = Some(object);
            }
        }
        (far_end, weights)
    }

    /// How far the plane of sharp focus moves at its far end with a small change of the camera. `None` where no sharp point
    /// of the nine is finite and in front of the lens.
    pub fn sensitivity(&self) -> Option<Sensitivity> {
        let (far_end, weights) = self.far_end();
        let far_end = far_end?;
        // By what the plane of the changed camera misses the point; the lens centre stays.
        let moved = |camera: Camera| {
            let distance = Self::new(&camera).ok()?.focus_plane().distance(far_end).abs();
            distance.is_finite().then_some(distance)
        };
        // Toward zero, so that the changed standard faces forwards too; or away, where that takes the plane to infinity.
        let either = |angle: Angle, turned: &dyn Fn(Angle) -> Camera| {
            let step = if angle.as_degrees() > 0.0 { -Sensitivity::ANGLE } else { Sensitivity::ANGLE };
            [step, -step]
                .into_iter()
                .find_map(|step| moved(turned(Angle::degrees(angle.as_degrees() + step))))
        };
        let camera @ Camera { front, rear, .. } = self.camera;
        let of_front = |front| Camera { front, ..camera };
        let of_rear = |rear| Camera { rear, ..camera };
        Some(Sensitivity {
            far_end,
            runs_out: weights[0] <= 0.0 && weights[1] >= 0.0,
            front: [
                either(front.tilt, &|tilt| of_front(Standard { tilt, ..front }))?,
                either(front.swing, &|swing| of_front(Standard { swing, ..front }))?,
            ],
            rear: [
                either(rear.tilt, &|tilt| of_rear(Standard { tilt, ..rear }))?,
                either(rear.swing, &|swing| of_rear(Standard { swing, ..rear }))?,
            ],
            extension: self.moved_by_extension(far_end),
        })
    }

    /// How far [`Sensitivity::LENGTH`] more of extension moves the plane at a point of it. The plane of a film plane `(n, e)` is
    /// `(n - a e/f, e)`, which misses the point by the change of `e` times `1 - a.p/f`: two distances that nearly cancel are not needed.
    fn moved_by_extension(&self, point: DVec3) -> f64 {
        let change = self.n.z * Sensitivity::LENGTH;
        let changed = self.n - (self.e - change) / self.f * self.a;
        (change * (1.0 - self.a.dot(point) / self.f)).abs() / changed.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{Adjust, FocusTarget, solve};
    use crate::quantity::Length;

    fn optics(tilt: f64, extension: f64) -> Optics {
        let mut camera = Camera::looking_at(DVec3::ZERO, DVec3::NEG_Z).unwrap();
        camera.front.tilt = Angle::degrees(tilt);
        camera.extension = Length::millimetres(extension);
        Optics::new(&camera).unwrap()
    }

    #[test]
    fn an_untilted_camera_moves_as_its_formula_says() {
        // D = f d / (d - f): dD = f^2 / (d - f)^2 for each unit of d.
        let found = optics(0.0, 153.0).sensitivity().unwrap();
        let want = 0.15 * 0.15301 / 0.00301 - 0.15 * 0.153 / 0.003;
        assert!((found.extension + want).abs() < 1e-9, "{found:?}");
        // With `1/J = tan(angle)/f` the plane `-z = D + y D/J` leaves the point at y by y D/J; with the film turned alone
        // the hinge line lies `1/J = tan(angle) (D - f)/D/f` below.
        let (angle, distance) = (Sensitivity::ANGLE.to_radians(), 0.15 * 0.153 / 0.003);
        let (front, rear) = (angle * distance / 0.15, angle * (distance - 0.15) / 0.15);
        let (x, y) = (found.far_end.x.abs(), found.far_end.y.abs());
        let film = optics(0.0, 153.0).camera().film;
        let corner = [film.width, film.height].map(|side| 0.5 * side.as_metres() * distance / 0.153);
        assert!((x / corner[0] - 1.0).abs() < 1e-12 && (y / corner[1] - 1.0).abs() < 1e-12, "{found:?}");
        for (got, want) in
            found.front.into_iter().chain(found.rear).zip([front * y, front * x, rear * y, rear * x])
        {
            assert!((got / want - 1.0).abs() < 1e-3, "{got} {want}");
        }
        assert_eq!(found.largest_angle(), ("front swing", found.front[1]));
    }

    #[test]
    fn a_plane_that_runs_to_the_horizon_is_told() {
        assert!(!optics(0.0, 153.0).sensitivity().unwrap().runs_out);
        assert!(!optics(1.0, 153.0).sensitivity().unwrap().runs_out);
        // Sharp ground one metre below a level camera: the horizon is in the middle of the film.
        let camera = *optics(0.0, 160.0).camera();
        let ground = FocusTarget::Plane { point: DVec3::NEG_Y, normal: DVec3::Y };
        let found = Optics::new(&solve(&camera, &ground, Adjust::Front).unwrap()).unwrap();
        assert!(found.sensitivity().unwrap().runs_out);
    }

    #[test]
    fn nothing_finite_in_sight_is_none() {
        assert_eq!(optics(0.0, 150.0).sensitivity(), None);
        assert!(optics(6.0, 152.3).sensitivity().is_some());
        // Both standards turned alike and focused at infinity: what rounding leaves of the weights is no place.
        for tenth in 1..300 {
            let mut camera = *optics(f64::from(tenth) / 10.0, 150.0).camera();
            camera.rear.tilt = camera.front.tilt;
            let sharp = Optics::new(&camera).unwrap();
            let along = camera.extension.as_metres() / sharp.axis().dot(-sharp.film_center()) * 0.15;
            camera.extension = Length::metres(along);
            let sharp = Optics::new(&camera).unwrap();
            assert_eq!(sharp.sensitivity().is_some(), sharp.focus_plane().m != DVec3::ZERO, "{tenth}");
        }
    }

    #[test]
    fn a_step_to_infinity_is_taken_the_other_way() {
        // 0.01 degrees of tilt are all that keeps this plane from infinity.
        let [last, beyond] = [0.01, 0.010_000_1].map(|tilt| optics(tilt, 150.0).sensitivity().unwrap());
        assert!((last.far_end.length() / 3018.428 - 1.0).abs() < 1e-6, "{last:?}");
        assert!((last.far_end.length() / beyond.far_end.length() - 1.0).abs() < 1e-4, "{beyond:?}");
        assert!(last.front[0] > 0.0 && last.rear[0] > 0.0);
    }

    #[test]
    fn rounding_of_a_point_at_infinity_is_no_far_end() {
        // Ground above and below a level camera, by its film: the film's middle row sees the horizon.
        for height in [1.0, 0.05, 0.02, -0.15] {
            let ground = FocusTarget::Plane { point: DVec3::Y * height, normal: DVec3::Y };
            let camera = solve(optics(0.0, 160.0).camera(), &ground, Adjust::Rear).unwrap();
            let found = Optics::new(&camera).unwrap().sensitivity().unwrap();
            assert!(found.runs_out && found.far_end.length() < 100.0 * height.abs(), "{height}: {found:?}");
        }
    }

    #[test]
    fn long_extensions_keep_their_digits() {
        // D = f d / (d - f) changes by f^2 / ((d - f) (d - f + change)) of the change.
        for (extension, digits) in [(151.0, 1e-12), (150e3, 1e-12), (1e15, 1e-3)] {
            let found = optics(0.0, extension).sensitivity().unwrap();
            let (d, change) = (extension / 1e3, Sensitivity::LENGTH);
            let want = 0.15 * 0.15 * change / ((d - 0.15) * (d - 0.15 + change));
            assert!((found.extension / want - 1.0).abs() < digits, "{extension}: {} {want}", found.extension);
        }
    }
}
