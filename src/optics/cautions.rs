//! What a photographer should know before using a camera. In: optics. Out: sentences; and the lens's coverage.

use super::Optics;
use glam::DVec3;

/// A lens that covers more than this from side to side is rare.
const WIDE_DEGREES: f64 = 105.0;

/// Focal lengths beyond which a plane's crossing of the axis is said to be at infinity.
const PARALLEL: f64 = 1e9;

impl Optics {
    /// The largest angle from the lens axis to a film corner, radians, and the diameter of the image circle about the
    /// axis that the film needs, metres.
    pub fn coverage(&self) -> (f64, f64) {
        let film = self.camera().film;
        let (w, h) = (0.5 * film.width.as_metres(), 0.5 * film.height.as_metres());
        let mut angle: f64 = 0.0;
        let mut reach: f64 = 0.0;
        // Where the lens axis meets the film.
        let foot = self.film_plane().meet_ray(DVec3::ZERO, self.axis()).to_affine();
        for (x, y) in [(w, h), (w, -h), (-w, h), (-w, -h)] {
            let corner = self.film_point(x, y);
            let back = -self.axis();
            angle = angle.max(libm::atan2(back.cross(corner).length(), back.dot(corner)));
            reach = reach.max((corner - foot).length());
        }
        (angle, 2.0 * reach)
    }

    /// What is unusual about this camera, a sentence each: it can be computed, but hardly built or of use.
    pub fn cautions(&self) -> Vec<String> {
        let mut list = Vec::new();
        if self.film_reaches_aperture() {
            list.push("the film plane reaches the aperture: such a scene cannot be rendered".to_owned());
        }
        let (angle, _) = self.coverage();
        if 2.0 * angle.to_degrees() > WIDE_DEGREES {
            list.push(format!(
                "the film's corners lie {:.2} degrees from the lens axis: hardly any lens has such an image circle",
                angle.to_degrees()
            ));
        }
        // The focus plane crosses the axis behind the lens: what lies before the lens on it is out of focus. Farther off than
        // this it is parallel to the axis but for rounding.
        let cut = self.focus_plane().meet_ray(DVec3::ZERO, self.axis());
        let along = cut.xyz.dot(self.axis()) / cut.w;
        if along < 0.0 && along > -PARALLEL * self.focal_length() {
            list.push("the focus plane crosses the lens axis behind the lens".to_owned());
        }
        list
    }
}
