//! Prints a table of what error-targeted pictures take: their samples beside those of uniform pictures and of a perfect
//! allocation with the same true error, and whether the mean of many of them is the true picture.
//!
//! `cargo run --release --example allocation_table -- [WIDTH] SCENE.toml ...` (one thread; minutes for each scene)

use groundglass::picture::BLOCK;
use groundglass::scene::Budget;
use groundglass::{Execution, Exposure, Result, Scene, render};
use std::path::Path;

/// Samples of a pixel of what is taken for the truth, and its seed.
const TRUTH: (u32, u64) = (16_384, 990_001);

/// Blocks' true errors are measured at 1, 2, 4 and so on to this many samples of a pixel.
const MOST: u32 = 2048;

/// Pictures that a block's error is the mean of: a curve, and not a throw of dice.
const CURVES: u64 = 4;

/// Error-targeted pictures, each with a seed of its own.
const RUNS: u64 = 64;

/// Uniform numbers of samples whose stated errors are asked for.
const TARGETS: [u32; 2] = [64, 256];

/// The fewest samples of the perfect allocation: the program's own least, and the least that there is.
const FEWEST: [u32; 2] = [16, 1];

fn main() -> Result<()> {
    println!(
        "| scene | error of | uniform | error-targeted | true error over E | perfect (16 or more) | perfect | targeted over \
         perfect (16 or more) | over perfect | over uniform | mean's error over E | of it bias | steps at edges of blocks |"
    );
    println!("|---|{}", "---|".repeat(12));
    let mut width = None;
    for argument in std::env::args().skip(1) {
        match argument.parse() {
            Ok(pixels) => width = Some(pixels),
            Err(_) => table(Path::new(&argument), width)?,
        }
    }
    Ok(())
}

/// The rows of one scene.
fn table(path: &Path, width: Option<u32>) -> Result<()> {
    let mut scene = Scene::read(path)?;
    if let Some(width) = width {
        let height = f64::from(scene.render.height) * f64::from(width) / f64::from(scene.render.width);
        (scene.render.width, scene.render.height) = (width, (height.round() as u32).max(1));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let view = View::new(&scene)?;
    for samples in TARGETS {
        // Asked for is what such a picture states of itself.
        let picture = draw(&scene, 1, Budget::Samples(samples))?;
        let found = view.targeted(&scene, picture.rms_error().unwrap_or(0.0))?;
        let uniform = view.uniform(found.squared);
        let [bounded, perfect] = FEWEST.map(|fewest| view.perfect(fewest, found.squared));
        let Found { samples: taken, error, mean, bias, steps, .. } = found;
        println!(
            "| {name} | {samples} | {uniform:.1} | {taken:.1} | {error:.3} | {bounded:.1} | {perfect:.1} | {:.2} | {:.2} \
             | {:.2} | {mean:.3} | {bias:.3} | {steps:.2} |",
            taken / bounded,
            taken / perfect,
            taken / uniform,
        );
    }
    Ok(())
}

fn draw(scene: &Scene, seed: u64, budget: Budget) -> Result<Exposure> {
    let mut scene = scene.clone();
    (scene.render.seed, scene.render.budget) = (seed, budget);
    Ok(render(&scene, Execution { threads: Some(1), ..Execution::default() })?.0)
}

/// Linear light of all pixels, row by row, brightened and not clamped.
fn light(picture: &Exposure, gain: f32) -> Vec<[f32; 3]> {
    let pixels = (0..picture.height()).flat_map(|y| (0..picture.width()).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.pixel(x, y).map(|c| c * gain)).collect()
}

/// The sum over channels of the squared difference, clamped.
fn squared(a: [f32; 3], b: [f32; 3]) -> f64 {
    let shown = |c: f32| f64::from(c.clamp(0.0, 1.0));
    a.into_iter().zip(b).map(|(a, b)| shown(a) - shown(b)).map(|gap| gap * gap).sum()
}

/// One block's pixels, and its true squared error after each doubling of samples.
#[derive(Clone, Default)]
struct Curve {
    pixels: f64,
    errors: Vec<f64>,
}

/// What is known of one scene.
struct View {
    width: usize,
    gain: f32,
    truth: Vec<[f32; 3]>,
    /// The squared error that the truth states of itself, over all pixels and channels.
    truth_squared: f64,
    curves: Vec<Curve>,
}

/// What came of error-targeted pictures.
struct Found {
    samples: f64,
    /// Their true squared error over all pixels and channels, and the root mean square over the error asked for.
    squared: f64,
    error: f64,
    /// The error of their mean over the one asked for, and what is left of it without the noise of so few.
    mean: f64,
    bias: f64,
    /// Steps of the error across edges of blocks over those inside.
    steps: f64,
}

impl View {
    fn new(scene: &Scene) -> Result<Self> {
        let gain = libm::exp2(scene.render.exposure_ev) as f32;
        let truth = draw(scene, TRUTH.1, Budget::Samples(TRUTH.0))?;
        let width = truth.width() as usize;
        let (error, truth) = (truth.rms_error().unwrap_or(0.0), light(&truth, gain));
        let truth_squared = error * error * 3.0 * truth.len() as f64;
        let mut view = Self { width, gain, truth, truth_squared, curves: Vec::new() };
        view.curves = vec![Curve::default(); view.block(view.truth.len() - 1) + 1];
        for at in 0..view.truth.len() {
            let block = view.block(at);
            view.curves[block].pixels += 1.0;
        }
        for doublings in 0..=MOST.ilog2() {
            view.curves.iter_mut().for_each(|curve| curve.errors.push(0.0));
            for seed in 1..=CURVES {
                let picture = light(&draw(scene, seed, Budget::Samples(1 << doublings))?, gain);
                for (at, (&a, &b)) in picture.iter().zip(&view.truth).enumerate() {
                    let block = view.block(at);
                    view.curves[block].errors[doublings as usize] += squared(a, b) / CURVES as f64;
                }
            }
        }
        Ok(view)
    }

    /// The block of a pixel.
    fn block(&self, at: usize) -> usize {
        let (x, y, side) = (at % self.width, at / self.width, BLOCK as usize);
        y / side * self.width.div_ceil(side) + x / side
    }

    /// How many samples for all have this squared error; on a straight line between doublings, both in logarithms.
    fn uniform(&self, goal: f64) -> f64 {
        let error = |doublings: usize| self.curves.iter().map(|curve| curve.errors[doublings]).sum::<f64>();
        let last = MOST.ilog2() as usize;
        let after = (1..last).find(|&doublings| error(doublings) <= goal).unwrap_or(last);
        let (before, log) = (after - 1, |x: f64| libm::log2(x.max(1e-300)));
        let slope = log(error(before)) - log(error(after));
        libm::exp2(before as f64 + (log(error(before)) - log(goal)) / slope.max(1e-9))
    }

    /// The fewest samples a pixel with this squared error, at least `fewest` for each block: of all steps along the
    /// blocks' curves those are taken first that take most error for a sample.
    fn perfect(&self, fewest: u32, goal: f64) -> f64 {
        let first = fewest.ilog2() as usize;
        let mut error: f64 = self.curves.iter().map(|curve| curve.errors[first]).sum();
        let mut samples = f64::from(fewest) * self.truth.len() as f64;
        let mut steps: Vec<(f64, f64)> = self.curves.iter().flat_map(|curve| curve.steps(first)).collect();
        steps.sort_by(|a, b| (b.1 / b.0).total_cmp(&(a.1 / a.0)));
        for (more, gain) in steps {
            if error <= goal {
                break;
            }
            let part = ((error - goal) / gain).min(1.0);
            (samples, error) = (samples + part * more, error - part * gain);
        }
        samples / self.truth.len() as f64
    }

    /// Pictures that were asked for `error`.
    fn targeted(&self, scene: &Scene, error: f64) -> Result<Found> {
        let mut halves = [vec![[0.0f32; 3]; self.truth.len()], vec![[0.0; 3]; self.truth.len()]];
        let (mut samples, mut sum, mut steps) = (0.0, 0.0, [(0.0, 0.0); 2]);
        for run in 0..RUNS {
            let picture = draw(scene, 1000 + run, Budget::MaxError(error))?;
            samples += picture.samples().mean() / RUNS as f64;
            let picture = light(&picture, self.gain);
            sum += self.squared(&picture) / RUNS as f64;
            self.add_steps(&picture, &mut steps);
            for (sum, pixel) in halves[(run % 2) as usize].iter_mut().zip(&picture) {
                (0..3).for_each(|c| sum[c] += pixel[c] * 2.0 / RUNS as f32);
            }
        }
        let both = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        let mean: Vec<[f32; 3]> = halves[0].iter().zip(&halves[1]).map(both).collect();
        let noise: f64 = halves[0].iter().zip(&halves[1]).map(|(&a, &b)| 0.25 * squared(a, b)).sum();
        let (gap, values) = (self.squared(&mean), 3.0 * self.truth.len() as f64);
        let part = |squared: f64| (squared.max(0.0) / values).sqrt() / error;
        let step = steps.map(|(squared, count): (f64, f64)| squared / count.max(1.0));
        Ok(Found {
            samples,
            squared: sum,
            error: part(sum),
            mean: part(gap),
            bias: part(gap - noise - self.truth_squared),
            steps: (step[1] / step[0].max(1e-300)).sqrt(),
        })
    }

    /// The squared error of a picture.
    fn squared(&self, picture: &[[f32; 3]]) -> f64 {
        picture.iter().zip(&self.truth).map(|(&a, &b)| squared(a, b)).sum()
    }

    /// Adds the squared steps from each pixel's error to the next one's: inside of blocks, and across their edges.
    fn add_steps(&self, picture: &[[f32; 3]], steps: &mut [(f64, f64); 2]) {
        let gap = |at: usize| picture[at].map(|c| c.clamp(0.0, 1.0)).into_iter().zip(self.truth[at]);
        for at in 0..picture.len() - 1 {
            let (x, side) = ((at % self.width) as u32, 4 * BLOCK);
            // Tiles have lens points of their own, however many samples they get.
            if x % side == side - 1 || x as usize == self.width - 1 {
                continue;
            }
            let gaps = gap(at).zip(gap(at + 1));
            let step =
                gaps.map(|((a, b), (c, d))| f64::from((a - b.clamp(0.0, 1.0)) - (c - d.clamp(0.0, 1.0))));
            let (sum, count) = &mut steps[usize::from(x % BLOCK == BLOCK - 1)];
            (*sum, *count) = (*sum + step.map(|step| step * step).sum::<f64>(), *count + 1.0);
        }
    }
}

impl Curve {
    /// Steps from `1 << first` samples on, each with its samples over all pixels and the error that it takes away, along the
    /// curve's lower hull: the steepest first.
    fn steps(&self, first: usize) -> Vec<(f64, f64)> {
        let samples = |doublings: usize| self.pixels * f64::from(1u32 << doublings);
        let slope = |a: usize, b: usize| (self.errors[a] - self.errors[b]) / (samples(b) - samples(a));
        let (mut at, mut steps) = (first, Vec::new());
        loop {
            let next = (at + 1..self.errors.len()).max_by(|&a, &b| slope(at, a).total_cmp(&slope(at, b)));
            let Some(next) = next.filter(|&next| slope(at, next) > 0.0) else { return steps };
            steps.push((samples(next) - samples(at), self.errors[at] - self.errors[next]));
            at = next;
        }
    }
}
