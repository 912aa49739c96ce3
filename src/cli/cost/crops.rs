//! The part of the picture where few samples are most wrong, as several ways draw it: what the eye sees of an error. In: a study.
//! Out: pictures of single pixels made large, and a figure file that sets them side by side.

use super::super::report;
use super::study::{Study, nothing};
use super::ways::{ADAPTIVE, APPROXIMATION, Setting, Step, UNIFORM};
use groundglass::error::Result;
use groundglass::picture::{Allocation, Exposure};
use std::sync::atomic::AtomicBool;

/// Pixels on the side of a crop, and how much larger it is shown.
const CROP: u32 = 64;
const ZOOM: u32 = 6;

/// How many there are at most.
pub(super) const MOST_CROPS: usize = 8;

pub(super) struct Crop {
    pub(super) picture: Exposure,
    pub(super) name: String,
}

/// The file of a crop, counted from 1.
pub(super) fn crop_name(number: usize) -> String {
    format!("crop-{number}.png")
}

/// Draws the crops.
pub(super) fn draw(study: &Study<'_>, cancel: &AtomicBool) -> Result<Vec<Crop>> {
    let Some(truth) = &study.truth else { return Err(nothing()) };
    let ways = [
        (UNIFORM, Setting::Samples(16), "Sobol, *N* = 16"),
        ("halton points", Setting::Samples(16), "Halton, *N* = 16"),
        ("rank-1 points", Setting::Samples(16), "rank-1, *N* = 16"),
        ("random points", Setting::Samples(16), "random, *N* = 16"),
        (UNIFORM, Setting::Samples(64), "Sobol, *N* = 64"),
        (ADAPTIVE, Setting::ErrorOf(64), "adaptive, the error of 64"),
        (APPROXIMATION, Setting::Approximation(16), "pinhole and blur"),
    ];
    let mut pictures = Vec::new();
    for (way, setting, name) in ways {
        // What the study has no row of, its scene has not.
        if study.find(way, &setting.name()).is_some() {
            pictures.push((study.draw(&Step { way: way.to_owned(), setting }, cancel)?, name));
        }
    }
    let Some((first, _)) = pictures.first() else { return Err(nothing()) };
    let (left, top) = worst(first, truth);
    pictures.push((truth.clone(), "converged"));
    let (width, height) = (CROP.min(truth.width()), CROP.min(truth.height()));
    // Of a picture of a few pixels each is larger: a figure sets none that is smaller than a thumbnail.
    let zoom = ZOOM.max(64_u32.div_ceil(width.min(height).max(1)));
    let enlarged = |picture: &Exposure| {
        let places = (0..height * zoom).flat_map(|y| (0..width * zoom).map(move |x| (x, y)));
        let pixels: Vec<_> = places.map(|(x, y)| picture.pixel(left + x / zoom, top + y / zoom)).collect();
        // An enlarged part has no numbers of samples of its own.
        Exposure::from_rows(width * zoom, height * zoom, &pixels, Allocation::Uniform(1))
    };
    let crop = |(picture, name): &(Exposure, &str)| {
        let error = picture.rms_difference(truth, study.scene.render.exposure_ev);
        let error = if error > 0.0 { format!(": {}", report::rms(error)) } else { String::new() };
        Ok(Crop { picture: enlarged(picture)?, name: format!("{name}{error}") })
    };
    pictures.iter().map(crop).collect()
}

/// The figure file that sets them side by side.
pub(super) fn figure(stem: &str, (width, height): (u32, u32), crops: &[Crop]) -> String {
    let list =
        |words: Vec<String>| words.iter().map(|word| format!("{word:?}")).collect::<Vec<_>>().join(", ");
    format!(
        "# Made by `groundglass cost`: {} x {} pixels where 16 samples are most wrong and there is something to see, with the error of the whole picture.\n\
         kind = \"pictures\"\ntitle = {}\nwidth_mm = 160.0\npictures_kb = 400\ncolumns = 4\npictures = [{}]\nnames = [{}]\n",
        CROP.min(width),
        CROP.min(height),
        super::report::title("What the eye sees", stem),
        list((1..=crops.len()).map(crop_name).collect()),
        list(crops.iter().map(|crop| crop.name.clone()).collect()),
    )
}

/// Left top of the crop with the largest error, where there is something to see: the squared error times the variance of the truth.
fn worst(picture: &Exposure, truth: &Exposure) -> (u32, u32) {
    let steps = |size: u32| {
        let last = size.saturating_sub(CROP);
        (0..last).step_by(CROP as usize / 4).chain([last])
    };
    let places = steps(truth.height()).flat_map(|y| steps(truth.width()).map(move |x| (x, y)));
    let score = |(left, top): (u32, u32)| -> f64 {
        let pixels = (top..top + CROP).flat_map(|y| (left..left + CROP).map(move |x| (x, y)));
        let (mut error, mut sum, mut squares, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (x, y) in pixels {
            for (a, b) in picture.pixel(x, y).into_iter().zip(truth.pixel(x, y)) {
                let [a, b] = [a, b].map(|c| f64::from(c.clamp(0.0, 1.0)));
                error += (a - b) * (a - b);
                (sum, squares, count) = (sum + b, squares + b * b, count + 1.0);
            }
        }
        error * (squares / count - (sum / count) * (sum / count)).max(1e-6)
    };
    let scored = places.map(|place| (score(place), place));
    scored.max_by(|a, b| a.0.total_cmp(&b.0)).map_or((0, 0), |(_, place)| place)
}
