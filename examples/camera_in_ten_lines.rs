//! A view camera in ten lines: a lens tilted by six degrees, and what becomes sharp.
//!
//! `cargo run --release --example camera_in_ten_lines`

use groundglass::{Angle, Camera, Error, Length, Optics, Standard, glam::DVec3};

fn main() -> Result<(), Error> {
    let mut camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 1.6, 0.0))?;
    camera.front = Standard { tilt: Angle::degrees(6.0), ..Standard::default() };
    camera.extension = Length::millimetres(152.3);
    let optics = Optics::new(&camera)?;

    let sharp = optics.world_from_lens().plane(optics.focus_plane()).normalized();
    println!("focus plane: n.x + e = 0 with n = {:.4}, e = {:.4} m", sharp.m, sharp.e);
    let hinge = optics.world_from_lens().line(optics.hinge_line());
    println!(
        "hinge line:  along {:.4}, past {:.4}",
        hinge.normalized().direction,
        hinge.nearest_to_origin().to_affine()
    );
    println!(
        "hinge distance: {:.4} m below the lens (J = f / sin tilt)",
        optics.hinge_distance().unwrap_or(f64::INFINITY)
    );
    Ok(())
}
