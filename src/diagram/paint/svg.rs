//! In: a display list. Out: SVG 1.1, one user unit a millimetre, no blank line, no `transform`, no style sheet but
//! the rules that turn a figure dark.
//!
//! Level letters are outlines, each defined once for its size and used wherever it stands, turned ones a path a line; or
//! `<text>` for files that shall stay searchable. Ids begin with a hash of the content, so that several figures can share a document.
//!
//! Nothing in a panel carries `transform`. Turned outlines need none; turned `<text>` does, so it follows the panel in
//! which it stands, as a `label` of its own: `textPath` and lists of places and rotations, which would do without, are drawn
//! by few readers.

use super::svg_elements::{GLUE, assign_stroke, hex, image, list_of, path_data, plain_text, with};
use super::svg_letters::{Letters, pen};
use crate::diagram::display_list::{
    Color, DisplayList, Face, Fill, Geometry, Group, Item, Recoloring, Shape, Text,
};
use crate::diagram::lettering;
use crate::diagram::words::coordinate as mm;
use crate::error::Result;
use std::collections::BTreeMap;
use svg::Node;
use svg::node::element::Element;

/// How an SVG carries its lettering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextAs {
    /// Outlines: looks the same everywhere, needs no font.
    #[default]
    Paths,
    /// `<text>`: can be searched and edited, drawn with whatever font the reader has.
    Text,
}

pub(crate) fn paint(list: &DisplayList, text_as: TextAs) -> Result<String> {
    let draft = document(list, text_as, "")?;
    let prefix = prefix(fnv(draft.as_bytes()));
    Ok(document(list, text_as, &prefix)? + "\n")
}

/// FNV-1a, folded to its low half: only to keep ids of different figures apart.
fn fnv(bytes: &[u8]) -> u64 {
    let hash = bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325_u64, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
    hash ^ (hash >> 32)
}

/// What ids of a figure begin with: a letter, and five digits to the base 36, since every letter's place repeats it.
fn prefix(hash: u64) -> String {
    let digit = |i: u32| char::from_digit((hash / 36_u64.pow(i) % 36) as u32, 36).unwrap_or('0');
    std::iter::once('g').chain((0..5).map(digit)).collect()
}

fn document(list: &DisplayList, text_as: TextAs, prefix: &str) -> Result<String> {
    let mut painter = Painter {
        text_as,
        prefix,
        recoloring: &list.recoloring,
        glyphs: BTreeMap::new(),
        definitions: Vec::new(),
        fades: Vec::new(),
        in_panel: false,
        after: Vec::new(),
    };
    let mut body = Vec::new();
    let paper = list.background.filter(|_| !matches!(list.recoloring, Recoloring::ToText { .. }));
    if let Some(color) = paper {
        body.push(with(
            "rect",
            &[
                ("width", mm(list.page[0])),
                ("height", mm(list.page[1])),
                ("fill", hex(color)),
                ("data-part", "paper".to_owned()),
            ],
        ));
    }
    painter.items(&list.items, &mut body)?;
    let mut root = with(
        "svg",
        &[
            ("xmlns", "http://www.w3.org/2000/svg".to_owned()),
            ("width", format!("{}mm", mm(list.page[0]))),
            ("height", format!("{}mm", mm(list.page[1]))),
            ("viewBox", format!("0 0 {} {}", mm(list.page[0]), mm(list.page[1]))),
            ("role", "img".to_owned()),
            ("aria-labelledby", format!("{prefix}title {prefix}desc")),
        ],
    );
    for (name, words) in [("title", &list.title), ("desc", &list.description)] {
        let mut element = with(name, &[("id", format!("{prefix}{name}"))]);
        element.append(svg::node::Text::new(words.as_str()));
        root.append(element);
    }
    if let Recoloring::Dark(pairs) = &list.recoloring {
        let id = format!("{prefix}figure");
        let mut style = Element::new("style");
        style.append(svg::node::Blob::new(dark_rules(&id, pairs)));
        root.assign("id", id);
        root.append(style);
    }
    if !painter.definitions.is_empty() {
        let mut definitions = Element::new("defs");
        for definition in painter.definitions {
            definitions.append(definition);
        }
        root.append(definitions);
    }
    for element in body {
        root.append(element);
    }
    Ok(root.to_string().replace(&format!("\n{GLUE}"), "").replace(&format!("{GLUE}\n"), ""))
}

/// Rules for dark pages: whatever of the figure has one colour gets the other.
fn dark_rules(id: &str, pairs: &[(Color, Color)]) -> String {
    let mut rules = String::from("@media (prefers-color-scheme:dark){");
    for (light, dark) in pairs {
        let (light, dark) = (hex(*light), hex(*dark));
        for property in ["fill", "stroke", "stop-color"] {
            rules.push_str(&format!("#{id} [{property}=\"{light}\"]{{{property}:{dark}}}"));
        }
    }
    rules.push('}');
    rules
}

struct Painter<'a> {
    text_as: TextAs,
    prefix: &'a str,
    recoloring: &'a Recoloring,
    glyphs: BTreeMap<(Face, char, u64), Option<String>>,
    definitions: Vec<Element>,
    fades: Vec<Fill>,
    in_panel: bool,
    /// Turned text that waits for the end of its panel.
    after: Vec<Element>,
}

impl Painter<'_> {
    fn items(&mut self, items: &[Item], into: &mut Vec<Element>) -> Result<()> {
        for item in items {
            let element = match item {
                Item::Group(group) => {
                    self.in_panel |= group.panel.is_some();
                    into.extend(self.group(group)?);
                    if group.panel.is_some() {
                        self.in_panel = false;
                        into.append(&mut self.after);
                    }
                    continue;
                }
                Item::Text(text) if self.in_panel && self.text_as == TextAs::Text && text.is_turned() => {
                    let mut label = with("g", &[("data-part", "label".to_owned())]);
                    label.append(plain_text(text, self.color(text.color)));
                    self.after.push(label);
                    continue;
                }
                Item::Shape(shape) => self.shape(shape),
                Item::Text(text) => self.text(text)?,
                Item::Raster(raster) => image(raster),
            };
            into.push(element);
        }
        Ok(())
    }

    /// A group; `None` where all that it holds waits for the end of the panel.
    fn group(&mut self, group: &Group) -> Result<Option<Element>> {
        let mut element = Element::new("g");
        if let Some(part) = group.part {
            element.assign("data-part", part);
        }
        if let Some(panel) = &group.panel {
            element.assign("data-panel", panel.name);
            element.assign("data-section", list_of(&panel.section));
            element.assign("data-page-from-section", list_of(&panel.page_from_section));
        }
        if let Some(why) = group.off_page {
            element.assign("data-off-page", why);
        }
        for (name, value) in &group.data {
            element.assign(*name, value.as_str());
        }
        let mut children = Vec::new();
        self.items(&group.items, &mut children)?;
        let all_wait = children.is_empty() && !group.items.is_empty();
        for child in children {
            element.append(child);
        }
        Ok((!all_wait).then_some(element))
    }

    fn shape(&mut self, shape: &Shape) -> Element {
        let mut element = match &shape.geometry {
            Geometry::Line(a, b) => {
                with("line", &[("x1", mm(a[0])), ("y1", mm(a[1])), ("x2", mm(b[0])), ("y2", mm(b[1]))])
            }
            Geometry::Path(segments) => with("path", &[("d", path_data(segments))]),
            Geometry::Circle { center, radius } => {
                with("circle", &[("cx", mm(center[0])), ("cy", mm(center[1])), ("r", mm(*radius))])
            }
        };
        match &shape.fill {
            None if matches!(shape.geometry, Geometry::Line(..)) => {}
            None => element.assign("fill", "none"),
            Some(Fill::Flat { color, .. }) if self.is_paper(*color) => element.assign("fill", "none"),
            Some(Fill::Flat { color, opacity }) => {
                element.assign("fill", self.color(*color));
                if *opacity < 1.0 {
                    element.assign("fill-opacity", mm(*opacity));
                }
            }
            Some(fade) => element.assign("fill", format!("url(#{})", self.fade(fade))),
        }
        if let Some(stroke) = &shape.stroke {
            element.assign("stroke", self.color(stroke.color));
            assign_stroke(&mut element, stroke);
        }
        element
    }

    /// The colour as the file says it.
    fn color(&self, color: Color) -> String {
        match self.recoloring {
            Recoloring::ToText { ink, .. } if *ink == color => "currentColor".to_owned(),
            _ => hex(color),
        }
    }

    /// Whether a fill stands for paper that the file does not have.
    fn is_paper(&self, color: Color) -> bool {
        matches!(self.recoloring, Recoloring::ToText { paper, .. } if *paper == color)
    }

    fn fade(&mut self, fade: &Fill) -> String {
        let known = self.fades.iter().position(|f| f == fade);
        let id = format!("{}fade{}", self.prefix, known.unwrap_or(self.fades.len()));
        if known.is_none() {
            self.fades.push(*fade);
            if let Fill::Fade { color, from, to, from_opacity, to_opacity } = fade {
                let mut gradient = with(
                    "linearGradient",
                    &[
                        ("id", id.clone()),
                        ("gradientUnits", "userSpaceOnUse".to_owned()),
                        ("x1", mm(from[0])),
                        ("y1", mm(from[1])),
                        ("x2", mm(to[0])),
                        ("y2", mm(to[1])),
                    ],
                );
                for (offset, opacity) in [("0", from_opacity), ("1", to_opacity)] {
                    gradient.append(with(
                        "stop",
                        &[
                            ("offset", offset.to_owned()),
                            ("stop-color", self.color(*color)),
                            ("stop-opacity", mm(*opacity)),
                        ],
                    ));
                }
                self.definitions.push(gradient);
            }
        }
        id
    }

    fn text(&mut self, text: &Text) -> Result<Element> {
        if self.text_as == TextAs::Text {
            return Ok(plain_text(text, self.color(text.color)));
        }
        let mut group = with("g", &[("aria-label", text.plain()), ("fill", self.color(text.color))]);
        if text.is_turned() {
            let mut line = Letters::default();
            for glyph in lettering::place(text)? {
                line.add(&lettering::outline(glyph.face, glyph.character, glyph.size, text.along)?, glyph.at);
            }
            group.append(with("path", &[("d", line.data)]));
            return Ok(group);
        }
        for glyph in lettering::place(text)? {
            if let Some(id) = self.glyph(glyph.face, glyph.character, glyph.size)? {
                let [x, y] = glyph.at;
                group.append(with("use", &[("href", format!("#{id}")), ("x", pen(x)), ("y", pen(y))]));
            }
        }
        Ok(group)
    }

    /// The id of a letter's outline; `None` for a blank.
    fn glyph(&mut self, face: Face, character: char, size: f64) -> Result<Option<String>> {
        let key = (face, character, size.to_bits());
        if let Some(id) = self.glyphs.get(&key) {
            return Ok(id.clone());
        }
        let outline = lettering::outline(face, character, size, [1.0, 0.0])?;
        let id = (!outline.is_empty()).then(|| format!("{}{}", self.prefix, self.glyphs.len()));
        if let Some(id) = &id {
            let mut letter = Letters::default();
            letter.add(&outline, [0.0; 2]);
            self.definitions.push(with("path", &[("id", id.clone()), ("d", letter.data)]));
        }
        self.glyphs.insert(key, id.clone());
        Ok(id)
    }
}
