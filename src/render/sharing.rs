//! Whether samples share look-ups in this picture: some of its tiles drawn both ways in, yes or no out.
//!
//! Where a texture is smooth one look-up stands for the samples of a group (`shade::textured`), and passes over what bends it there and over
//! its steps of 8 bits. That changes a picture by a hundredth of its noise, as long as anything ends in it. Of one smooth wall that
//! fills the picture the samples have next to no noise, and the change would show. So both are measured, in a few tiles evenly spread:
//! `change^2 = sum (mean_shared - mean_alone)^2`, `noise^2 = (n_e n_o / n^2) sum (even / n_e - odd / n_o)^2` of samples that look
//! by themselves. What is found goes by the scene and the number of samples alone.

use super::Execution;
use super::draw::{Tally, TileSums, Work};
use super::pattern::Splits;
use super::prepared::{Prepared, Sequence};
use super::resolve::{AREA, Sum};
use super::scratch::Step;
use super::stages::{Stages, Stopwatch};
use crate::raster::visibility::EVERYWHERE;
use crate::sampling::runs::{FIRST_RUN, Run};
use glam::Vec3;
use rayon::prelude::*;

/// One tile in so many is asked, but at least `LEAST` and at most `MOST`. (Of the city eight told the ratio of change and noise to a
/// factor of two, four to a factor of four.)
const ONE_IN: usize = 160;
const LEAST: usize = 8;
const MOST: usize = 16;

/// Of what is drawn for the answer alone, every other square of 4 x 4 pixels of a tile.
const SOME: u64 = 0xaa55_aa55_aa55_aa55;

/// How many times the change the noise has to be: three is the bound, and few tiles do not tell all. (All tiles of the city: 13 to 56.)
const TIMES: f64 = 5.0;

/// The same where only the first run is asked, and others may follow: from 16 samples to 256 the noise of all of the city's tiles falls 2.6
/// to 4.2 times as far as the change, that of smooth walls farther, which are quiet from the start.
const TIMES_IN_RUNS: f64 = 15.0;

/// A tile of a picture, drawn before it is asked for.
pub(super) struct Asked {
    pub tile: usize,
    pub sums: Vec<Sum>,
    pub tally: Tally,
}

impl Prepared<'_> {
    /// Whether samples are to look by themselves, since sharing would show. Where all pixels get the same number of samples, what
    /// was drawn to find out is of the picture.
    pub(super) fn shows_sharing(
        &self,
        sequence: Sequence,
        execution: &Execution<'_>,
        stages: &mut Stages,
    ) -> (bool, Vec<Asked>) {
        let mut maps = self.materials.iter().filter_map(|material| material.diffuse_map.as_ref());
        if !self.shared || maps.all(|map| map.smooth.is_empty()) {
            return (false, Vec::new());
        }
        let (samples, wanted, steps, times) = match sequence {
            Sequence::Uniform(samples) => {
                (samples, EVERYWHERE, Splits::steps(samples, self.diffraction.is_some()), TIMES)
            }
            Sequence::Runs(_) => {
                let first = Run { first: 0, count: FIRST_RUN };
                (FIRST_RUN, SOME, vec![(first, Splits::new(FIRST_RUN))], TIMES_IN_RUNS)
            }
        };
        let steps: Vec<_> = steps.into_iter().map(|(run, splits)| Step { run, splits, wanted }).collect();
        let work = Work { steps: &steps, is_set_up: false, alone: false };
        let asked = (self.tiles() / ONE_IN).clamp(LEAST, MOST).min(self.tiles());
        let mut found: Vec<(Asked, Vec<Sum>, usize)> = (0..asked)
            .into_par_iter()
            .with_max_len(1)
            .map_init(
                || self.scratch(),
                |scratch, at| {
                    let tile = (2 * at + 1) * self.tiles() / (2 * asked);
                    let [mut sums, mut alone] = [(); 2].map(|()| vec![Sum::default(); AREA]);
                    let both = TileSums { sums: &mut sums, beside: Some(&mut alone) };
                    let watch = Stopwatch::start(execution.clock);
                    let stop = || self.stopped();
                    let (tally, done) =
                        self.draw_tile(scratch.get(), self.place(tile), work, both, watch, &stop);
                    (Asked { tile, sums, tally }, alone, done)
                },
            )
            .collect();
        let mut sum = [0.0; 2];
        for (drawn, alone, _) in &mut found {
            stages.add(&std::mem::take(&mut drawn.tally.stages));
            let of_tile = noise_and_change(alone, &drawn.sums, samples);
            sum = [0, 1].map(|i| sum[i] + of_tile[i]);
        }
        let [noise, change] = sum;
        let shows = noise < times * times * change;
        let is_done = |done: usize| matches!(sequence, Sequence::Uniform(_)) && done == steps.len();
        let as_it_is_to_be = |(drawn, alone, done): (Asked, Vec<Sum>, usize)| {
            is_done(done).then_some(if shows { Asked { sums: alone, ..drawn } } else { drawn })
        };
        (shows, found.into_iter().filter_map(as_it_is_to_be).collect())
    }
}

/// The squares of the noise of samples that look by themselves, and of what sharing changes, summed over the same pixels.
fn noise_and_change(alone: &[Sum], shared: &[Sum], samples: u32) -> [f64; 2] {
    let [n_even, n_odd] = [samples.div_ceil(2), samples / 2].map(|n| n as f32);
    let n = n_even + n_odd;
    let (mut noise, mut change) = (0.0, 0.0);
    for (&alone, &shared) in alone.iter().zip(shared) {
        let [[even, odd], [shared_even, shared_odd]] = [alone, shared].map(|halves| halves.map(Vec3::from));
        noise += f64::from((even / n_even - odd / n_odd).length_squared() * (n_even * n_odd / (n * n)));
        change += f64::from((((even + odd) - (shared_even + shared_odd)) / n).length_squared());
    }
    [noise, change]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Result;
    use crate::render::draw;
    use crate::scene::{LoadSettings, Memory, parse};
    use image::{DynamicImage, ImageFormat, Luma};
    use std::io::Cursor;
    use std::path::Path;

    /// A wall of so many metres, a metre before the camera, on which a texture rises in steps of 8 bits.
    fn wall(size: f64) -> Result<crate::scene::Scene> {
        let rising = image::ImageBuffer::from_fn(256, 256, |x, y| Luma([60 + (x / 4 + y / 8) as u8]));
        let mut png = Cursor::new(Vec::new());
        DynamicImage::from(rising).write_to(&mut png, ImageFormat::Png).expect("a PNG");
        let half = 0.5 * size;
        let mesh = format!(
            "mtllib a.mtl\nusemtl a\nv -{half} -{half} 0\nv {half} -{half} 0\nv {half} {half} 0\nv -{half} {half} 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
             vt 0 1\nf 1/1 2/2 3/3 4/4\n"
        );
        let files = Memory::new()
            .with("a.obj", mesh.into_bytes())
            .with("a.mtl", b"newmtl a\nmap_Kd a.png\n".to_vec())
            .with("a.png", png.into_inner());
        let text = "[camera]\neye_m = [0, 0, 1]\nlook_at_m = [0, 0, 0]\nfocal_length_mm = 150\nfilm = \"4x5\"\nf_number = 8\n\
                    extension_mm = 177\n[[mesh]]\npath = \"a.obj\"\n";
        let settings = LoadSettings { width: Some(100), ..Default::default() };
        parse(text, "a.toml")?.describe()?.load_with(&files, Path::new(""), settings)
    }

    #[test]
    fn what_was_drawn_to_find_out_is_what_the_picture_would_have_there() -> Result<()> {
        for (size, shows) in [(9.0, true), (0.3, false)] {
            for samples in [16, 40] {
                draw(&wall(size)?, Sequence::Uniform(samples), &Execution::default(), |picture, _| {
                    assert_eq!((picture.alone, picture.drawn.len()), (shows, LEAST), "{size} m");
                    let steps: Vec<_> = Splits::steps(samples, false)
                        .into_iter()
                        .map(|(run, splits)| Step { run, splits, wanted: EVERYWHERE })
                        .collect();
                    let work = Work { steps: &steps, is_set_up: false, alone: shows };
                    for drawn in &picture.drawn {
                        let (mut sums, mut scratch) = (vec![Sum::default(); AREA], picture.scratch());
                        let (place, watch) = (picture.place(drawn.tile), Stopwatch::start(None));
                        let into = TileSums::from(&mut sums[..]);
                        picture.draw_tile(scratch.get(), place, work, into, watch, &|| false);
                        assert!(sums == drawn.sums, "{size} m, N = {samples}, tile {place:?}");
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }
}
