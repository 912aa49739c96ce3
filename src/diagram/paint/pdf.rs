//! In: a display list. Out: a PDF of one page, 1.7, tagged as one figure with its description; the same bytes everywhere.
//!
//! The page is drawn in its millimetres, y down, under one matrix. Opacities are graphics states, a fade is a soft mask.
//! Letters are outlines, or text in the embedded font that can be searched.

use super::pdf_font;
use crate::diagram::display_list::{
    Color, DisplayList, Face, Fill, Geometry, Item, Point, Raster, Segment, Shape, Stroke, Text,
};
use crate::diagram::lettering;
use crate::diagram::paint::svg::TextAs;
use crate::error::Result;
use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{LineCapStyle, LineJoinStyle, MaskType, StructRole};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str, TextStr};
use std::collections::{BTreeMap, BTreeSet};

const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// How hard streams are pressed.
const LEVEL: u8 = 9;

/// Paints the list as a PDF.
pub(crate) fn paint(list: &DisplayList, text_as: TextAs) -> Result<Vec<u8>> {
    let mut painter = Painter {
        content: Content::new(),
        text_as,
        opacities: Vec::new(),
        fades: Vec::new(),
        used: BTreeMap::new(),
        stroke: None,
        rasters: Vec::new(),
    };
    let [width, height] = list.page;
    let page_from_mm =
        [POINTS_PER_MM, 0.0, 0.0, -POINTS_PER_MM, 0.0, POINTS_PER_MM * height].map(|x| x as f32);
    painter.content.begin_marked_content_with_properties(Name(b"Figure")).properties().identify(0);
    painter.content.transform(page_from_mm);
    painter.content.set_line_cap(LineCapStyle::ButtCap).set_miter_limit(4.0);
    if let Some(color) = list.background {
        painter.fill_color(color);
        painter.content.rect(0.0, 0.0, width as f32, height as f32).fill_nonzero();
    }
    painter.items(&list.items)?;
    painter.content.end_marked_content();
    write(list, painter)
}

struct Painter {
    content: Content,
    text_as: TextAs,
    /// Opacities of fill and stroke, in thousandths, each a graphics state.
    opacities: Vec<(u16, u16)>,
    fades: Vec<Fill>,
    /// Characters set as text.
    used: BTreeMap<Face, BTreeSet<char>>,
    /// The stroke that is set, so that it is not set again.
    stroke: Option<Stroke>,
    rasters: Vec<Raster>,
}

fn thousandths(opacity: f64) -> u16 {
    (opacity.clamp(0.0, 1.0) * 1000.0).round() as u16
}

/// Page coordinates are rounded like those of the SVG.
fn mm(x: f64) -> f32 {
    ((x * 1000.0).round() / 1000.0) as f32
}

fn unit(c: u8) -> f32 {
    ((f64::from(c) / 255.0 * 10_000.0).round() / 10_000.0) as f32
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

    fn fill_color(&mut self, c: Color) {
        self.content.set_fill_rgb(unit(c.r), unit(c.g), unit(c.b));
    }

    /// Sets opacities; the state holds until the next that is not opaque is undone.
    fn with_opacity(&mut self, fill: f64, stroke: f64, draw: impl FnOnce(&mut Self)) {
        let key = (thousandths(fill), thousandths(stroke));
        if key == (1000, 1000) {
            draw(self);
            return;
        }
        let known = self.opacities.iter().position(|o| *o == key);
        let index = known.unwrap_or(self.opacities.len());
        if known.is_none() {
            self.opacities.push(key);
        }
        self.masked(format!("O{index}"), draw);
    }

    fn masked(&mut self, state: String, draw: impl FnOnce(&mut Self)) {
        let before = self.stroke;
        self.content.save_state().set_parameters(Name(state.as_bytes()));
        draw(self);
        self.content.restore_state();
        self.stroke = before;
    }

    fn shape(&mut self, shape: &Shape) {
        match shape.fill {
            Some(Fill::Flat { color, opacity }) => self.with_opacity(opacity, 1.0, |painter| {
                painter.fill_color(color);
                painter.path(&shape.geometry);
                painter.content.fill_nonzero();
            }),
            Some(fade @ Fill::Fade { color, .. }) => {
                let known = self.fades.iter().position(|f| *f == fade);
                let index = known.unwrap_or(self.fades.len());
                if known.is_none() {
                    self.fades.push(fade);
                }
                self.masked(format!("M{index}"), |painter| {
                    painter.fill_color(color);
                    painter.path(&shape.geometry);
                    painter.content.fill_nonzero();
                });
            }
            None => {}
        }
        if let Some(stroke) = shape.stroke {
            self.with_opacity(1.0, stroke.opacity, |painter| {
                painter.set_stroke(stroke);
                painter.path(&shape.geometry);
                painter.content.stroke();
            });
        }
    }

    fn set_stroke(&mut self, stroke: Stroke) {
        if self.stroke == Some(stroke) {
            return;
        }
        let Color { r, g, b } = stroke.color;
        self.content.set_stroke_rgb(unit(r), unit(g), unit(b));
        self.content.set_line_width(mm(stroke.width));
        self.content.set_dash_pattern(stroke.dash.iter().map(|&x| mm(x)), 0.0);
        let join = if stroke.round { LineJoinStyle::RoundJoin } else { LineJoinStyle::MiterJoin };
        self.content.set_line_join(join);
        self.stroke = Some(stroke);
    }

    fn path(&mut self, geometry: &Geometry) {
        match geometry {
            Geometry::Line(a, b) => {
                self.content.move_to(mm(a[0]), mm(a[1])).line_to(mm(b[0]), mm(b[1]));
            }
            Geometry::Path(segments) => self.segments(segments, [0.0; 2]),
            Geometry::Circle { center: [x, y], radius: r } => {
                // Four cubic curves; off a circle by 0.03 per cent of the radius.
                let k = 0.552_284_749_8 * r;
                let quarters = [
                    [1.0, 0.0, 0.0, 1.0],
                    [0.0, 1.0, -1.0, 0.0],
                    [-1.0, 0.0, 0.0, -1.0],
                    [0.0, -1.0, 1.0, 0.0],
                ];
                self.content.move_to(mm(x + r), mm(*y));
                for [c, s, d, t] in quarters {
                    let (from, to) = ([x + r * c, y + r * s], [x + r * d, y + r * t]);
                    self.content.cubic_to(
                        mm(from[0] + k * d),
                        mm(from[1] + k * t),
                        mm(to[0] + k * c),
                        mm(to[1] + k * s),
                        mm(to[0]),
                        mm(to[1]),
                    );
                }
                self.content.close_path();
            }
        }
    }

    fn segments(&mut self, segments: &[Segment], [dx, dy]: Point) {
        let at = |p: Point| (mm(p[0] + dx), mm(p[1] + dy));
        let mut last = [0.0; 2];
        for segment in segments {
            match *segment {
                Segment::Move(p) => {
                    self.content.move_to(at(p).0, at(p).1);
                    last = p;
                }
                Segment::Line(p) => {
                    self.content.line_to(at(p).0, at(p).1);
                    last = p;
                }
                Segment::Quad(c, p) => {
                    let third = |a: Point, k: usize| (2.0 * c[k] + a[k]) / 3.0;
                    let (a, b) = ([third(last, 0), third(last, 1)], [third(p, 0), third(p, 1)]);
                    self.content.cubic_to(at(a).0, at(a).1, at(b).0, at(b).1, at(p).0, at(p).1);
                    last = p;
                }
                Segment::Cubic(a, b, p) => {
                    self.content.cubic_to(at(a).0, at(a).1, at(b).0, at(b).1, at(p).0, at(p).1);
                    last = p;
                }
                Segment::Close => {
                    self.content.close_path();
                }
            }
        }
    }

    fn raster(&mut self, raster: &Raster) {
        let [left, top, right, bottom] = raster.bounds;
        let name = format!("P{}", self.rasters.len());
        self.rasters.push(raster.clone());
        // The unit square with y up, in the page's millimetres with y down.
        self.content.save_state();
        self.content.transform([mm(right - left), 0.0, 0.0, mm(top - bottom), mm(left), mm(bottom)]);
        self.content.x_object(Name(name.as_bytes())).restore_state();
    }

    fn text(&mut self, text: &Text) -> Result<()> {
        self.fill_color(text.color);
        let glyphs = lettering::place(text)?;
        if self.text_as == TextAs::Paths {
            for glyph in glyphs {
                let outline = lettering::outline(glyph.face, glyph.character, glyph.size, text.along)?;
                if !outline.is_empty() {
                    self.segments(&outline, glyph.at);
                    self.content.fill_nonzero();
                }
            }
            return Ok(());
        }
        self.content.begin_text();
        // A run at a time: its letters follow one another by their own widths.
        for run in glyphs.chunk_by(|a, b| a.run == b.run) {
            let Some(first) = run.first() else { continue };
            let used = self.used.entry(first.face).or_default();
            let mut codes = Vec::with_capacity(2 * run.len());
            for glyph in run {
                used.insert(glyph.character);
                codes.extend(lettering::glyph(glyph.face, glyph.character)?.to_be_bytes());
            }
            self.content.set_font(pdf_font::name(first.face), mm(first.size));
            let [c, s] = text.along.map(|x| x as f32);
            self.content.set_text_matrix([c, s, s, -c, mm(first.at[0]), mm(first.at[1])]);
            self.content.show(Str(&codes));
        }
        self.content.end_text();
        Ok(())
    }
}

/// The whole file.
fn write(list: &DisplayList, painter: Painter) -> Result<Vec<u8>> {
    let mut next = 0;
    let mut fresh = || {
        next += 1;
        Ref::new(next)
    };
    let (catalog, pages, page_id, content_id) = (fresh(), fresh(), fresh(), fresh());
    let (info, figure, parents) = (fresh(), fresh(), fresh());
    let opacities: Vec<(Ref, (u16, u16))> = painter.opacities.iter().map(|&o| (fresh(), o)).collect();
    let fades: Vec<([Ref; 3], Fill)> =
        painter.fades.iter().map(|&fade| (std::array::from_fn(|_| fresh()), fade)).collect();
    let rasters: Vec<(Ref, &Raster)> = painter.rasters.iter().map(|raster| (fresh(), raster)).collect();
    let fonts: Vec<(Face, pdf_font::Refs)> =
        painter.used.keys().map(|&face| (face, pdf_font::Refs(std::array::from_fn(|_| fresh())))).collect();

    let [width, height] = list.page;
    let media = Rect::new(0.0, 0.0, (POINTS_PER_MM * width) as f32, (POINTS_PER_MM * height) as f32);
    let mut pdf = Pdf::new();
    let mut root = pdf.catalog(catalog);
    root.pages(pages).lang(TextStr("en"));
    let mut tree = root.struct_tree_root();
    tree.child(figure).parent_tree().nums().insert(0, parents);
    tree.finish();
    root.mark_info().marked(true);
    root.viewer_preferences().display_doc_title(true);
    root.finish();
    pdf.document_info(info)
        .title(TextStr(&list.title))
        .subject(TextStr(&list.description))
        .creator(TextStr("groundglass"))
        .producer(TextStr("groundglass"));
    pdf.indirect(parents).array().item(figure);
    let mut element = pdf.struct_element(figure);
    element.kind(StructRole::Figure).parent(catalog).page(page_id).alt(TextStr(&list.description));
    element.title(TextStr(&list.title)).children().marked_content_id(0);
    element.attributes().push().layout().bbox(media);
    element.finish();
    pdf.pages(pages).kids([page_id]).count(1);
    let mut page = pdf.page(page_id);
    page.media_box(media).parent(pages).contents(content_id).struct_parents(0);
    page.group().transparency().color_space().device_rgb();
    let mut resources = page.resources();
    let mut states = resources.ext_g_states();
    for (i, (id, _)) in opacities.iter().enumerate() {
        states.pair(Name(format!("O{i}").as_bytes()), id);
    }
    for (i, ([id, ..], _)) in fades.iter().enumerate() {
        states.pair(Name(format!("M{i}").as_bytes()), id);
    }
    states.finish();
    let mut pictures = resources.x_objects();
    for (i, (id, _)) in rasters.iter().enumerate() {
        pictures.pair(Name(format!("P{i}").as_bytes()), id);
    }
    pictures.finish();
    let mut names = resources.fonts();
    for (face, refs) in &fonts {
        names.pair(pdf_font::name(*face), refs.font());
    }
    names.finish();
    resources.finish();
    page.finish();
    let pressed = compress_to_vec_zlib(&painter.content.finish(), LEVEL);
    pdf.stream(content_id, &pressed).filter(Filter::FlateDecode);
    for (id, raster) in rasters {
        let mut image = pdf.image_xobject(id, &raster.jpeg);
        let [width, height] = raster.size.map(|side| i32::try_from(side).unwrap_or(i32::MAX));
        image.filter(Filter::DctDecode);
        image.width(width).height(height).bits_per_component(8).interpolate(true);
        image.color_space().device_rgb();
    }
    for (id, (fill, stroke)) in opacities {
        let [fill, stroke] = [fill, stroke].map(|o| f32::from(o) / 1000.0);
        pdf.ext_graphics(id).non_stroking_alpha(fill).stroking_alpha(stroke);
    }
    for (refs, fade) in fades {
        mask(&mut pdf, refs, &fade, list.page);
    }
    for (face, refs) in &fonts {
        if let Some(used) = painter.used.get(face) {
            pdf_font::embed(&mut pdf, *face, refs, used)?;
        }
    }
    Ok(pdf.finish())
}

/// A soft mask whose brightness is the fade's opacity. It is set under the page's matrix, so it is in millimetres.
fn mask(pdf: &mut Pdf, [state, group, function]: [Ref; 3], fade: &Fill, [width, height]: [f64; 2]) {
    let Fill::Fade { from, to, from_opacity, to_opacity, .. } = *fade else { return };
    let mut content = Content::new();
    content.shading(Name(b"S"));
    let content = content.finish();
    let mut form = pdf.form_xobject(group, &content);
    form.bbox(Rect::new(0.0, 0.0, width as f32, height as f32));
    form.group().transparency().isolated(true).color_space().device_gray();
    let mut resources = form.resources();
    let mut shadings = resources.shadings();
    let mut shading = shadings.insert(Name(b"S")).start::<pdf_writer::writers::FunctionShading>();
    shading.shading_type(pdf_writer::types::FunctionShadingType::Axial);
    shading.color_space().device_gray();
    shading.coords([from[0], from[1], to[0], to[1]].map(mm)).extend([true, true]);
    shading.function(function);
    shading.finish();
    shadings.finish();
    resources.finish();
    form.finish();
    pdf.exponential_function(function).domain([0.0, 1.0]).c0([mm(from_opacity)]).c1([mm(to_opacity)]).n(1.0);
    pdf.ext_graphics(state).soft_mask().subtype(MaskType::Luminosity).group(group);
}
