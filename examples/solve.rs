//! Which movements make a plane sharp, and what comes back when none does.
//!
//! `cargo run --release --example solve`

use groundglass::{Adjust, Camera, Error, FocusTarget, Optics, glam::DVec3, solve};

fn main() -> Result<(), Error> {
    let camera = Camera::looking_at(DVec3::new(0.0, 1.6, 10.0), DVec3::new(0.0, 0.8, 0.0))?;

    // The ground, by the lens and by the film.
    let ground = FocusTarget::Plane { point: DVec3::ZERO, normal: DVec3::Y };
    for adjust in [Adjust::Front, Adjust::Rear] {
        let solved = solve(&camera, &ground, adjust)?;
        println!(
            "ground, {adjust:?}: front tilt {:.3} degrees, rear tilt {:.3} degrees, extension {:.2} mm",
            solved.front.tilt.as_degrees(),
            solved.rear.tilt.as_degrees(),
            solved.extension.as_millimetres()
        );
        // Forward again: the plane that is sharp is the one that was wanted.
        let optics = Optics::new(&solved)?;
        let sharp = optics.world_from_lens().plane(optics.focus_plane()).normalized();
        assert!((sharp.m.y.abs() - 1.0).abs() < 1e-9 && sharp.e.abs() < 1e-9);
    }

    // A table top 12 cm below the lens: nearer than the focal length, so no tilt reaches it.
    let table = FocusTarget::Plane { point: DVec3::new(0.0, 1.48, 0.0), normal: DVec3::Y };
    match solve(&camera, &table, Adjust::Front) {
        Ok(_) => println!("table: solved"),
        Err(stopped) => {
            println!("table: {stopped} [{:?}]", stopped.limit);
            if let Some(nearest) = stopped.nearest {
                println!(
                    "       the plane {:.1} mm lower can be had, with a tilt of {:.2} degrees",
                    nearest.miss * 1000.0,
                    nearest.camera.front.tilt.as_degrees()
                );
            }
        }
    }
    Ok(())
}
