//! The three painters hold no opinions: pixels, the SVG as resvg draws it and the PDF as hayro draws it agree, on every
//! figure of the book, in every theme that the three share, with letters as outlines and as text.

use groundglass::diagram::{Figure, FigureFile, TextAs, Theme};
use groundglass::scene::{Document, Files};
use hayro::hayro_interpret::InterpreterSettings;
use hayro::hayro_syntax::Pdf;
use hayro::{RenderCache, RenderSettings};
use std::fs;
use std::path::{Path, PathBuf};

/// Pixels a millimetre.
const SCALE: f64 = 6.0;

fn book() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("diagrams");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    files.sort();
    files
}

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

#[test]
fn the_three_painters_agree() {
    for file in book() {
        for (name, theme) in [("print", Theme::PRINT), ("dark", Theme::DARK)] {
            let figure = draw(&file, theme);
            let what = format!("{} {name}", file.file_name().unwrap().to_string_lossy());
            let (width, height, pixels) = figure.to_pixels(SCALE).unwrap();
            let svg = from_svg(&figure.to_svg().unwrap(), width, height);
            let paths = from_pdf(figure.to_pdf_with(TextAs::Paths).unwrap(), width, height);
            let text = from_pdf(figure.to_pdf().unwrap(), width, height);
            for (painter, other) in [("SVG", &svg), ("PDF, paths", &paths), ("PDF, text", &text)] {
                let (mean, share) = compare(&pixels, other);
                println!("{what}, {painter}: mean {mean:.3}, share {share:.6}");
                // resvg fills as our pixels do; hayro has another rasterizer.
                let most = if painter == "SVG" { 0.1 } else { 1.0 };
                assert!(mean < most && share < 0.001, "{what}, {painter}: mean {mean}, share {share}");
            }
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
