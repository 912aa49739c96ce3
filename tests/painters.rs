//! The three painters hold no opinions: pixels, the SVG as resvg draws it and the PDF as hayro draws it agree, on every
//! figure of the book, in every theme that the three share, with letters as outlines and as text.

#[path = "common/book.rs"]
mod book;

use book::book;
use groundglass::diagram::{Figure, FigureFile, Item, TextAs, Theme};
use groundglass::scene::{Document, Files};
use hayro::hayro_interpret::InterpreterSettings;
use hayro::hayro_syntax::Pdf;
use hayro::{RenderCache, RenderSettings};
use std::fs;
use std::path::Path;

/// Pixels a millimetre.
const SCALE: f64 = 6.0;

fn draw(file: &Path, theme: Theme) -> Figure {
    let document = Document::from_bytes(&fs::read(file).unwrap(), &file.display().to_string()).unwrap();
    let changes = groundglass::diagram::Changes { theme: Some(theme), ..Default::default() };
    let folder = fs::canonicalize(file.parent().unwrap()).unwrap();
    FigureFile::from_document(document).unwrap().draw(&Files::new(), &folder, changes).unwrap()
}

fn from_svg(svg: &str, width: u32, height: u32) -> Vec<u8> {
    let tree = resvg::usvg::Tree::from_str(svg, &resvg::usvg::Options::default()).unwrap();
    let mut pixmap = resvg::tiny_skia::Pixmap::new(width, height).unwrap();
    let scale = width as f32 / tree.size().width();
    resvg::render(&tree, resvg::tiny_skia::Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.take_demultiplied()
}

fn from_pdf(pdf: Vec<u8>, width: u32, height: u32) -> Vec<u8> {
    let pdf = Pdf::new(pdf).unwrap();
    assert_eq!(pdf.pages().len(), 1);
    let page = &pdf.pages()[0];
    let (w, h) = page.render_dimensions();
    let settings = RenderSettings {
        x_scale: width as f32 / w,
        y_scale: height as f32 / h,
        width: u16::try_from(width).ok(),
        height: u16::try_from(height).ok(),
        ..RenderSettings::default()
    };
    let pixmap = hayro::render(page, &RenderCache::new(), &InterpreterSettings::default(), &settings);
    pixmap.data_as_u8_slice().to_vec()
}

/// Mean difference of a pixel, and the share of pixels that differ by more than anti-aliasing makes them.
fn compare(a: &[u8], b: &[u8]) -> (f64, f64) {
    let (mut sum, mut many) = (0.0, 0.0);
    for (p, q) in a.chunks(4).zip(b.chunks(4)) {
        let most = p.iter().zip(q).map(|(&a, &b)| a.abs_diff(b)).max().unwrap();
        sum += f64::from(most);
        many += f64::from(u8::from(most > 64));
    }
    let count = a.len() as f64 / 4.0;
    (sum / count, many / count)
}

/// Square millimetres that pictures cover.
fn pictured(items: &[Item]) -> f64 {
    let of = |item: &Item| match item {
        Item::Group(group) => pictured(&group.items),
        Item::Raster(raster) => {
            let [left, top, right, bottom] = raster.bounds;
            (right - left) * (bottom - top)
        }
        Item::Shape(_) | Item::Text(_) => 0.0,
    };
    items.iter().map(of).sum()
}

#[test]
fn the_three_painters_agree_in_print() {
    painters_agree("print", Theme::PRINT);
}

#[test]
fn the_three_painters_agree_in_the_dark() {
    painters_agree("dark", Theme::DARK);
}

fn painters_agree(name: &str, theme: Theme) {
    for file in book() {
        let figure = draw(&file, theme);
        let what = format!("{} {name}", file.file_name().unwrap().to_string_lossy());
        let (width, height, pixels) = figure.to_pixels(SCALE).unwrap();
        let svg = from_svg(&figure.to_svg().unwrap(), width, height);
        let list = figure.display_list();
        let part = pictured(&list.items) / (list.page[0] * list.page[1]);
        let paths = from_pdf(figure.to_pdf_with(TextAs::Paths).unwrap(), width, height);
        let text = from_pdf(figure.to_pdf().unwrap(), width, height);
        for (painter, other) in [("SVG", &svg), ("PDF, paths", &paths), ("PDF, text", &text)] {
            let (mean, share) = compare(&pixels, other);
            println!("{what}, {painter}: mean {mean:.3}, share {share:.6}");
            // resvg fills as our pixels do. The SVG has outlines to 0.001 mm and, for short files, letters' places to 0.01 mm:
            // an edge is off by at most 0.033 of a pixel, 8 of 255, and letters' edges are some 2 % of a page (measured: at
            // most 0.15). A picture is scaled by either's own filter (0.18 where it
            // covers two fifths of the page, 0.30 where two cover three quarters). hayro has another rasterizer, whose edges
            // differ by up to a quarter of a step (0.80), and a filter of its own for pictures (1.35).
            let (most, seen) = match (painter, part) {
                ("SVG", 0.0) => (0.16, 2e-4),
                ("SVG", part) if part < 0.5 => (0.2, 2e-4),
                ("SVG", _) => (0.35, 2e-4),
                (_, part) if part < 0.5 => (1.0, 1e-3),
                _ => (1.6, 2.5e-3),
            };
            assert!(mean < most && share < seen, "{what}, {painter}: mean {mean}, share {share}");
        }
    }
}

#[test]
fn a_pdf_has_its_bytes_its_words_and_no_date() {
    let figure = draw(&book()[0], Theme::PRINT);
    let pdf = figure.to_pdf().unwrap();
    assert_eq!(pdf, figure.to_pdf().unwrap());
    assert!(pdf.starts_with(b"%PDF-1.7") && pdf.len() < 80_000);
    let text = String::from_utf8_lossy(&pdf);
    assert!(!text.contains("CreationDate") && !text.contains("/ModDate"));
    for word in ["/StructTreeRoot", "/Alt", "/ToUnicode", "/FontFile2", "GROUND+GroundglassSans", "/Lang"] {
        assert!(text.contains(word), "{word}");
    }
    assert!(!String::from_utf8_lossy(&figure.to_pdf_with(TextAs::Paths).unwrap()).contains("/FontFile2"));
}

/// Mean colours of squares of `side` pixels, row by row.
fn squares(pixels: &[u8], channels: usize, size: [usize; 2], side: usize) -> Vec<[f64; 3]> {
    let [columns, rows] = size.map(|s| s / side);
    let mean = |i: usize, channel: usize| {
        let (left, top) = (side * (i % columns), side * (i / columns));
        let at = |k: usize| channels * ((top + k / side) * size[0] + left + k % side) + channel;
        (0..side * side).map(|k| f64::from(pixels[at(k)])).sum::<f64>() / (side * side) as f64
    };
    (0..columns * rows).map(|i| [mean(i, 0), mean(i, 1), mean(i, 2)]).collect()
}

#[test]
fn poppler_draws_the_same_where_it_is_present() {
    use std::process::Command;
    if Command::new("pdftoppm").arg("-v").output().is_err() {
        println!("skipped: pdftoppm is missing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("figure.pdf");
    for file in book() {
        let figure = draw(&file, Theme::PRINT);
        let what = file.file_name().unwrap().to_string_lossy();
        fs::write(&path, figure.to_pdf().unwrap()).unwrap();
        let drawn =
            Command::new("pdftoppm").args(["-r", "152.4", "-singlefile"]).arg(&path).output().unwrap();
        // Nothing in the file is found wrong.
        assert!(drawn.status.success() && drawn.stderr.is_empty(), "{what}: {:?}", drawn.stderr);
        let header: Vec<&[u8]> = drawn.stdout.splitn(4, |b| b.is_ascii_whitespace()).collect();
        let number = |text: &[u8]| String::from_utf8_lossy(text).parse::<usize>().unwrap();
        let (wide, high) = (number(header[1]), number(header[2]));
        let body = drawn.stdout.len() - 3 * wide * high;
        let (width, height, pixels) = figure.to_pixels(SCALE).unwrap();
        let (width, height) = (width as usize, height as usize);
        assert!(wide.abs_diff(width) < 2 && high.abs_diff(height) < 2, "{what}: {wide} x {high}");
        // Poppler moves thin lines to whole pixels and has letters of its own make: compared by square millimetres.
        let crop: Vec<u8> = (0..height.min(high))
            .flat_map(|y| drawn.stdout[body + 3 * wide * y..][..3 * width.min(wide)].to_vec())
            .collect();
        let size = [width.min(wide), height.min(high)];
        let ours: Vec<u8> =
            (0..size[1]).flat_map(|y| pixels[4 * width * y..][..4 * size[0]].to_vec()).collect();
        let (one, two) = (squares(&crop, 3, size, 6), squares(&ours, 4, size, 6));
        let off: Vec<f64> = one
            .iter()
            .zip(&two)
            .map(|(p, q)| p.iter().zip(q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
            .collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let most = off.iter().copied().fold(0.0, f64::max);
        println!("{what}: mean {mean:.2}, most {most:.1} of 255");
        assert!(mean < 2.5 && most < 60.0, "{what}: mean {mean}, most {most}");
    }
}
