//! Elements of an SVG one by one. In: pictures, texts, strokes and paths of a display list. Out: elements and the values of their
//! attributes, for [`super::svg`].

use crate::diagram::display_list::{Color, Face, Point, Raster, Segment, Stroke, Text};
use crate::diagram::words::{coordinate as mm, exact};
use svg::Node;
use svg::node::element::Element;

/// A picture, carried in the file.
pub(super) fn image(raster: &Raster) -> Element {
    let [left, top, right, bottom] = raster.bounds;
    with(
        "image",
        &[
            ("x", mm(left)),
            ("y", mm(top)),
            ("width", mm(right - left)),
            ("height", mm(bottom - top)),
            ("preserveAspectRatio", "none".to_owned()),
            ("href", format!("data:image/jpeg;base64,{}", base64(&raster.jpeg))),
        ],
    )
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS.get((bits >> (18 - 6 * i)) as usize & 63).copied().unwrap_or(b'=');
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

pub(super) fn plain_text(text: &Text, color: String) -> Element {
    let mut element = with(
        "text",
        &[
            ("x", mm(text.at[0])),
            ("y", mm(text.at[1])),
            ("font-family", "DejaVu Sans, Verdana, sans-serif".to_owned()),
            ("font-size", mm(text.size)),
            ("fill", color),
            ("xml:space", "preserve".to_owned()),
        ],
    );
    if text.is_turned() {
        let degrees = libm::atan2(text.along[1], text.along[0]).to_degrees();
        let turn = format!("rotate({} {} {})", mm(degrees), mm(text.at[0]), mm(text.at[1]));
        element.assign("transform", turn);
    }
    let mut line = String::from(GLUE);
    let mut drop = 0.0;
    for run in &text.runs {
        let words = run.text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        if run.face == Face::Regular && run.script.drop() == drop && run.script.size() == 1.0 {
            line.push_str(&words);
            continue;
        }
        line.push_str("<tspan");
        if run.face == Face::Oblique {
            line.push_str(" font-style=\"italic\"");
        }
        if run.script.size() < 1.0 {
            line.push_str(&format!(" font-size=\"{}\"", mm(text.size * run.script.size())));
        }
        if run.script.drop() != drop {
            line.push_str(&format!(" dy=\"{}\"", mm(text.size * (run.script.drop() - drop))));
            drop = run.script.drop();
        }
        line.push_str(&format!(">{words}</tspan>"));
    }
    element.append(svg::node::Blob::new(line + GLUE));
    element
}

/// Takes out the line feed that the writer of elements puts beside it: white space in a text would be drawn. No document
/// of XML can hold it otherwise.
pub(super) const GLUE: &str = "\u{1}";

pub(super) fn with(name: &str, attributes: &[(&str, String)]) -> Element {
    let mut element = Element::new(name);
    for (key, value) in attributes {
        element.assign(*key, value.as_str());
    }
    element
}

pub(super) fn assign_stroke(element: &mut Element, stroke: &Stroke) {
    element.assign("stroke-width", mm(stroke.width));
    if stroke.opacity < 1.0 {
        element.assign("stroke-opacity", mm(stroke.opacity));
    }
    if !stroke.dash.is_empty() {
        let dash: Vec<String> = stroke.dash.iter().map(|&x| mm(x)).collect();
        element.assign("stroke-dasharray", dash.join(" "));
    }
    if stroke.round {
        element.assign("stroke-linejoin", "round");
    }
}

pub(super) fn hex(c: Color) -> String {
    format!("#{:02x}{:02x}{:02x}", c.r, c.g, c.b)
}

pub(super) fn list_of(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|&x| exact(x)).collect();
    texts.join(" ")
}

pub(super) fn path_data(segments: &[Segment]) -> String {
    let mut d = String::new();
    let mut put = |command: char, points: &[Point]| {
        d.push(command);
        for (i, p) in points.iter().enumerate() {
            if i > 0 {
                d.push(' ');
            }
            d.push_str(&format!("{} {}", mm(p[0]), mm(p[1])));
        }
    };
    for segment in segments {
        match *segment {
            Segment::Move(p) => put('M', &[p]),
            Segment::Line(p) => put('L', &[p]),
            Segment::Quad(c, p) => put('Q', &[c, p]),
            Segment::Cubic(c, e, p) => put('C', &[c, e, p]),
            Segment::Close => put('Z', &[]),
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (bytes, text) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}
