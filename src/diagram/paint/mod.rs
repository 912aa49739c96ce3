//! Painters: from a display list to a file format, nothing else decided.

pub(crate) mod pdf;
mod pdf_font;
pub(crate) mod pixels;
pub(crate) mod svg;
mod svg_elements;
mod svg_letters;
