//! In: a face and the characters set in it. Out: the face embedded in a PDF, with the widths of those characters and what
//! they are in Unicode, so that text can be searched and copied.

use crate::diagram::display_list::Face;
use crate::diagram::lettering;
use crate::error::Result;
use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{CidFontType, FontFlags, SystemInfo, UnicodeCmap};
use pdf_writer::{Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::collections::BTreeSet;

/// The objects of an embedded face: font, its descendant, descriptor, file, map to Unicode.
pub(crate) struct Refs(pub(crate) [Ref; 5]);

impl Refs {
    pub(crate) fn font(&self) -> Ref {
        self.0[0]
    }
}

/// What the page calls the face.
pub(crate) fn name(face: Face) -> Name<'static> {
    match face {
        Face::Regular => Name(b"R"),
        Face::Oblique => Name(b"I"),
    }
}

/// Writes the face's objects.
///
/// # Errors
/// When a glyph is missing.
pub(crate) fn embed(pdf: &mut Pdf, face: Face, refs: &Refs, used: &BTreeSet<char>) -> Result<()> {
    let [font, descendant, descriptor, file, unicode] = refs.0;
    // The embedded font is itself a subset, hence the tag.
    let base: &[u8] = match face {
        Face::Regular => b"GROUND+GroundglassSans",
        Face::Oblique => b"GROUND+GroundglassSans-Oblique",
    };
    let base = Name(base);
    let system = SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };
    pdf.type0_font(font)
        .base_font(base)
        .encoding_predefined(Name(b"Identity-H"))
        .descendant_font(descendant)
        .to_unicode(unicode);
    let mut glyphs = Vec::new();
    for &character in used {
        glyphs.push((lettering::glyph(face, character)?, character));
    }
    glyphs.sort_unstable();
    let mut cid = pdf.cid_font(descendant);
    cid.subtype(CidFontType::Type2).base_font(base).system_info(system).font_descriptor(descriptor);
    cid.default_width(0.0).cid_to_gid_map_predefined(Name(b"Identity"));
    let mut widths = cid.widths();
    for &(glyph, character) in &glyphs {
        widths.consecutive(glyph, [(1000.0 * lettering::advance(face, character)?) as f32]);
    }
    widths.finish();
    cid.finish();
    let slant = if face == Face::Oblique { -11.0 } else { 0.0 };
    let mut flags = FontFlags::SYMBOLIC;
    if face == Face::Oblique {
        flags |= FontFlags::ITALIC;
    }
    pdf.font_descriptor(descriptor)
        .name(base)
        .flags(flags)
        .bbox(Rect::new(-200.0, -240.0, 1500.0, 1000.0))
        .italic_angle(slant)
        .ascent(760.0)
        .descent(-240.0)
        .cap_height(729.0)
        .stem_v(80.0)
        .font_file2(file);
    let bytes = lettering::file(face);
    let pressed = compress_to_vec_zlib(bytes, 9);
    pdf.stream(file, &pressed)
        .filter(Filter::FlateDecode)
        .pair(Name(b"Length1"), i32::try_from(bytes.len()).unwrap_or(i32::MAX));
    let mut map = UnicodeCmap::new(Name(b"Groundglass"), system);
    for (glyph, character) in glyphs {
        map.pair(glyph, character);
    }
    let map = map.finish();
    pdf.cmap(unicode, &map).name(Name(b"Groundglass")).system_info(system);
    Ok(())
}
