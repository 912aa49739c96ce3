//! Pictures set in figures. In: a PNG, its width on the page, how many bytes it may take. Out: a [`Raster`]: the picture as a
//! JPEG no finer than print shows, pressed until it fits, and the pixels that this JPEG holds.

use crate::diagram::display_list::Raster;
use crate::error::{Error, Result};
use crate::srgb;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};

/// Most pixels of a picture in a figure.
const MOST_PIXELS: u64 = 16_000_000;
/// Pixels a millimetre that print shows: 300 to the inch.
const FINE: f64 = 300.0 / 25.4;
/// Qualities tried, the best first; below the last, blocks show, and fewer pixels serve better.
const QUALITIES: [u8; 8] = [92, 88, 84, 80, 75, 70, 65, 60];

/// Red, green and blue of 8 bits.
pub(crate) struct Picture {
    pub(crate) size: [u32; 2],
    pixels: Vec<u8>,
}

impl Picture {
    /// Reads a PNG of 8 bits a channel.
    ///
    /// # Errors
    /// What is wrong with it, in words that can follow "is no such PNG:".
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, String> {
        let mut reader =
            png::Decoder::new(std::io::Cursor::new(bytes)).read_info().map_err(|why| why.to_string())?;
        let (width, height) = (reader.info().width, reader.info().height);
        let channels = match reader.output_color_type() {
            (png::ColorType::Rgb, png::BitDepth::Eight) => 3,
            (png::ColorType::Rgba, png::BitDepth::Eight) => 4,
            _ => return Err("it has not red, green and blue of 8 bits".to_owned()),
        };
        if u64::from(width) * u64::from(height) > MOST_PIXELS {
            return Err("it has more than 16 million pixels".to_owned());
        }
        let size = reader.output_buffer_size().ok_or("it is too large")?;
        let mut data = vec![0; size];
        reader.next_frame(&mut data).map_err(|why| why.to_string())?;
        let pixels = data.chunks_exact(channels).flat_map(|p| p.iter().take(3).copied()).collect();
        Ok(Self { size: [width, height], pixels })
    }

    /// The picture for a place of the page, in at most so many bytes.
    ///
    /// # Errors
    /// When not even a picture of a few pixels takes so little.
    pub(crate) fn set(&self, bounds: [f64; 4], most: usize) -> Result<Raster> {
        let wide = f64::from(self.size[0]);
        let mut width = ((bounds[2] - bounds[0]) * FINE).min(wide).round();
        while width >= 16.0 {
            let height = (width * f64::from(self.size[1]) / wide).round().max(1.0);
            let smaller = self.averaged([width as u32, height as u32]);
            for quality in QUALITIES {
                let jpeg = smaller.jpeg(quality)?;
                if jpeg.len() <= most {
                    let pixels = image::load_from_memory_with_format(&jpeg, ImageFormat::Jpeg)
                        .map_err(unusable)?
                        .into_rgb8()
                        .into_raw();
                    return Ok(Raster {
                        bounds,
                        size: smaller.size,
                        pixels: pixels.into(),
                        jpeg: jpeg.into(),
                    });
                }
            }
            width = (0.85 * width).round();
        }
        Err(Error::invalid(format!("no picture of this shape takes only {most} bytes"))
            .at_key("picture_kb")
            .remedy("allow more"))
    }

    fn jpeg(&self, quality: u8) -> Result<Vec<u8>> {
        let mut jpeg = Vec::new();
        let [width, height] = self.size;
        JpegEncoder::new_with_quality(&mut jpeg, quality)
            .encode(&self.pixels, width, height, ExtendedColorType::Rgb8)
            .map_err(unusable)?;
        Ok(jpeg)
    }

    /// With fewer pixels, each the mean light of those that it covers.
    fn averaged(&self, size: [u32; 2]) -> Self {
        if size == self.size {
            return Self { size, pixels: self.pixels.clone() };
        }
        let light: Vec<f64> = (0..=255_u8).map(linear).collect();
        let spans = |axis: usize| {
            let step = f64::from(self.size[axis]) / f64::from(size[axis]);
            (0..size[axis]).map(move |i| [f64::from(i) * step, f64::from(i + 1) * step])
        };
        let mut pixels = Vec::with_capacity(3 * size[0] as usize * size[1] as usize);
        for [top, bottom] in spans(1) {
            for [left, right] in spans(0) {
                let (mut sum, mut whole) = ([0.0; 3], 0.0);
                for (y, high) in covered(top, bottom, self.size[1]) {
                    for (x, wide) in covered(left, right, self.size[0]) {
                        let at = 3 * (y * self.size[0] as usize + x);
                        for (sum, &value) in sum.iter_mut().zip(self.pixels.iter().skip(at)) {
                            *sum += wide * high * light.get(usize::from(value)).copied().unwrap_or(0.0);
                        }
                        whole += wide * high;
                    }
                }
                pixels.extend(sum.map(|x| coded(x / whole)));
            }
        }
        Self { size, pixels }
    }
}

fn unusable(why: image::ImageError) -> Error {
    Error::invalid(format!("the picture cannot be set: {why}")).at_key("picture")
}

/// The pixels that a span covers, and how much of each.
fn covered(from: f64, to: f64, count: u32) -> impl Iterator<Item = (usize, f64)> {
    let (first, last) = (from.floor() as usize, (to.ceil() as usize).min(count as usize));
    (first..last).map(move |i| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)).max(0.0)))
}

fn linear(value: u8) -> f64 {
    srgb::decode(f64::from(value) / 255.0)
}

fn coded(light: f64) -> u8 {
    (255.0 * srgb::encode(light)).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_pixels_keep_the_light() {
        let checks = Picture { size: [4, 2], pixels: [[0, 0, 0], [255, 255, 255]].repeat(4).concat() };
        assert_eq!(checks.averaged([2, 1]).pixels, [188; 6]);
        // Pixels that do not divide evenly: black, a third of white, white.
        let pixels = [[0; 3], [255; 3], [255; 3]].concat();
        let halves = Picture { size: [3, 1], pixels }.averaged([2, 1]);
        assert_eq!(halves.pixels, [coded(1.0 / 3.0), coded(1.0 / 3.0), coded(1.0 / 3.0), 255, 255, 255]);
        for value in 0..=255 {
            assert_eq!(coded(linear(value)), value);
        }
    }

    #[test]
    fn a_picture_takes_no_more_than_it_may() {
        let pixels = (0..300 * 200 * 3).map(|i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let noise = Picture { size: [300, 200], pixels };
        for most in [1_000, 8_000, 60_000] {
            let raster = noise.set([0.0, 0.0, 30.0, 20.0], most).unwrap();
            assert!(raster.jpeg.len() <= most && raster.jpeg.len() > most / 4, "{}", raster.jpeg.len());
            assert_eq!(raster.pixels.len(), 3 * raster.size[0] as usize * raster.size[1] as usize);
        }
        assert!(noise.set([0.0, 0.0, 30.0, 20.0], 10).is_err());
    }
}
