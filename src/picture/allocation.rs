//! How many samples each part of a picture had: enough to make the picture again.

use crate::error::{Error, Result};
use crate::sampling::runs::{self, Run};

/// Pixels on the side of a block, the unit in which samples are given out.
pub const BLOCK: u32 = 8;

/// Samples for each pixel: one number, or one for each block of [`BLOCK`] x [`BLOCK`] pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Allocation {
    /// The same for every pixel.
    Uniform(u32),
    /// Block by block, row by row from the top left.
    Blocks(BlockSamples),
}

/// Samples of each block of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockSamples {
    width: u32,
    height: u32,
    /// How many are drawn at once first, where there is more than the sky to see; the others follow in runs.
    base: u32,
    samples: Vec<u32>,
}

impl BlockSamples {
    /// For a picture of `width` x `height` pixels, none so far; the first `base` of a pixel are drawn at once, but
    /// [`runs::FIRST_RUN`] or one of [`runs::SKY_RUNS`] where a block shows nothing but the sky.
    pub(crate) fn new(width: u32, height: u32, base: u32) -> Self {
        let count = width.div_ceil(BLOCK) as usize * height.div_ceil(BLOCK) as usize;
        Self { width, height, base, samples: vec![0; count] }
    }

    /// Blocks in a row, and rows of blocks.
    pub(crate) fn columns_and_rows(&self) -> (u32, u32) {
        (self.width.div_ceil(BLOCK), self.height.div_ceil(BLOCK))
    }

    fn at(&self, x: u32, y: u32) -> usize {
        y as usize * self.width.div_ceil(BLOCK) as usize + x as usize
    }

    /// Of the block in column `x` and row `y` of blocks; 0 outside of the picture.
    pub fn get(&self, x: u32, y: u32) -> u32 {
        let (columns, rows) = self.columns_and_rows();
        if x < columns && y < rows { self.samples.get(self.at(x, y)).copied().unwrap_or(0) } else { 0 }
    }

    pub(crate) fn set(&mut self, x: u32, y: u32, samples: u32) {
        let at = self.at(x, y);
        if let Some(slot) = self.samples.get_mut(at) {
            *slot = samples;
        }
    }

    /// How many samples are drawn at once first.
    pub(crate) fn base(&self) -> u32 {
        self.base
    }

    /// The longest run of samples that leads to these.
    pub(crate) fn longest_run(&self) -> u32 {
        let most = self.samples.iter().copied().max().unwrap_or(0);
        Run::between(self.base, most).map(|run| run.count).fold(self.base, u32::max)
    }

    /// Picture width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Every block with its number of pixels and samples.
    fn blocks(&self) -> impl Iterator<Item = (u64, u32)> {
        let columns = self.width.div_ceil(BLOCK);
        self.samples.iter().enumerate().map(move |(i, &samples)| {
            let (x, y) = (i as u32 % columns * BLOCK, i as u32 / columns * BLOCK);
            let pixels = BLOCK.min(self.width - x) * BLOCK.min(self.height - y);
            (u64::from(pixels), samples)
        })
    }

    /// As text: the number drawn at once, a colon, then `COUNTxSAMPLES`, separated by blanks, for blocks one after the other.
    pub fn to_text(&self) -> String {
        let runs = self.samples.chunk_by(|a, b| a == b);
        let words: Vec<_> = runs.map(|run| format!("{}x{}", run.len(), run[0])).collect();
        format!("{}: {}", self.base, words.join(" "))
    }

    /// From such text.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Invalid`] for other text, other numbers of blocks, numbers of samples that no run leads to, and a picture without
    /// pixels; [`crate::error::ErrorKind::TooLarge`] when a side has more than [`MAX_SIDE`](crate::sampling::MAX_SIDE) pixels.
    pub fn from_text(width: u32, height: u32, text: &str) -> Result<Self> {
        let wrong = || Error::invalid("is neither a number of samples nor begins with one and a colon");
        let (base, text) = text.split_once(':').ok_or_else(wrong)?;
        let base =
            base.trim().parse().ok().filter(|&base: &u32| base.is_power_of_two() && runs::is_reached(base));
        super::check_size(width, height)?;
        let mut found = Self::new(width, height, base.ok_or_else(wrong)?);
        let wanted = found.samples.len();
        found.samples.clear();
        for word in text.split_whitespace() {
            let parts = word.split_once('x').and_then(|(n, k)| Some((n.parse().ok()?, k.parse().ok()?)));
            let Some((count, samples)) = parts.filter(|&(_, k): &(usize, u32)| runs::is_of_block(k)) else {
                return Err(Error::invalid(format!("`{word}` is no number of blocks with their samples")));
            };
            if count > wanted - found.samples.len() {
                return Err(Error::invalid(format!("more than the picture's {wanted} blocks")));
            }
            found.samples.resize(found.samples.len() + count, samples);
        }
        if found.samples.len() < wanted {
            return Err(Error::invalid(format!("{} of the picture's {wanted} blocks", found.samples.len())));
        }
        Ok(found)
    }
}

impl Allocation {
    /// As text: a number for all, or [`BlockSamples::to_text`].
    pub fn to_text(&self) -> String {
        match self {
            Self::Uniform(samples) => samples.to_string(),
            Self::Blocks(blocks) => blocks.to_text(),
        }
    }

    /// From such text, for a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// As [`BlockSamples::from_text`].
    pub fn from_text(width: u32, height: u32, text: &str) -> Result<Self> {
        let Ok(samples) = text.parse() else {
            return BlockSamples::from_text(width, height, text).map(Self::Blocks);
        };
        super::check_size(width, height)?;
        check_samples(samples)?;
        Ok(Self::Uniform(samples))
    }

    /// The mean over all pixels.
    pub fn mean(&self) -> f64 {
        match self {
            Self::Uniform(samples) => f64::from(*samples),
            Self::Blocks(blocks) => {
                let sum = blocks.blocks().fold((0, 0), |sum, (pixels, samples)| {
                    (sum.0 + pixels, sum.1 + pixels * u64::from(samples))
                });
                sum.1 as f64 / sum.0 as f64
            }
        }
    }

    /// The fewest and the most of any pixel.
    pub fn range(&self) -> (u32, u32) {
        match self {
            Self::Uniform(samples) => (*samples, *samples),
            Self::Blocks(blocks) => blocks
                .samples
                .iter()
                .fold((u32::MAX, 0), |(least, most), &samples| (least.min(samples), most.max(samples))),
        }
    }
}

/// Whether each pixel can have so many samples.
///
/// # Errors
/// [`Invalid`](crate::error::ErrorKind::Invalid) for none, and for more than [`runs::MOST_SAMPLES`].
pub(crate) fn check_samples(samples: u32) -> Result<()> {
    if (1..=runs::MOST_SAMPLES).contains(&samples) {
        return Ok(());
    }
    Err(Error::invalid(format!("{samples} samples a pixel"))
        .remedy(format!("give 1 to {}", runs::MOST_SAMPLES)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_is_for_all_pixels_of_a_picture_that_can_be() {
        assert_eq!(Allocation::from_text(20, 9, "37").unwrap(), Allocation::Uniform(37));
        assert_eq!(Allocation::from_text(20, 9, "16: 6x16").unwrap().mean(), 16.0);
        for (size, text) in [([0, 0], "1"), ([40_000, 1], "5"), ([20, 9], "0"), ([20, 9], "4000000000")] {
            assert!(Allocation::from_text(size[0], size[1], text).is_err(), "{size:?} {text}");
        }
    }

    #[test]
    fn text_brings_back_the_numbers() {
        let mut blocks = BlockSamples::new(20, 9, 16);
        for (i, samples) in [16, 16, 32, 1024, 1024, 192].into_iter().enumerate() {
            blocks.set(i as u32 % 3, i as u32 / 3, samples);
        }
        let text = blocks.to_text();
        assert_eq!(text, "16: 2x16 1x32 2x1024 1x192");
        assert_eq!(BlockSamples::from_text(20, 9, &text).unwrap(), blocks);
        // From 768 to 1024.
        assert_eq!(blocks.longest_run(), 256);
        // 8 x 8 pixels and 4 x 8 in the first row, 1 pixel high in the second.
        let mean = (64 * 16 + 64 * 16 + 32 * 32 + 8 * 1024 + 8 * 1024 + 4 * 192) as f64 / 180.0;
        assert!((Allocation::Blocks(blocks).mean() - mean).abs() < 1e-12);
    }

    #[test]
    fn other_text_is_an_error() {
        for text in [
            "",
            "6x16",
            "16: 6x16 1x16",
            "16: 5x16",
            "16: 6x17",
            "16: 6x0",
            "16: x16",
            "6",
            "16: 9999999999999999999x16",
            "16: 6x-16",
            "17: 6x32",
            "0: 6x16",
        ] {
            assert!(BlockSamples::from_text(20, 9, text).is_err(), "{text}");
        }
    }
}
