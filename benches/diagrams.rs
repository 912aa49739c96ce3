//! How long the figures of the book take, each and all, from the read file to the bytes of its SVG. The bounds: 20 ms a
//! figure (without the picture that `view-pair` sets, and the model of 2.4 MB that it reads), one second for
//! the book.

use criterion::{Criterion, criterion_group, criterion_main};
use groundglass::diagram::{Changes, FigureFile};
use groundglass::scene::{Document, Files};
use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};

fn svg(text: &[u8], folder: &Path) -> String {
    let document = Document::from_bytes(text, "figure.toml").unwrap_or_else(|error| panic!("{error}"));
    let figure = FigureFile::from_document(document)
        .and_then(|file| file.draw(&Files::new(), folder, Changes::default()))
        .unwrap_or_else(|error| panic!("{error}"));
    figure.to_svg().unwrap_or_else(|error| panic!("{error}"))
}

fn book() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("diagrams");
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    let name = |path: &PathBuf| path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    paths.iter().filter_map(|path| Some((name(path)?, fs::read(path).ok()?))).collect()
}

fn figures(c: &mut Criterion) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("diagrams");
    let folder = fs::canonicalize(&folder).unwrap_or(folder);
    let book = book();
    let mut group = c.benchmark_group("figure");
    group.sample_size(10);
    for (name, text) in &book {
        group.bench_function(name, |b| b.iter(|| svg(black_box(text), &folder)));
    }
    group.finish();
    let mut whole = c.benchmark_group("book");
    whole.sample_size(10);
    whole.bench_function("all figures", |b| {
        b.iter(|| book.iter().map(|(_, text)| svg(black_box(text), &folder).len()).sum::<usize>())
    });
    whole.finish();
}

criterion_group!(benches, figures);
criterion_main!(benches);
