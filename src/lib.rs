//! groundglass is one exact model of a view camera, and what follows from it: answers (planes, lines, movements),
//! pictures, and diagrams. CPU only, no unsafe code, the same bytes on every machine.
//!
//! A view camera's lens and film stand on two *standards* that tilt, swing, rise and shift. Tilting one turns the
//! plane that is sharp: film, lens and focus plane then share a line (Scheimpflug), and focusing turns the focus
//! plane about another (the hinge line).
//!
//! # Forward: what is sharp
//!
//! A [`Camera`] is mechanics; its [`Optics`] are planes and lines.
//!
//! ```
//! use groundglass::{Angle, Camera, Length, Optics, Standard, glam::DVec3};
//!
//! let mut camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 1.6, 0.0))?;
//! camera.front = Standard { tilt: Angle::degrees(6.0), ..Standard::default() };
//! camera.extension = Length::millimetres(152.3);
//!
//! let optics = Optics::new(&camera)?;
//! let hinge = optics.hinge_distance().expect("the lens is tilted");
//! assert!((hinge - 0.150 / 6.0_f64.to_radians().sin()).abs() < 1e-12); // J = f / sin(tilt)
//!
//! let depth = optics.depth_of_field(0.1e-3).expect("it is no pinhole"); // 0.1 mm on the film
//! let [near, far] = [depth.near, depth.far].map(|limit| optics.axis_crossing(limit));
//! assert!(near.expect("a finite limit") > 0.0 && far.is_some()); // metres; behind the lens beyond infinity
//! # Ok::<(), groundglass::Error>(())
//! ```
//!
//! # Back: which movements
//!
//! [`solve()`] turns one standard until a plane is sharp, or says which [`Limit`](optics::Limit) stops it and
//! what can be had instead. "It cannot be done" is an answer here, with its own type.
//!
//! ```
//! use groundglass::{Adjust, Camera, FocusTarget, glam::DVec3, solve};
//!
//! let camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 0.4, 0.0))?;
//! let ground = FocusTarget::Plane { point: DVec3::ZERO, normal: DVec3::Y };
//! let solved = solve(&camera, &ground, Adjust::Front)?;
//! println!("tilt the lens {:.2} degrees", solved.front.tilt.as_degrees());
//! # assert!((solved.front.tilt.as_degrees() - 5.34).abs() < 0.01);
//!
//! let through_the_lens = FocusTarget::Plane { point: DVec3::new(0.0, 1.6, 10.0), normal: DVec3::Y };
//! let stopped = solve(&camera, &through_the_lens, Adjust::Front).unwrap_err();
//! let nearest = stopped.nearest.as_ref().expect("a parallel plane");
//! println!("{stopped}; one {} m beside it can be had", nearest.miss);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Pictures
//!
//! A [`Scene`] is a scene file with everything it names, loaded and placed. [`render()`] averages over the pixel
//! and the aperture, and knows its own error.
//!
//! ```
//! use groundglass::{Execution, Scene, render, scene::Budget};
//!
//! let mut scene = Scene::read("examples/tower.toml")?;
//! (scene.render.width, scene.render.height) = (32, 40);
//! scene.render.budget = Budget::Samples(16); // or MaxError(0.005)
//! let (exposure, _) = render(&scene, Execution::default())?;
//! let rows: Vec<u8> = exposure.to_srgb8(scene.render.exposure_ev); // red, green, blue, from the top left
//! assert_eq!(rows.len(), 32 * 40 * 3);
//! # Ok::<(), groundglass::Error>(())
//! ```
//!
//! A preview is a picture of few samples, drawn anew with more: one of 16 takes some hundredths of a second. What is cancelled leaves
//! nothing ([`Execution::cancel`]), and [`Execution::progress`] tells of tiles, not of pixels.
//!
//! Files come through a [`Source`]: the disk ([`Files`](scene::Files), which can be fenced into a folder) or
//! memory ([`Memory`](scene::Memory)).
//!
//! # Diagrams
//!
//! A [`Figure`] is the camera in section, with its planes and lines to scale, as SVG, PDF or pixels.
//!
//! ```
//! use groundglass::{Camera, Figure, FocusTarget, Optics, glam::DVec3, solve};
//!
//! let camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 0.4, 0.0))?;
//! let ground = FocusTarget::Plane { point: DVec3::ZERO, normal: DVec3::Y };
//! let optics = Optics::new(&solve(&camera, &ground, Default::default())?)?;
//! let svg = Figure::side_view(&optics).title("The ground in focus").figure()?.to_svg()?;
//! assert!(svg.contains("data-part=\"scheimpflug-line\""));
//! # Ok::<(), groundglass::Error>(())
//! ```
//!
//! # Conventions
//!
//! * Right-handed frames. **World**: metres, the scene's own axes. **Rail**: origin at the eye, x right, y up, -z toward
//!   the subject. **Lens space**, in which [`Optics`] works: the rail's axes, origin at the lens centre.
//! * [`Length`] and [`Angle`] carry units; bare `f64` are metres and radians where nothing else is said.
//! * Positive tilt leans the top of a standard toward the subject; positive swing turns it to face right;
//!   rise is up and shift to the right along the rail's axes.
//! * A [`Plane`](geometry::Plane) is a covector `(m, e)`: points with `m.x + e = 0`. A [`Line`](geometry::Line) is
//!   Plücker: direction and moment. Both may lie at infinity, and nothing divides by sin(tilt).
//! * Pictures are linear light, upright, pixel (0, 0) at the top left.
//! * Every failure is an [`Error`], or becomes one ([`optics::Unsolvable`], which says which limit stops it): what, where
//!   (file, line, key), and what to do. Nothing panics on input from files; surfaces that you make yourself are to pass
//!   [`scene::Surfaces::check`] first.
//!
//! The examples folder of the repository has the same as whole programs.

#![warn(missing_docs)]

pub mod camera;
pub mod diagram;
pub mod error;
pub mod geometry;
pub mod optics;
pub mod picture;
pub mod plan;
pub mod quantity;
#[cfg(test)]
mod random;
mod raster;
pub mod render;
pub mod sampling;
pub mod scene;
mod shade;
mod simd;
mod srgb;
pub mod stability;
mod threads;

pub use camera::{Aperture, Camera, FilmSize, Standard};
pub use diagram::Figure;
pub use error::{Error, ErrorKind, Result};
pub use glam;
pub use optics::{Adjust, FocusTarget, Optics, solve, upright};
pub use picture::Exposure;
pub use quantity::{Angle, FNumber, Length};
pub use render::{Execution, render};
pub use scene::{Scene, SceneDescription, Source};
