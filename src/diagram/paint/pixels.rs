//! In: a display list and pixels per millimetre. Out: pixels, or a PNG.

use crate::diagram::display_list::{
    Color, DisplayList, Face, Fill, Geometry, Item, Point, Raster, Segment, Shape, Stroke, Text,
};
use crate::diagram::lettering;
use crate::error::{Error, ErrorKind, Result};
use crate::quantity::short;
use std::collections::BTreeMap;
use tiny_skia as skia;

/// Most pixels of a drawn page: 256 million bytes.
const MOST_PIXELS: f64 = 64e6;

/// Paints the list at `scale` pixels per millimetre; straight (not premultiplied) RGBA, 8 bits.
pub(crate) fn paint(list: &DisplayList, scale: f64) -> Result<(u32, u32, Vec<u8>)> {
    let size = [list.page[0] * scale, list.page[1] * scale].map(f64::round);
    let fits = size.iter().all(|&s| s >= 1.0) && size[0] * size[1] <= MOST_PIXELS;
    if !fits {
        let is_large = size.iter().all(|&side| side >= 1.0);
        return Err(Error::new(
            if is_large { ErrorKind::TooLarge } else { ErrorKind::Invalid },
            format!("a page of {} by {} pixels cannot be painted", short(size[0]), short(size[1])),
        )
        .remedy("choose a resolution that gives 1 to 64 million pixels"));
    }
    let (width, height) = (size[0] as u32, size[1] as u32);
    let pixmap = skia::Pixmap::new(width, height);
    let mut pixmap = pixmap.ok_or_else(|| Error::new(ErrorKind::TooLarge, "no memory for the page"))?;
    if let Some(color) = list.background {
        pixmap.fill(skia_color(color, 1.0));
    }
    let mut painter = Painter {
        pixmap,
        transform: skia::Transform::from_scale(scale as f32, scale as f32),
        glyphs: BTreeMap::new(),
    };
    painter.items(&list.items)?;
    Ok((width, height, painter.pixmap.take_demultiplied()))
}

/// The painted list as a PNG with its resolution.
pub(crate) fn png(list: &DisplayList, scale: f64) -> Result<Vec<u8>> {
    let (width, height, pixels) = paint(list, scale)?;
    let mut bytes = Vec::new();
    let wrong = |why: png::EncodingError| Error::invalid(format!("the PNG cannot be encoded: {why}"));
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    // As for pictures: flate2's bytes depend on the back end that another package of the build asks for.
    encoder.set_compression(png::Compression::Fast);
    let per_metre = (scale * 1000.0).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: per_metre,
        yppu: per_metre,
        unit: png::Unit::Meter,
    }));
    let mut writer = encoder.write_header().map_err(wrong)?;
    writer.write_image_data(&pixels).map_err(wrong)?;
    writer.finish().map_err(wrong)?;
    Ok(bytes)
}

struct Painter {
    pixmap: skia::Pixmap,
    transform: skia::Transform,
    /// Outlines by letter, size and direction.
    glyphs: BTreeMap<(Face, char, u64, [u64; 2]), Vec<Segment>>,
}

impl Painter {
    fn items(&mut self, items: &[Item]) -> Result<()> {
        for item in items {
            match item {
                Item::Group(group) => self.items(&group.items)?,
                Item::Shape(shape) => self.shape(shape),
                Item::Text(text) => self.text(text)?,
                Item::Raster(raster) => self.raster(raster),
            }
        }
        Ok(())
    }

    fn shape(&mut self, shape: &Shape) {
        let path = match &shape.geometry {
            Geometry::Line(a, b) => outline(&[Segment::Move(*a), Segment::Line(*b)], [0.0; 2]),
            Geometry::Path(segments) => outline(segments, [0.0; 2]),
            Geometry::Circle { center, radius } => {
                skia::PathBuilder::from_circle(center[0] as f32, center[1] as f32, *radius as f32)
            }
        };
        // An outline without extent paints nothing.
        let Some(path) = path else { return };
        if let Some(fill) = &shape.fill {
            self.pixmap.fill_path(&path, &fill_paint(fill), skia::FillRule::Winding, self.transform, None);
        }
        if let Some(stroke) = &shape.stroke {
            let paint = flat(stroke.color, stroke.opacity);
            self.pixmap.stroke_path(&path, &paint, &skia_stroke(stroke), self.transform, None);
        }
    }

    fn raster(&mut self, raster: &Raster) {
        let rgba: Vec<u8> = raster.pixels.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 255]).collect();
        let size = skia::IntSize::from_wh(raster.size[0], raster.size[1]);
        let Some(picture) = size.and_then(|size| skia::Pixmap::from_vec(rgba, size)) else { return };
        let [left, top, right, bottom] = raster.bounds;
        let scale = [(right - left) / f64::from(raster.size[0]), (bottom - top) / f64::from(raster.size[1])];
        let place =
            skia::Transform::from_row(scale[0] as f32, 0.0, 0.0, scale[1] as f32, left as f32, top as f32);
        let paint =
            skia::PixmapPaint { quality: skia::FilterQuality::Bilinear, ..skia::PixmapPaint::default() };
        self.pixmap.draw_pixmap(0, 0, picture.as_ref(), &paint, place.post_concat(self.transform), None);
    }

    fn text(&mut self, text: &Text) -> Result<()> {
        let paint = flat(text.color, 1.0);
        for glyph in lettering::place(text)? {
            let key = (glyph.face, glyph.character, glyph.size.to_bits(), text.along.map(f64::to_bits));
            if let std::collections::btree_map::Entry::Vacant(slot) = self.glyphs.entry(key) {
                slot.insert(lettering::outline(glyph.face, glyph.character, glyph.size, text.along)?);
            }
            if let Some(path) = self.glyphs.get(&key).and_then(|segments| outline(segments, glyph.at)) {
                self.pixmap.fill_path(&path, &paint, skia::FillRule::Winding, self.transform, None);
            }
        }
        Ok(())
    }
}

fn outline(segments: &[Segment], offset: Point) -> Option<skia::Path> {
    let mut path = skia::PathBuilder::new();
    let f = |p: Point| ((p[0] + offset[0]) as f32, (p[1] + offset[1]) as f32);
    for segment in segments {
        match *segment {
            Segment::Move(p) => path.move_to(f(p).0, f(p).1),
            Segment::Line(p) => path.line_to(f(p).0, f(p).1),
            Segment::Quad(c, p) => path.quad_to(f(c).0, f(c).1, f(p).0, f(p).1),
            Segment::Cubic(c, d, p) => path.cubic_to(f(c).0, f(c).1, f(d).0, f(d).1, f(p).0, f(p).1),
            Segment::Close => path.close(),
        }
    }
    path.finish()
}

fn skia_color(c: Color, opacity: f64) -> skia::Color {
    let alpha = (opacity.clamp(0.0, 1.0) * 255.0).round() as u8;
    skia::Color::from_rgba8(c.r, c.g, c.b, alpha)
}

fn flat(color: Color, opacity: f64) -> skia::Paint<'static> {
    skia::Paint { shader: skia::Shader::SolidColor(skia_color(color, opacity)), ..skia::Paint::default() }
}

fn fill_paint(fill: &Fill) -> skia::Paint<'static> {
    match *fill {
        Fill::Flat { color, opacity } => flat(color, opacity),
        Fill::Fade { color, from, to, from_opacity, to_opacity } => {
            let point = |p: Point| skia::Point::from_xy(p[0] as f32, p[1] as f32);
            let stops = vec![
                skia::GradientStop::new(0.0, skia_color(color, from_opacity)),
                skia::GradientStop::new(1.0, skia_color(color, to_opacity)),
            ];
            let gradient = skia::LinearGradient::new(
                point(from),
                point(to),
                stops,
                skia::SpreadMode::Pad,
                skia::Transform::identity(),
            );
            match gradient {
                Some(shader) => skia::Paint { shader, ..skia::Paint::default() },
                None => flat(color, to_opacity),
            }
        }
    }
}

fn skia_stroke(stroke: &Stroke) -> skia::Stroke {
    let dash = stroke.dash.iter().map(|&x| x as f32).collect();
    skia::Stroke {
        width: stroke.width as f32,
        miter_limit: 4.0,
        line_cap: skia::LineCap::Butt,
        line_join: if stroke.round { skia::LineJoin::Round } else { skia::LineJoin::Miter },
        dash: skia::StrokeDash::new(dash, 0.0),
    }
}
