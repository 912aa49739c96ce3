//! Rounds by hand: what goes on after it was thought done, and what is known of blocks before they are drawn.

use super::allocate::{Block, Forecast, Goal, TileBlocks};
use super::covered::Covered;
use super::kept::Blocks;
use super::prepared::{Prepared, Sequence};
use super::progressive::Progressive;
use super::{Counts, Execution, draw};
use crate::error::Result;
use crate::picture::{Allocation, BLOCK, Exposure};
use crate::sampling::runs::SKY_RUN;
use crate::scene::{LoadSettings, Memory, Scene, parse};
use std::path::Path;

const SCENE: &str = "[camera]
eye_m = [0.0, 0.0, 1.0]
look_at_m = [0.0, 0.0, 0.0]
focal_length_mm = 150.0
f_number = 2.0
film = \"4x5\"
extension_mm = 180.0
[[mesh]]
path = \"a.obj\"
[sun]
toward = [0.5, 0.8, 0.6]
color = [0.8, 0.7, 0.6]
";

/// Of a scene whose mesh has these triangles, 100 pixels wide.
fn scene(mesh: &str) -> Result<Scene> {
    let files = Memory::new().with("a.obj", mesh.as_bytes().to_vec());
    let settings = LoadSettings { width: Some(100), ..Default::default() };
    parse(SCENE, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)
}

/// Three triangles, of which lens points see more than a pinhole would.
const THREE: &str = "v -1 -0.2 0.3\nv 1 0 0\nv 0 0.3 -0.5\nv 0.1 -0.3 0.1\nf 1 2 3\nf 1 4 3\nf 2 3 4\n";

#[test]
fn what_shows_more_than_the_sky_is_known_beforehand() -> Result<()> {
    let execution = Execution::default();
    // About in focus; and far out of it.
    let sharp = "v -0.12 -0.06 0.1\nv 0.14 -0.05 0.1\nv 0.02 0.16 0.05\nf 1 2 3\n";
    let blurred = "v -0.08 -0.06 0.4\nv 0.05 -0.06 0.45\nv -0.05 0.05 0.42\nf 1 2 3\n";
    // Behind the camera.
    let empty = scene("v -1 0 9\nv 1 0 9\nv 0 1 9\nf 1 2 3\n")?;
    let uniform = |scene: &Scene| -> Result<Exposure> {
        let sequence = Sequence::Uniform(64);
        Ok(draw(scene, sequence, &execution, |picture, counts| picture.uniform(64, &execution, counts))?.0)
    };
    let sky = uniform(&empty)?;
    for mesh in [sharp, blurred] {
        let scene = scene(mesh)?;
        let found = uniform(&scene)?;
        let places = || (0..found.height()).flat_map(|y| (0..found.width()).map(move |x| (x, y)));
        let covered = draw(&scene, Sequence::Runs(64), &execution, |picture, _| {
            let covered = Covered::new(picture);
            Ok(places().map(|(x, y)| covered.has(x / BLOCK, y / BLOCK)).collect::<Vec<_>>())
        })?;
        // Where there is nothing to see there is no defocus either, which changes the sky by 1e-4.
        let shows_more = |(x, y): (u32, u32)| {
            found.pixel(x, y).into_iter().zip(sky.pixel(x, y)).any(|(found, sky)| (found - sky).abs() > 1e-3)
        };
        assert!(places().zip(&covered).all(|(place, &covered)| covered || !shows_more(place)));
        let [shown, reached] =
            [places().filter(|&place| shows_more(place)).count(), covered.iter().filter(|c| **c).count()];
        assert!(shown > 500 && reached < 4 * shown, "{shown} {reached}");
    }
    Ok(())
}

/// A lamp of one pixel in a hundred, blurred over many.
const LAMP: &str = "mtllib a.mtl\nusemtl lamp\nv 0 0 0.4\nv 0.002 0 0.4\nv 0 0.002 0.4\nf 1 2 3\n";

#[test]
fn errors_after_the_first_run_are_of_that_alone() -> Result<()> {
    let files = Memory::new()
        .with("a.obj", LAMP.as_bytes().to_vec())
        .with("a.mtl", b"newmtl lamp\nKe 4000 4000 4000\n".to_vec());
    let settings = LoadSettings { width: Some(100), ..Default::default() };
    let scene = parse(SCENE, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)?;
    let execution = Execution::default();
    let [on, first] = draw(&scene, Sequence::Runs(256), &execution, |picture, counts| {
        let mut on = Progressive::new(picture, &execution, counts)?;
        let tile =
            TileBlocks::new(vec![Block { pixels: 64, samples: 16, error: 1.0, cost: 1.0, is_sky: false }], 1);
        on.first_round(&Forecast::new(&[tile], Goal::Error(1e-3), 1.5, 256), &execution)?;
        assert!(on.blocks().iter().any(|block| block.samples > 16), "none went on");
        let mut first = Progressive::new(picture, &execution, counts)?;
        first.round(&first.first_samples(), &execution, &|| false)?;
        assert!(first.errors.iter().zip(&first.plain).any(|(all, plain)| all > plain), "no light is hidden");
        Ok([on.after_first(), first.after_first()])
    })?;
    assert_eq!(on, first);
    Ok(())
}

/// The same numbers of samples drawn at once make the same picture, which states the same error.
fn is_as_drawn_at_once(
    picture: &Prepared<'_>,
    progressive: Progressive<'_>,
    execution: &Execution<'_>,
    counts: Counts,
) -> Result<()> {
    let (found, _) = progressive.finish(execution)?;
    let Allocation::Blocks(samples) = found.samples() else { panic!("by block") };
    let (wanted, _) = picture.allocated(samples, execution, counts)?;
    assert_eq!(found.rms_error(), wanted.rms_error());
    let places = || (0..found.height()).flat_map(|y| (0..found.width()).map(move |x| (x, y)));
    assert!(places().all(|(x, y)| found.pixel(x, y) == wanted.pixel(x, y)));
    Ok(())
}

/// Some blocks go on of tiles whose first run was all that was wanted of them: of these the total alone was kept.
#[test]
fn blocks_that_go_on_after_all_are_as_if_drawn_at_once() -> Result<()> {
    let scene = scene(THREE)?;
    let execution = Execution::default();
    draw(&scene, Sequence::Runs(64), &execution, |picture, counts| {
        // Goes on nowhere.
        let tile =
            TileBlocks::new(vec![Block { pixels: 64, samples: 16, error: 1.0, cost: 1.0, is_sky: false }], 1);
        let forecast = Forecast::new(&[tile], Goal::Error(1e9), 1.5, 1024);
        let mut progressive = Progressive::new(picture, &execution, counts)?;
        progressive.first_round(&forecast, &execution)?;
        assert!(progressive.apart.iter().all(|&apart| apart == 0));
        let some = |times: u32| move |x: u32, y: u32| if (x + 3 * y) % times == 1 { 64 } else { 16 };
        for wanted in [progressive.by_block(some(5)), progressive.by_block(some(2))] {
            progressive.round(&wanted, &execution, &|| false)?;
        }
        assert!(progressive.apart.iter().any(|&apart| apart != 0 && apart != Blocks::MAX));
        is_as_drawn_at_once(picture, progressive, &execution, counts)
    })
}

/// After a pilot the sky is to begin with more samples than the pilot gave it: its tiles are drawn in part again, and go on as a whole.
#[test]
fn tiles_whose_sky_begins_again_go_on_from_what_they_have() -> Result<()> {
    let scene = scene(THREE)?;
    let execution = Execution::default();
    draw(&scene, Sequence::Runs(256), &execution, |picture, counts| {
        let tile = TileBlocks::new(
            vec![Block { pixels: 64, samples: 64, error: 1e-3, cost: 1.0, is_sky: false }],
            1,
        );
        let forecast = Forecast::new(&[tile], Goal::Error(1e-5), 1.5, 256);
        let mut progressive = Progressive::new(picture, &execution, counts)?;
        progressive.sky = SKY_RUN;
        progressive.clear(64);
        progressive.round(&progressive.first_samples(), &execution, &|| false)?;
        progressive.sky = 8;
        progressive.first_round(&forecast, &execution)?;
        let least = |block: &Block| if block.is_sky { 8 } else { 64 };
        assert!(progressive.blocks().iter().all(|block| block.samples >= least(block)));
        assert!(progressive.blocks().iter().any(|block| block.samples > 64), "none went on");
        is_as_drawn_at_once(picture, progressive, &execution, counts)
    })
}
