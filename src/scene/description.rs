//! What a scene file says, settled: lengths are [`Length`]s, directions are unit vectors, defaults are
//! filled and every number has been judged. Nothing in here has been read from another file, and
//! no optics has been solved yet.

use super::document::Document;
use super::file::SkyTable;
use crate::camera::Camera;
use crate::error::{Error, ErrorKind, Place, Result};
use crate::optics::{Adjust, FocusTarget};
use crate::quantity::{Angle, Length, short};
use crate::sampling::ApertureShape;
use glam::DVec3;

/// The longest side of a picture in pixels: what 16-bit pixel boxes hold.
pub const MAX_PICTURE_SIDE: u32 = crate::sampling::MAX_SIDE;

/// A validated scene. World coordinates are metres in f64.
#[derive(Clone, Debug)]
pub struct SceneDescription {
    /// The text it came from: `document.place("camera.f_number")` names a line for later errors.
    pub document: Document,
    /// The camera as the file gives it. With a focus target, `extension` (the file's, else the focal length)
    /// and the tilt and swing of the adjusted standard are placeholders until they are solved for.
    pub camera: Camera,
    /// The world's upward direction, of unit length.
    pub up: DVec3,
    /// Film width and height in millimetres, as the file gives them (a height in pixels rounds exactly): those of `camera.film`, with
    /// which they are to be changed.
    pub film_mm: [f64; 2],
    /// Shape of the aperture; `None` is a disk.
    pub blades: Option<Blades>,
    /// What shall be sharp; `None` when the file gives the extension.
    pub focus: Option<Focus>,
    /// Largest blur on the film that counts as sharp; a diameter, positive.
    pub circle_of_confusion: Length,
    /// The OBJ files, in the file's order.
    pub meshes: Vec<MeshEntry>,
    /// The sun, if there is one.
    pub sun: Option<Sun>,
    /// Light from everywhere, and the background.
    pub sky: Sky,
    /// Size and quality of the picture.
    pub render: RenderSettings,
}

/// A regular polygon as aperture, its corners on the circle of the aperture's diameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blades {
    /// Number of corners, 3 to 1000.
    pub count: u32,
    /// 0: a corner at +ey; positive turns +ey toward +ex.
    pub rotation: Angle,
}

impl Blades {
    /// The polygon, as samples fill it.
    pub fn shape(&self) -> ApertureShape {
        ApertureShape::Polygon { blades: self.count, rotation: self.rotation.as_radians() }
    }
}

/// The plane that shall be sharp and how to reach it.
#[derive(Clone, Debug, PartialEq)]
pub struct Focus {
    /// The target; a distance is positive and may be infinite, a normal has unit length, points may still lie on one line.
    pub target: FocusTarget,
    /// The standard to turn (of no effect for a distance).
    pub adjust: Adjust,
    /// The line of the file, or none for a target from the command line.
    pub place: Place,
}

/// An OBJ file and where it stands: world = translate + Ry(rotate_y) (scale * vertex).
#[derive(Clone, Debug, PartialEq)]
pub struct MeshEntry {
    /// As written: relative to the scene file, neither empty nor absolute.
    pub path: String,
    /// Metres per unit of the OBJ; positive.
    pub scale: f64,
    /// Turn about the world's y axis.
    pub rotate_y: Angle,
    /// In metres.
    pub translate: DVec3,
}

/// The sun; colours are linear red, green, blue and not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector from the scene to the sun.
    pub toward: DVec3,
    /// What a white surface square to it shows, 1 for white: irradiance over pi.
    pub color: DVec3,
    /// Whether surfaces cast shadows.
    pub shadows: bool,
    /// Diameter of its disk; 0 to 180 degrees.
    pub angular_diameter: Angle,
}

/// Light from everywhere, and the background; linear red, green, blue, not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// What a white surface shows by it alone, 1 for white: irradiance over pi.
    pub ambient: DVec3,
    /// Background at and below the horizon.
    pub horizon: DVec3,
    /// Background straight up.
    pub zenith: DVec3,
}

impl Default for Sky {
    /// The sky of scene files that say nothing of it.
    fn default() -> Self {
        Self::from(&SkyTable::default())
    }
}

impl From<&SkyTable> for Sky {
    fn from(table: &SkyTable) -> Self {
        Self {
            ambient: DVec3::from_array(table.ambient),
            horizon: DVec3::from_array(table.horizon),
            zenith: DVec3::from_array(table.zenith),
        }
    }
}

/// Size and quality of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width in pixels, 1 to [`MAX_PICTURE_SIDE`].
    pub width: u32,
    /// When to stop.
    pub budget: Budget,
    /// Stops by which the PNG is brightened.
    pub exposure_ev: f64,
    /// Whether the corners darken as they do in a camera.
    pub falloff: bool,
    /// Whether light bends at the aperture.
    pub diffraction: bool,
    /// Chooses the samples.
    pub seed: u64,
}

/// When a picture is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    /// Exactly this many samples for each pixel; at least 1.
    Samples(u32),
    /// This root mean square error over the picture, linear light; positive and finite. Where it is out of reach the picture is the best
    /// that can be had, and states the error that it has ([`Exposure::rms_error`](crate::picture::Exposure::rms_error)).
    MaxError(f64),
    /// This many seconds; positive and finite.
    Seconds(f64),
}

impl SceneDescription {
    /// The line of the file that names the mesh `index`, for errors of its assets.
    pub fn mesh_place(&self, index: usize) -> Place {
        self.document.place(&format!("mesh[{index}].path"))
    }

    /// Width and height of the picture in pixels; a width that is `given` replaces the file's. The height follows from the
    /// film's shape, rounds half up and is at least 1.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] when a side is more than [`MAX_PICTURE_SIDE`];
    /// [`ErrorKind::Invalid`] for a width of 0, and where `film_mm` are not the sides of `camera.film`.
    pub fn picture_size(&self, given: Option<u32>) -> Result<(u32, u32)> {
        let width = given.unwrap_or(self.render.width);
        let film = [self.camera.film.width, self.camera.film.height].map(|side| side.as_metres() * 1000.0);
        let is_same = |(mm, side): (&f64, f64)| (mm - side).abs() <= 1e-9 * side;
        // Of what is no number this does not hold.
        if !self.film_mm.iter().zip(film).all(is_same) {
            return Err(Error::invalid("the film has other sides in film_mm than in camera.film")
                .at_key("camera.film_mm")
                .remedy("change both"));
        }
        picture_size(width, self.film_mm).map_err(|error| match (error.kind(), given) {
            (ErrorKind::TooLarge, Some(_)) => {
                error.at(Place { file: Some(self.document.name().to_owned()), ..Place::default() })
            }
            (ErrorKind::TooLarge, None) => error.at(self.document.place("render.width")),
            _ => error,
        })
    }
}

/// Width and height in pixels of a picture on film of this shape: see [`SceneDescription::picture_size`].
pub(super) fn picture_size(width: u32, [film_width, film_height]: [f64; 2]) -> Result<(u32, u32)> {
    let height = (f64::from(width) * film_height / film_width + 0.5).floor().max(1.0);
    if width == 0 {
        return Err(Error::invalid("a picture is at least 1 pixel wide").at_key("render.width"));
    }
    if width > MAX_PICTURE_SIDE || height > f64::from(MAX_PICTURE_SIDE) {
        return Err(Error::new(
            ErrorKind::TooLarge,
            format!(
                "a picture of {width} x {} pixels; a side has at most {MAX_PICTURE_SIDE} pixels",
                short(height)
            ),
        )
        .at_key("render.width")
        .remedy("give a smaller width"));
    }
    Ok((width, height as u32))
}
