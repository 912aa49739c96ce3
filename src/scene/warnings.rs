//! Warnings as they arise in, one a file and kind with its first line and a count out.

use std::collections::HashMap;

use crate::error::Warning;

/// More than this many different warnings about one model help nobody.
const MOST: usize = 100;

/// Collects warnings in the order of their first occurrence.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    entries: Vec<(Warning, usize)>,
    seen: HashMap<(String, String), usize>,
    beyond: usize,
}

impl Warnings {
    /// Adds a warning; those with the same `file` and `kind` are counted, and the first is kept.
    pub(crate) fn add(
        &mut self,
        file: &str,
        line: Option<usize>,
        kind: &str,
        message: impl FnOnce() -> String,
    ) {
        if self.is_wanted(file, kind) {
            self.entries.push((Warning { file: file.to_owned(), line, message: message() }, 1));
        }
    }

    /// Counts one, and tells whether the list shall have it.
    fn is_wanted(&mut self, file: &str, kind: &str) -> bool {
        if let Some(&at) = self.seen.get(&(file.to_owned(), kind.to_owned())) {
            if let Some(entry) = self.entries.get_mut(at) {
                entry.1 += 1;
            }
            return false;
        }
        let has_room = self.entries.len() < MOST;
        if has_room {
            self.seen.insert((file.to_owned(), kind.to_owned()), self.entries.len());
        } else {
            self.beyond += 1;
        }
        has_room
    }

    /// The finished list.
    pub(crate) fn finish(self, file: &str) -> Vec<Warning> {
        let mut list: Vec<Warning> = self
            .entries
            .into_iter()
            .map(|(mut warning, count)| {
                if count > 1 {
                    warning.message.push_str(&format!(" (and {} more like it)", count - 1));
                }
                warning
            })
            .collect();
        if self.beyond > 0 {
            let message = format!("{} further warnings are not shown", self.beyond);
            list.push(Warning { file: file.to_owned(), line: None, message });
        }
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_becomes_a_count() {
        let mut warnings = Warnings::default();
        for line in 1..=5 {
            warnings.add("a.obj", Some(line), "short face", || "skipped".to_owned());
        }
        for name in 0..MOST + 2 {
            warnings.add("a.mtl", None, &name.to_string(), || name.to_string());
        }
        let list = warnings.finish("a.obj");
        assert_eq!(list.len(), MOST + 1);
        assert_eq!(list[0].to_string(), "a.obj:1: skipped (and 4 more like it)");
        assert_eq!(list[MOST].message, "3 further warnings are not shown");
    }
}
