//! Rounds by hand: what goes on after it was thought done.

use super::allocate::{Block, Forecast, Goal, TileBlocks};
use super::kept::Blocks;
use super::picture::Sequence;
use super::progressive::Progressive;
use super::{Execution, draw};
use crate::error::Result;
use crate::picture::Allocation;
use crate::scene::{LoadSettings, Memory, parse};
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

/// Some blocks go on of tiles whose first run was all that was wanted of them: of these the total alone was kept.
#[test]
fn blocks_that_go_on_after_all_are_as_if_drawn_at_once() -> Result<()> {
    let mesh = "v -1 -0.2 0.3\nv 1 0 0\nv 0 0.3 -0.5\nv 0.1 -0.3 0.1\nf 1 2 3\nf 1 4 3\nf 2 3 4\n";
    let files = Memory::new().with("a.obj", mesh.as_bytes().to_vec());
    let settings = LoadSettings { width: Some(100), ..Default::default() };
    let scene = parse(SCENE, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)?;
    let execution = Execution::default();
    let pictures = draw(&scene, Sequence::Runs, &execution, |picture, counts| {
        // Goes on nowhere.
        let tile = TileBlocks::new(vec![Block { pixels: 64, samples: 16, error: 1.0, cost: 1.0 }], 1);
        let forecast = Forecast::new(&[tile], Goal::Error(1e9), 1.5, 1024);
        let mut progressive = Progressive::new(picture, &execution, counts)?;
        progressive.first_round(&forecast, &execution)?;
        assert!(progressive.apart.iter().all(|&apart| apart == 0));
        let some = |times: u32| move |x: u32, y: u32| if (x + 3 * y) % times == 1 { 64 } else { 16 };
        for wanted in [progressive.by_block(some(5)), progressive.by_block(some(2))] {
            progressive.round(&wanted, &execution, &|| false)?;
        }
        assert!(progressive.apart.iter().any(|&apart| apart != 0 && apart != Blocks::MAX));
        let (found, _) = progressive.finish(&execution)?;
        let Allocation::Blocks(samples) = found.samples() else { panic!("by block") };
        let (wanted, _) = picture.allocated(samples, &execution, counts)?;
        Ok([found, wanted])
    })?;
    let [found, wanted] = pictures;
    assert_eq!(found.rms_error(), wanted.rms_error());
    let places = || (0..found.height()).flat_map(|y| (0..found.width()).map(move |x| (x, y)));
    assert!(places().all(|(x, y)| found.pixel(x, y) == wanted.pixel(x, y)));
    Ok(())
}
