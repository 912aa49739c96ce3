//! The material libraries of an OBJ: what its `mtllib` and `usemtl` say in, the materials that faces use out.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use super::digest::{self, Digest};
use super::mesh::NONE;
use super::mtl::{self, Entry};
use super::normalize::{LIBRARIES, Normalized, shown};
use super::source::Source;
use super::text::{readings, squeezed};
use super::warnings::Warnings;
use crate::error::{ErrorKind, Result};

/// Longest MTL file, and most of all together that an OBJ names, in bytes.
const MTL_LIMIT: u64 = 4 << 20;
const MTLS_LIMIT: u64 = 8 << 20;

/// Most memory that reading takes for each byte of an MTL: `newmtl a` and a line feed become a record of `tobj`'s and two
/// of ours.
const MEMORY_PER_BYTE: u64 = 120;

/// Most files that one `mtllib` statement names.
const NAMES: usize = 256;

/// A material as written, and the library that it is in.
pub(crate) struct Written {
    pub(crate) entry: Entry,
    pub(crate) file: String,
    pub(crate) folder: PathBuf,
}

impl Written {
    /// Of two materials with one name the later counts, which shows if they differ.
    fn warn_if_replaced(&self, before: &Self, warnings: &mut Warnings) {
        let line = self.entry.line;
        if self.folder != before.folder || self.entry.differs(&before.entry) {
            let message = || {
                let (file, line) = (shown(&before.file), before.entry.line);
                let name = self.entry.names.first().map(|name| shown(name)).unwrap_or_default();
                format!("there was a material `{name}` in {file}:{line}; this one is used")
            };
            warnings.add(&self.file, Some(line), &format!("newmtl {line}"), message);
        }
    }
}

/// Reads the libraries that the OBJ names, in its order, each once, in about `most` bytes of memory. Also says how many bytes
/// that took, or nothing where a library was left out because it is too large for the rest.
///
/// # Errors
/// [`ErrorKind::Io`] of one that is there and cannot be read.
pub(crate) fn read_libraries(
    source: &dyn Source,
    normalized: &Normalized,
    file: &str,
    fences: &[PathBuf],
    most: u64,
    warnings: &mut Warnings,
    digests: &mut Vec<Digest>,
) -> Result<(Vec<Written>, Option<u64>)> {
    let mut list = Vec::new();
    let mut seen = BTreeSet::new();
    let mut left = MTLS_LIMIT.min(most / MEMORY_PER_BYTE);
    let (mut taken, mut is_short) = (0, false);
    if let Some((_, line)) = normalized.libraries.get(LIBRARIES) {
        warnings
            .add(file, Some(*line), "libraries", || "`mtllib` from here on is left out: too many".to_owned());
    }
    for (rest, line) in normalized.libraries.iter().take(LIBRARIES) {
        if readings(rest).all(str::is_empty) {
            warnings.add(file, Some(*line), "mtllib", || "`mtllib` names no file".to_owned());
        }
        let (names, are_all) = split_names(source, rest, fences);
        if !are_all {
            let message = || format!("`mtllib` names more than {NAMES} files: the others are left out");
            warnings.add(file, Some(*line), "mtllib names", message);
        }
        for (name, found) in names {
            if found.as_ref().is_ok_and(|path| !seen.insert(path.clone())) {
                continue;
            }
            let read = found.and_then(|path| Ok((source.read(&path, MTL_LIMIT.min(left))?, path)));
            is_short |= read.as_ref().is_err_and(|error| error.kind() == ErrorKind::TooLarge);
            let length = read.as_ref().map_or(0, |(bytes, _)| bytes.len() as u64);
            (left, taken) = (left - length, taken + MEMORY_PER_BYTE * length);
            digests.push(read.as_ref().map_or(digest::ABSENT, |(bytes, _)| digest::of_bytes(bytes)));
            let entries = read.and_then(|(bytes, path)| Ok((mtl::read(&bytes, &name, warnings)?, path)));
            match entries {
                Ok((entries, path)) => {
                    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
                    let written = |entry| Written { entry, file: name.clone(), folder: folder.clone() };
                    list.extend(entries.into_iter().map(written));
                }
                Err(e) if e.kind() == ErrorKind::Io => return Err(e.in_file(file).at_line(*line)),
                Err(e) => {
                    let message =
                        || format!("material library `{}` is left out: {}", shown(&name), e.message());
                    warnings.add(file, Some(*line), &format!("mtllib {name}"), message);
                }
            }
        }
    }
    Ok((list, (!is_short).then_some(taken)))
}

/// The files that a `mtllib` names: one with spaces in its name, or several; and whether these are all.
fn split_names(
    source: &dyn Source,
    rest: &str,
    fences: &[PathBuf],
) -> (Vec<(String, Result<PathBuf>)>, bool) {
    /// More words than this are taken one by one.
    const WORDS: usize = 16;
    let find = |name: &str| source.asset(&fences[0], name, fences);
    let mut whole = None;
    for name in readings(rest).filter(|name| !name.is_empty()) {
        let found = find(name);
        if found.is_ok() {
            return (vec![(name.to_owned(), found)], true);
        }
        whole = Some((name, found));
    }
    let Some((name, error)) = whole else { return (Vec::new(), true) };
    let words: Vec<&str> = name.split_whitespace().take(NAMES).collect();
    let are_all = name.split_whitespace().nth(NAMES).is_none();
    let mut list = Vec::new();
    let mut begin = 0;
    while begin < words.len() {
        let most = if words.len() > WORDS { begin + 1 } else { words.len() };
        // The longest that there is, or else one word.
        let mut end = most;
        let (name, found) = loop {
            let name = words[begin..end].join(" ");
            let found = find(&name);
            if found.is_ok() || end == begin + 1 {
                break (name, found);
            }
            end -= 1;
        };
        list.push((name, found));
        begin = end;
    }
    if list.iter().all(|(_, found)| found.is_err()) {
        return (vec![(name.to_owned(), error)], are_all);
    }
    (list, are_all)
}

/// Which materials faces use.
pub(crate) struct Chosen {
    /// Into the library, in the order of first use.
    pub(crate) used: Vec<usize>,
    /// For each `usemtl`, its place in `used`, or [`NONE`].
    pub(crate) targets: Vec<u32>,
    /// Some face has no material.
    pub(crate) plain: bool,
}

/// Finds the material of each `usemtl` that a face follows; of two with one name the later counts.
pub(crate) fn choose(
    normalized: &Normalized,
    library: &[Written],
    file: &str,
    warnings: &mut Warnings,
) -> Chosen {
    // The whole name goes before what is left of it when its end is taken for a comment.
    let (mut whole, mut short, mut replaced) = (HashMap::new(), HashMap::new(), HashMap::new());
    for (at, written) in library.iter().enumerate() {
        let mut names = written.entry.names.iter();
        if let Some(before) = names.next().and_then(|name| whole.insert(name.as_str(), at)) {
            replaced.insert(at, before);
        }
        if let Some(name) = names.next().filter(|name| !name.is_empty()) {
            short.entry(name.as_str()).or_insert_with(Vec::new).push(at);
        }
    }
    let mut chosen =
        Chosen { used: Vec::new(), targets: vec![NONE; normalized.materials.len()], plain: false };
    let mut settled = vec![false; normalized.materials.len()];
    let mut places: HashMap<usize, u32> = HashMap::new();
    for face in &normalized.faces {
        let index = face.material as usize;
        let Some((name, line)) = normalized.materials.get(index) else {
            chosen.plain = true;
            continue;
        };
        if std::mem::replace(&mut settled[index], true) {
            continue;
        }
        let names: Vec<String> = readings(name).map(squeezed).collect();
        let find = |(rank, name): (usize, &String)| {
            let of_short = || {
                let named = short.get(name.as_str())?;
                // `a #3` is neither `a #1` nor `a #2`, and `a # old` may be `a # new`.
                named.last().filter(|_| rank == 0 || named.len() == 1).copied()
            };
            whole.get(name.as_str()).copied().or_else(of_short)
        };
        match names.iter().enumerate().find_map(find) {
            Some(at) => {
                let next = chosen.used.len() as u32;
                let place = *places.entry(at).or_insert(next);
                if place == next {
                    chosen.used.push(at);
                    if let Some(before) = replaced.get(&at).and_then(|&before| library.get(before)) {
                        library[at].warn_if_replaced(before, warnings);
                    }
                }
                chosen.targets[index] = place;
            }
            None => {
                chosen.plain = true;
                let message = || format!("there is no material `{}`; the default is used", shown(name));
                warnings.add(file, Some(*line), &format!("usemtl {name}"), message);
            }
        }
    }
    chosen
}
