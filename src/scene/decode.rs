//! Decoding: a picture file's bytes in, a [`Texture`] out.
//!
//! Texels are stored as the file has them (orientation tags are not followed: texture coordinates go by the stored rows), red, green
//! and blue decoded from sRGB to linear light.

use std::cell::Cell;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::OnceLock;

use image::error::LimitErrorKind;
use image::{DynamicImage, ImageBuffer, ImageDecoder, ImageFormat, ImageReader, Limits};
use memchr::memmem;
use rayon::prelude::*;

use super::texture::{Level, Texture};
use crate::srgb;

/// Most texels on a side.
const SIDE_LIMIT: u32 = 16384;

/// Most texels in all: 8192 x 8192, whose levels take 683 MiB, 768 with holes.
const TEXEL_LIMIT: u64 = 1 << 26;
/// Both, in words.
const LARGEST: &str = "16384 texels on a side, and as many as 8192 x 8192 in all";

/// Most memory that decoding may take, in bytes: what [`TEXEL_LIMIT`] texels of 8-bit RGBA take.
const DECODED_LIMIT: u64 = 256 << 20;

/// What a file is decoded for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Use {
    /// `map_Kd`: colour and alpha.
    Diffuse,
    /// `map_d`: alpha if it has one, else its first channel, undecoded.
    Opacity,
}

/// What decoding takes, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cost {
    /// While it is decoded, the file's own bytes included.
    pub(crate) working: u64,
    /// What stays: the texture.
    pub(crate) kept: u64,
}

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is inside a picture decoder. Its panics are caught and become errors: a panic hook that prints
/// can ask here and be silent.
pub fn is_decoding() -> bool {
    DECODING.get()
}

/// Decoders are others' code and get hostile bytes: a fault of theirs must not end the program.
fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    DECODING.set(true);
    let done = catch_unwind(AssertUnwindSafe(decode));
    DECODING.set(false);
    done.unwrap_or_else(|_| Err("its decoder failed".to_owned()))
}

/// What decoding the picture file will take, as its head tells.
///
/// # Errors
/// As for [`decode`].
pub(crate) fn cost(bytes: &[u8], name: &Path) -> Result<Cost, String> {
    guarded(|| {
        let decoder = reader(bytes, name)?.into_decoder().map_err(|e| clause(&e))?;
        let (width, height) = decoder.dimensions();
        if width.max(height) > SIDE_LIMIT || u64::from(width) * u64::from(height) > TEXEL_LIMIT {
            return Err(format!("its {width} x {height} texels are more than allowed: {LARGEST}"));
        }
        let texels = u64::from(width) * u64::from(height);
        // Texels as decoded, and once more for what decoders hold besides.
        let decoded = decoder.total_bytes();
        let file = bytes.len() as u64;
        Ok(Cost { working: 2 * file + 2 * decoded, kept: texels * 9 * 4 / 3 + 9 })
    })
}

/// Decodes a picture file whose [`cost`] was asked for; `name` helps where the content does not tell the format (TGA has
/// no mark).
///
/// # Errors
/// A clause that says what is wrong with it.
pub(crate) fn decode(bytes: &[u8], name: &Path, what_for: Use) -> Result<Texture, String> {
    let picture = guarded(|| {
        let reader = reader(bytes, name)?;
        let format = reader.format();
        if format == Some(ImageFormat::Jpeg) && !jpeg_has_end(bytes) {
            return Err("it is cut off: its end is missing".to_owned());
        }
        let picture = reader.decode().map_err(|e| clause(&e))?;
        Ok(if has_alpha(&picture, format, bytes) { picture } else { picture.into_rgb8().into() })
    })?;
    let (width, height) = (picture.width(), picture.height());
    let texels = match what_for {
        Use::Diffuse => colours(picture),
        Use::Opacity => opacities(picture),
    };
    let texels = texels.ok_or("there is not enough memory for it")?;
    Texture::from_level(Level { width, height, texels }).ok_or_else(|| "it is empty".to_owned())
}

fn reader<'b>(bytes: &'b [u8], name: &Path) -> Result<ImageReader<Cursor<&'b [u8]>>, String> {
    let said = name.extension().and_then(ImageFormat::from_extension);
    let seen = image::guess_format(bytes).ok();
    let format = seen.filter(ImageFormat::reading_enabled).or(said).or(seen);
    let format = format.ok_or_else(|| format!("it is no picture of a known format, as {FORMATS} are"))?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(SIDE_LIMIT);
    limits.max_image_height = Some(SIDE_LIMIT);
    limits.max_alloc = Some(DECODED_LIMIT);
    reader.limits(limits);
    Ok(reader)
}

/// Whether a JPEG goes on to its end: its decoder makes grey of what is missing.
fn jpeg_has_end(bytes: &[u8]) -> bool {
    // Neither mark is ever part of a scan's data; a thumbnail, with both, stands before the first scan.
    let last = |mark: [u8; 2]| memmem::rfind(bytes, &mark);
    last([0xff, 0xd9]) > last([0xff, 0xda])
}

/// Whether the alpha of a decoded picture is its file's. Decoders make one up where a Targa of four bytes says that none of them is
/// opacity (files that say so, and hold one, are taken at what they hold), and where a GIF has no transparent colour.
fn has_alpha(picture: &DynamicImage, format: Option<ImageFormat>, bytes: &[u8]) -> bool {
    let DynamicImage::ImageRgba8(texels) = picture else { return true };
    let is_all = |alpha: u8| texels.as_raw().chunks_exact(4).all(|texel| texel[3] == alpha);
    match format {
        Some(ImageFormat::Tga) => bytes.get(17).is_none_or(|descriptor| descriptor & 15 != 0) || !is_all(0),
        Some(ImageFormat::Gif) => !is_all(u8::MAX),
        _ => true,
    }
}

/// What pictures can be read.
const FORMATS: &str = "PNG, JPEG, BMP, TGA, GIF and WebP";

/// What is wrong with a picture as one line, with what its decoder says of it in short.
fn clause(error: &image::ImageError) -> String {
    let text = error.to_string();
    let said = text.strip_prefix("Format error decoding ").and_then(|rest| rest.split_once(": "));
    let said = said.map_or(&*text, |(_, said)| said);
    let said = said.split([':', '{', '(', '\n']).next().unwrap_or_default();
    let words: Vec<String> = said.split_whitespace().map(super::normalize::shown).collect();
    let said: String = words.join(" ").chars().take(100).collect();
    match error {
        image::ImageError::IoError(_) => "it ends early".to_owned(),
        image::ImageError::Limits(limit) if limit.kind() == LimitErrorKind::InsufficientMemory => {
            let most = DECODED_LIMIT >> 20;
            format!(
                "it takes more than {most} MiB to decode: make it smaller, or save it with 8 bits a channel"
            )
        }
        image::ImageError::Limits(_) => format!("it is larger than allowed: {LARGEST}"),
        image::ImageError::Unsupported(_) => {
            format!("it is no picture that can be read, as {FORMATS} are ({said})")
        }
        _ => format!("it is damaged, or another kind of file than it says ({said})"),
    }
}

/// So many texels are converted in one go.
const SLAB: usize = 4096;

/// Converts a decoded picture texel by texel; none when memory runs out.
fn each<T: Sync>(
    samples: &[T],
    per_texel: usize,
    f: impl Fn(&[T]) -> [u16; 4] + Send + Sync,
) -> Option<Vec<[u16; 4]>> {
    let mut texels: Vec<[u16; 4]> = Vec::new();
    texels.try_reserve_exact(samples.len() / per_texel).ok()?;
    texels.resize(samples.len() / per_texel, [0; 4]);
    // A loop of its own for some thousand: whether the compiler makes one of a parallel iterator depends on what else changed.
    texels.par_chunks_mut(SLAB).zip(samples.par_chunks(SLAB * per_texel)).for_each(|(texels, samples)| {
        for (texel, sample) in texels.iter_mut().zip(samples.chunks_exact(per_texel)) {
            *texel = f(sample);
        }
    });
    Some(texels)
}

impl Texture {
    /// From 8-bit sRGB and opacity, four bytes a texel, row by row from the top left, as canvases have them; none when there are not as many
    /// bytes, no texel, or not enough memory.
    pub fn from_srgb8(width: u32, height: u32, rgba: &[u8]) -> Option<Self> {
        if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) {
            return None;
        }
        let picture = ImageBuffer::from_raw(width, height, rgba.to_vec()).map(DynamicImage::ImageRgba8)?;
        let texels = colours(picture)?;
        Self::from_level(Level { width, height, texels })
    }
}

fn colours(picture: DynamicImage) -> Option<Vec<[u16; 4]>> {
    let eight = linear_from_8();
    let l8 = |v: u8| eight[usize::from(v)];
    let a8 = |v: u8| u16::from(v) * 257;
    let l16 = |v: u16| linear_from_16().get(usize::from(v)).copied().unwrap_or(v);
    match picture {
        DynamicImage::ImageLuma8(p) => each(p.as_raw(), 1, |s| [l8(s[0]), l8(s[0]), l8(s[0]), u16::MAX]),
        DynamicImage::ImageLumaA8(p) => each(p.as_raw(), 2, |s| [l8(s[0]), l8(s[0]), l8(s[0]), a8(s[1])]),
        DynamicImage::ImageRgb8(p) => each(p.as_raw(), 3, |s| [l8(s[0]), l8(s[1]), l8(s[2]), u16::MAX]),
        DynamicImage::ImageRgba8(p) => each(p.as_raw(), 4, |s| [l8(s[0]), l8(s[1]), l8(s[2]), a8(s[3])]),
        DynamicImage::ImageLuma16(p) => each(p.as_raw(), 1, |s| [l16(s[0]), l16(s[0]), l16(s[0]), u16::MAX]),
        DynamicImage::ImageLumaA16(p) => each(p.as_raw(), 2, |s| [l16(s[0]), l16(s[0]), l16(s[0]), s[1]]),
        DynamicImage::ImageRgb16(p) => each(p.as_raw(), 3, |s| [l16(s[0]), l16(s[1]), l16(s[2]), u16::MAX]),
        other => each(other.into_rgba16().as_raw(), 4, |s| [l16(s[0]), l16(s[1]), l16(s[2]), s[3]]),
    }
}

fn opacities(picture: DynamicImage) -> Option<Vec<[u16; 4]>> {
    let opacity = |v: u16| [u16::MAX, u16::MAX, u16::MAX, v];
    let o8 = |v: u8| opacity(u16::from(v) * 257);
    match picture {
        DynamicImage::ImageLuma8(p) => each(p.as_raw(), 1, |s| o8(s[0])),
        DynamicImage::ImageLumaA8(p) => each(p.as_raw(), 2, |s| o8(s[1])),
        DynamicImage::ImageRgb8(p) => each(p.as_raw(), 3, |s| o8(s[0])),
        DynamicImage::ImageRgba8(p) => each(p.as_raw(), 4, |s| o8(s[3])),
        DynamicImage::ImageLuma16(p) => each(p.as_raw(), 1, |s| opacity(s[0])),
        DynamicImage::ImageLumaA16(p) => each(p.as_raw(), 2, |s| opacity(s[1])),
        DynamicImage::ImageRgb16(p) => each(p.as_raw(), 3, |s| opacity(s[0])),
        other => each(other.into_rgba16().as_raw(), 4, |s| opacity(s[3])),
    }
}

fn table(entries: u32) -> Vec<u16> {
    let top = f64::from(entries - 1);
    (0..entries).map(|v| libm::round(srgb::decode(f64::from(v) / top) * 65535.0) as u16).collect()
}

fn linear_from_8() -> &'static [u16; 256] {
    static TABLE: OnceLock<[u16; 256]> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut fixed = [0; 256];
        fixed.copy_from_slice(&table(256));
        fixed
    })
}

fn linear_from_16() -> &'static [u16] {
    static TABLE: OnceLock<Vec<u16>> = OnceLock::new();
    TABLE.get_or_init(|| table(1 << 16))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use image::{Luma, LumaA, Rgb, Rgba};

    fn png(picture: impl Into<DynamicImage>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.into().write_to(&mut bytes, ImageFormat::Png).expect("a PNG");
        bytes.into_inner()
    }

    fn first(bytes: &[u8], what_for: Use) -> [u16; 4] {
        decode(bytes, Path::new("a.png"), what_for).expect("decodes").levels[0].texels[0]
    }

    #[test]
    fn colours_become_linear_and_opacity_does_not() {
        // sRGB 188 is 0.5029 in linear light: 32956.9 of 65535.
        let rgba = png(ImageBuffer::from_pixel(2, 3, Rgba([188u8, 0, 255, 100])));
        assert_eq!(first(&rgba, Use::Diffuse), [32957, 0, 65535, 25700]);
        assert_eq!(first(&rgba, Use::Opacity)[3], 25700);
        let rgb = png(ImageBuffer::from_pixel(1, 1, Rgb([188u8, 1, 2])));
        assert_eq!(first(&rgb, Use::Opacity)[3], 188 * 257);
        let grey = png(ImageBuffer::from_pixel(1, 1, Luma([188u16 * 257])));
        assert_eq!(first(&grey, Use::Diffuse), [32957, 32957, 32957, 65535]);
        assert_eq!(first(&grey, Use::Opacity)[3], 188 * 257);
        let both = png(ImageBuffer::from_pixel(1, 1, LumaA([188u16 * 257, 99])));
        assert_eq!(first(&both, Use::Opacity)[3], 99);
        assert_eq!(first(&both, Use::Diffuse), [32957, 32957, 32957, 99]);
        let wide = png(ImageBuffer::from_pixel(1, 1, Rgb([188u16 * 257, 0, 65535])));
        assert_eq!(first(&wide, Use::Diffuse), [32957, 0, 65535, 65535]);
        assert_eq!(first(&wide, Use::Opacity)[3], 188 * 257);
        let all = png(ImageBuffer::from_pixel(1, 1, Rgba([0, 188u16 * 257, 65535, 99])));
        assert_eq!((first(&all, Use::Diffuse), first(&all, Use::Opacity)[3]), ([0, 32957, 65535, 99], 99));
    }

    #[test]
    fn bytes_of_a_canvas_are_the_texels_of_its_png() {
        let bytes: Vec<u8> = (0..3 * 2 * 4).map(|i| (i * 37 % 256) as u8).collect();
        let picture =
            ImageBuffer::from_raw(3, 2, bytes.clone()).map(DynamicImage::ImageRgba8).expect("so many bytes");
        let file = decode(&png(picture), Path::new("a.png"), Use::Diffuse).expect("decodes");
        assert_eq!(Texture::from_srgb8(3, 2, &bytes), Some(file));
        assert!(Texture::from_srgb8(3, 3, &bytes).is_none() && Texture::from_srgb8(3, 1, &bytes).is_none());
        assert_eq!(Texture::from_srgb8(0, 0, &[]), None);
    }

    #[test]
    fn holes_are_seen_and_levels_end_in_one_texel() {
        let texture = |alpha| {
            let picture =
                png(ImageBuffer::from_fn(5, 3, |x, _| Rgba([9u8, 9, 9, if x == 4 { alpha } else { 255 }])));
            decode(&picture, Path::new("a"), Use::Diffuse).expect("decodes")
        };
        assert!(texture(127).has_holes && !texture(128).has_holes);
        // No second copy of what may take hundreds of megabytes.
        let holed = texture(127);
        let filled = holed.without_holes();
        assert!(
            !filled.has_holes && filled.outlines.is_empty() && Arc::ptr_eq(&filled.levels, &holed.levels)
        );
        let sizes: Vec<_> = texture(0).levels.iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(5, 3), (2, 1), (1, 1)]);
    }

    #[test]
    fn too_large_or_broken_is_refused() {
        for (width, height) in [(SIDE_LIMIT + 1, 1), (8193, 8192)] {
            let picture = png(ImageBuffer::<Luma<u8>, _>::new(width, height));
            assert!(cost(&picture, Path::new("a.png")).is_err(), "{width} x {height}");
        }
        let whole = png(ImageBuffer::from_pixel(9, 9, Rgb([1u8, 2, 3])));
        for end in 0..whole.len() - 20 {
            assert!(decode(&whole[..end], Path::new("a.png"), Use::Diffuse).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn a_jpeg_that_is_cut_off_is_refused() {
        let mut bytes = Cursor::new(Vec::new());
        let picture =
            DynamicImage::from(ImageBuffer::from_fn(64, 64, |x, y| Rgb([x as u8, y as u8, (x * y) as u8])));
        picture.write_to(&mut bytes, ImageFormat::Jpeg).expect("a JPEG");
        let mut whole = bytes.into_inner();
        let read = |bytes: &[u8]| decode(bytes, Path::new("a.jpg"), Use::Diffuse);
        for percent in [50, 75, 90, 99] {
            let cut = &whole[..whole.len() * percent / 100];
            assert!(read(cut).expect_err("cut").contains("cut off"), "at {percent} %");
        }
        // What follows the end does not matter.
        whole.extend([7; 30]);
        assert!(read(&whole).is_ok());
    }

    #[test]
    fn alpha_that_a_decoder_makes_up_does_not_count() {
        let written = |format, alpha: [u8; 2]| {
            let mut bytes = Cursor::new(Vec::new());
            let picture = ImageBuffer::from_fn(2, 1, |x, _| Rgba([255 * x as u8, 9, 9, alpha[x as usize]]));
            DynamicImage::from(picture).write_to(&mut bytes, format).expect("written");
            bytes.into_inner()
        };
        let opacity = |bytes: &[u8], name: &str| {
            let texture = decode(bytes, Path::new(name), Use::Opacity).expect("decodes");
            [0, 1].map(|at: usize| texture.levels[0].texels[at][3] / 257)
        };
        // A mask in a GIF that has no transparent colour, and one that has.
        assert_eq!(opacity(&written(ImageFormat::Gif, [255; 2]), "a.gif"), [0, 255]);
        assert_eq!(opacity(&written(ImageFormat::Gif, [255, 0]), "a.gif"), [255, 0]);
        // A Targa that says how many bits of opacity it has, and one that says none and holds none, or holds some.
        let targa = |alpha, bits: u8| {
            let mut bytes = written(ImageFormat::Tga, alpha);
            bytes[17] = bytes[17] & 0xf0 | bits;
            opacity(&bytes, "a.tga")
        };
        assert_eq!(targa([0, 0], 8), [0, 0]);
        assert_eq!(targa([0, 0], 0), [0, 255]);
        assert_eq!(targa([0, 90], 0), [0, 90]);
    }
}
