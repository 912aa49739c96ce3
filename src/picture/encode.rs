//! From an exposure to a file: PNG (8-bit sRGB) and OpenEXR (32-bit float, linear).
//!
//! Nothing that depends on clock, threads or machine goes in.

use super::Exposure;
use crate::error::{Error, ErrorKind, Result};
use crate::srgb;
use exr::prelude::{
    Blocks, Compression, Encoding, Image, Layer, LayerAttributes, LineOrder, SpecificChannels, Text, Vec2,
    WritableImage,
};
use std::io::{Seek, Write};

/// Notes that travel in a picture file, in this order: keyword and text. (Those of `docs/formats.md` are the program's.)
pub type Notes<'a> = &'a [(&'a str, String)];

/// How PNGs are packed: `fdeflate`, never `flate2`, whose packed bytes depend on the back end that any other
/// package of the build asks for. A tenth to a quarter larger.
const PNG_COMPRESSION: png::Compression = png::Compression::Fast;

/// Linear values at which the 8-bit sRGB code goes up by one: `sRGB^-1((i + 0.5) / 255)`.
///
/// A table and a search give the rounded code itself, the same on every platform, at a tenth of a power's cost.
fn srgb_steps() -> [f32; 255] {
    std::array::from_fn(|i| srgb::decode((i as f64 + 0.5) / 255.0) as f32)
}

impl Exposure {
    /// The row `y` as 8-bit sRGB after `exposure_ev` stops: `sRGB(clamp(color * 2^ev, 0, 1))`.
    fn srgb_row(&self, y: u32, gain: f32, steps: &[f32; 255], out: &mut Vec<u8>) {
        out.clear();
        for x in 0..self.width() {
            let codes = self.pixel(x, y).map(|c| steps.partition_point(|&step| step <= c * gain) as u8);
            out.extend_from_slice(&codes);
        }
    }

    /// The whole picture as 8-bit sRGB, row by row from the top, three bytes a pixel. What is NaN is black.
    pub fn to_srgb8(&self, exposure_ev: f64) -> Vec<u8> {
        let (gain, steps) = (libm::exp2(exposure_ev) as f32, srgb_steps());
        let mut picture = Vec::with_capacity(self.width() as usize * self.height() as usize * 3);
        let mut row = Vec::new();
        for y in 0..self.height() {
            self.srgb_row(y, gain, &steps, &mut row);
            picture.extend_from_slice(&row);
        }
        picture
    }

    /// Writes a PNG; keywords have 1 to 79 characters of Latin-1, and neither they nor texts have a NUL.
    ///
    /// # Errors
    /// [`ErrorKind::Invalid`] for other notes, and an exposure that is NaN; [`ErrorKind::Io`] when `out` fails.
    pub fn write_png(&self, exposure_ev: f64, notes: Notes<'_>, out: impl Write) -> Result<()> {
        if exposure_ev.is_nan() {
            return Err(Error::invalid("no such exposure").remedy("give a number of stops"));
        }
        for (keyword, text) in notes {
            let is_latin = keyword.chars().all(|c| u32::from(c) < 256 && c != '\0');
            if !is_latin || !(1..80).contains(&keyword.chars().count()) || text.contains('\0') {
                let keyword = keyword.escape_debug();
                return Err(Error::invalid(format!("the note `{keyword}` cannot stand in a PNG"))
                    .remedy("give a keyword of 1 to 79 characters of Latin-1, and no NUL"));
            }
        }
        let failed = |error: png::EncodingError| cannot_write("PNG", &error);
        let mut encoder = png::Encoder::new(out, self.width(), self.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(PNG_COMPRESSION);
        for (keyword, text) in notes {
            encoder.add_itxt_chunk((*keyword).to_owned(), text.clone()).map_err(failed)?;
        }
        let mut writer = encoder.write_header().map_err(failed)?;
        let mut stream = writer.stream_writer().map_err(failed)?;
        let (gain, steps) = (libm::exp2(exposure_ev) as f32, srgb_steps());
        let mut row = Vec::new();
        for y in 0..self.height() {
            self.srgb_row(y, gain, &steps, &mut row);
            stream.write_all(&row).map_err(|error| cannot_write("PNG", &error))?;
        }
        stream.finish().map_err(failed)
    }

    /// Writes an OpenEXR picture: scan lines, ZIP, channels R G B in 32-bit float, linear, no exposure applied; notes in UTF-8.
    ///
    /// # Errors
    /// [`ErrorKind::Io`] when `out` fails.
    pub fn write_exr(&self, notes: Notes<'_>, out: impl Write + Seek) -> Result<()> {
        let channels = SpecificChannels::rgb(|position: Vec2<usize>| {
            let [r, g, b] = self.pixel(position.x() as u32, position.y() as u32);
            (r, g, b)
        });
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        // One standard attribute: attributes of other names are written in an order that differs by run.
        let comments: Vec<_> = notes.iter().map(|(keyword, text)| format!("{keyword}: {text}")).collect();
        // The crate's own conversion has no letters beyond Latin-1.
        let comments = Some(Text::from_slice_unchecked(comments.join("\n").as_bytes()));
        let comments = comments.filter(|_| !notes.is_empty());
        let attributes = LayerAttributes { comments, ..LayerAttributes::default() };
        let size = (self.width() as usize, self.height() as usize);
        Image::from_layer(Layer::new(size, attributes, encoding, channels))
            .write()
            .non_parallel()
            .to_buffered(out)
            .map_err(|error| cannot_write("EXR", &error))
    }
}

fn cannot_write(format: &str, error: &dyn std::fmt::Display) -> Error {
    Error::new(ErrorKind::Io, format!("cannot write the {format} picture: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn gradient() -> Exposure {
        let pixels = (0..4096).map(|i| [i as f32 / 1023.0, 0.5, -0.25]).collect();
        Exposure::new((40, 33), pixels, Vec::new(), None, super::super::Allocation::Uniform(1))
    }

    #[test]
    fn srgb_codes_are_rounded_to_the_nearest() {
        let steps = srgb_steps();
        for value in [0.0, 0.001, 0.0031308, 0.02, 0.18, 0.5, 0.9, 1.0] {
            let code = steps.partition_point(|&step| step <= value as f32);
            assert_eq!(code, (srgb::encode(value) * 255.0).round() as usize);
        }
        assert_eq!(steps.partition_point(|&step| step <= 7.0), 255);
        assert_eq!(steps.partition_point(|&step| step <= -1.0), 0);
    }

    #[test]
    fn a_png_holds_the_codes_and_the_notes() {
        let mut bytes = Vec::new();
        gradient().write_png(1.0, &[("Software", "groundglass".into())], &mut bytes).unwrap();
        let mut reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert_eq!(pixels, gradient().to_srgb8(1.0));
        assert_eq!(&pixels[..3], &[0, 255, 0]);
        assert_eq!(reader.info().utf8_text[0].get_text().unwrap(), "groundglass");
    }

    #[test]
    fn notes_of_any_language_are_kept_and_wrong_ones_are_told() {
        let mut bytes = Cursor::new(Vec::new());
        gradient().write_exr(&[("Author", "Łukasz 中".into())], &mut bytes).unwrap();
        assert!(String::from_utf8_lossy(bytes.get_ref()).contains("Author: Łukasz 中"));
        for (keyword, text) in [("", "a"), ("Author\0", "a"), ("中", "a"), ("Author", "a\0b")] {
            let error = gradient().write_png(0.0, &[(keyword, text.into())], Vec::new()).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Invalid, "{keyword}");
        }
        let long = "k".repeat(80);
        assert!(gradient().write_png(0.0, &[(&long, String::new())], Vec::new()).is_err());
        gradient().write_png(0.0, &[(&long[1..], String::new())], Vec::new()).unwrap();
    }

    #[test]
    fn an_exr_holds_the_floats_themselves() {
        use exr::prelude::{ReadChannels, ReadLayers};
        let mut bytes = Cursor::new(Vec::new());
        gradient().write_exr(&[("groundglass.samples", "64".into())], &mut bytes).unwrap();
        bytes.set_position(0);
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(bytes)
            .unwrap();
        // Channels come sorted by name: B, G, R.
        let channels = &image.layer_data.channel_data.list;
        let value =
            |channel: usize, at: usize| channels[channel].sample_data.value_by_flat_index(at).to_f32();
        for (x, y) in [(0u32, 0u32), (39, 32), (33, 1)] {
            let at = (y * 40 + x) as usize;
            assert_eq!([value(2, at), value(1, at), value(0, at)], gradient().pixel(x, y));
        }
        assert_eq!(image.layer_data.attributes.comments, Some(Text::from("groundglass.samples: 64")));
    }

    #[test]
    fn an_exr_is_the_same_bytes_each_time() {
        let notes = [("Software", "groundglass".to_owned()), ("a", "1".to_owned()), ("b", "2".to_owned())];
        let exr = || {
            let mut bytes = Cursor::new(Vec::new());
            gradient().write_exr(&notes, &mut bytes).unwrap();
            bytes.into_inner()
        };
        let first = exr();
        assert!((0..8).all(|_| exr() == first));
    }
}
