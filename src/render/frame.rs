//! From optics to the rasterizer's numbers: the lens frame, the view and the falloff of light.
//!
//! In: [`Optics`], and the picture's size. Out: the [`View`] (`raster::view`), and points and directions of the world in the lens
//! frame, for [`super::prepared`]: `(ex.P, ey.P, axis.P)`, with `P` from the lens's centre, along the rail's axes. The projection
//! through a lens point, affine in it, goes from -1..1 to pixels: `((x + w) width / 2, (w - y) height / 2, w)`.

use crate::optics::Optics;
use crate::raster::view::View;
use crate::scene::Scene;
use crate::shade::Falloff;
use glam::{DVec3, DVec4};

/// The lens frame in the world: `x` along `ex`, `y` along `ey`, `z` along the lens axis. Left-handed, which
/// no formula of the rasterizer minds.
pub(super) struct LensFrame<'a> {
    optics: &'a Optics,
    axes: [DVec3; 3],
}

impl<'a> LensFrame<'a> {
    pub(super) fn new(optics: &'a Optics) -> Self {
        let (ex, ey) = optics.lens_axes();
        Self { optics, axes: [ex, ey, optics.axis()] }
    }

    pub(super) fn turn(&self, v: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(v)))
    }

    pub(super) fn vector(&self, world: DVec3) -> DVec3 {
        self.turn(self.optics.world_from_lens().vector_inverse(world))
    }

    pub(super) fn point(&self, world: DVec3) -> DVec3 {
        self.turn(self.optics.world_from_lens().point_inverse(world))
    }

    /// How light falls off over the film.
    pub(super) fn falloff(&self) -> Falloff {
        Falloff::new(self.turn(self.optics.film_normal()), self.turn(self.optics.film_center()))
    }

    /// The camera for the rasterizer, with an aperture of this radius in metres, 0 where all is drawn as through a pinhole.
    pub(super) fn view(&self, scene: &Scene, radius: f64) -> View {
        let optics = self.optics;
        let (width, height) = (scene.render.width, scene.render.height);
        let film = optics.camera().film;
        let (fx, fy) = optics.film_axes();
        // Pixel (0, 0) is the film's corner at +x, -y: the picture is the film turned by half a turn.
        let (film_width, film_height) = (film.width.as_metres(), film.height.as_metres());
        let corner = optics.film_point(0.5 * film_width, -0.5 * film_height);
        let (dx, dy) = (fx * (-film_width / f64::from(width)), fy * (film_height / f64::from(height)));
        let family = |u: f64, v: f64| {
            let [x, y, _, w] = optics
                .projection(u * radius, v * radius)
                .rows
                .map(|row| self.turn(row.truncate()).extend(row.w));
            [(x + w) * (0.5 * f64::from(width)), (w - y) * (0.5 * f64::from(height)), w]
        };
        let c0 = family(0.0, 0.0);
        let less = |c: [DVec4; 3]| [c[0] - c0[0], c[1] - c0[1], c[2] - c0[2]];
        let corners = [(0, 0), (width, 0), (0, height), (width, height)]
            .map(|(x, y)| -self.turn(corner + dx * f64::from(x) + dy * f64::from(y)).z);
        let deepest = corners.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        let near = optics.camera().near.as_metres();
        let slope = libm::hypot(
            optics.film_normal().dot(optics.lens_axes().0),
            optics.film_normal().dot(optics.lens_axes().1),
        );
        View {
            width,
            height,
            film: self.turn(corner),
            film_dx: self.turn(dx),
            film_dy: self.turn(dy),
            focal_length: optics.focal_length(),
            radius,
            near,
            pixel_from_lens: [c0, less(family(1.0, 0.0)), less(family(0.0, 1.0))],
            // Along a ray, w = t (-(n.s + e)) and z = t (-p.z).
            least_w: near * (-optics.film_plane().e - radius * slope) / deepest,
            displacement: [0.0; 2],
        }
    }
}
