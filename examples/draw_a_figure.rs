//! Draws a view camera whose lens is tilted by 6 degrees, as SVG and as PNG.
//!
//! `cargo run --release --example draw_a_figure -- FOLDER`

use groundglass::camera::{Aperture, Camera, FilmSize, Standard};
use groundglass::diagram::Figure;
use groundglass::geometry::Pose;
use groundglass::glam::{DMat3, DVec3};
use groundglass::optics::Optics;
use groundglass::quantity::{Angle, FNumber, Length};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".to_owned());
    let camera = Camera {
        rail: Pose { origin: DVec3::new(0.0, 1.2, 0.0), axes: DMat3::IDENTITY },
        front: Standard { tilt: Angle::degrees(6.0), ..Standard::default() },
        rear: Standard::default(),
        extension: Length::millimetres(152.3),
        focal_length: Length::millimetres(150.0),
        aperture: Aperture::FNumber(FNumber::new(16.0)?),
        film: FilmSize::named("4x5")?,
        near: Length::millimetres(15.0),
    };
    let optics = Optics::new(&camera)?;
    let figure = Figure::side_view(&optics)
        .circle_of_confusion(1e-4)
        .title("The lens tilted by six degrees")
        .figure()?;
    std::fs::write(format!("{folder}/tilt.svg"), figure.to_svg()?)?;
    std::fs::write(format!("{folder}/tilt.png"), figure.to_png(8.0)?)?;
    Ok(())
}
