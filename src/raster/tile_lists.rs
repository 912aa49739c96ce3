//! Which triangles may touch which tile, in order.
//!
//! In: for each triangle, nearest first, the tiles that it touches, from [`super::bin`]. Out: for a tile the places of its
//! triangles in that order, as many at a time as are asked for; or all that come before a place.
//!
//! A triangle is listed with each tile that it touches; where these are more than 16 it is listed with squares of 4 x 4 tiles
//! instead, or of 16 x 16 and so on, so that a hundred thousand triangles over the whole film take a few entries each. A tile's
//! triangles are its own list and those of the squares around it, `(x >> 2 k, y >> 2 k)` for `k` = 1, 2 and so on, merged by
//! order.

use rayon::prelude::*;

/// Triangles that a parallel task takes at a time; the result does not depend on it.
const CHUNK: usize = 4096;

/// Squares of a level that a triangle may be listed with; beyond, it goes to the next level.
const MOST: u32 = 16;

/// Levels of squares above the tiles: 1024 tiles are the most in a row.
const LEVELS: usize = 5;

/// The tiles that a box touches: columns `x0..=x1`, rows `y0..=y1`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tiles {
    pub x0: u16,
    pub x1: u16,
    pub y0: u16,
    pub y1: u16,
}

impl Tiles {
    /// No tile.
    pub(super) const NONE: Self = Self { x0: 1, x1: 0, y0: 1, y1: 0 };

    /// The squares of `1 << shift` tiles that hold them.
    fn squares(self, shift: u32) -> Self {
        Self { x0: self.x0 >> shift, x1: self.x1 >> shift, y0: self.y0 >> shift, y1: self.y1 >> shift }
    }

    pub(super) fn count(self) -> u32 {
        u32::from(self.x1 + 1 - self.x0) * u32::from(self.y1 + 1 - self.y0)
    }

    fn contain(self, (x, y): (u32, u32)) -> bool {
        (u32::from(self.x0)..=u32::from(self.x1)).contains(&x)
            & (u32::from(self.y0)..=u32::from(self.y1)).contains(&y)
    }
}

/// A row of tiles, or all squares of a level: for each the range of its entries.
struct Lists<T> {
    starts: Vec<usize>,
    entries: Vec<T>,
}

impl<T: Copy + Default> Lists<T> {
    /// From (number of a list, entry), in the order that each list is to have.
    fn new(lists: usize, pairs: &[&[(u32, T)]]) -> Self {
        let mut starts = vec![0usize; lists + 1];
        for (list, _) in pairs.iter().copied().flatten() {
            starts[*list as usize + 1] += 1;
        }
        for list in 0..lists {
            starts[list + 1] += starts[list];
        }
        let mut next = starts.clone();
        let mut entries = vec![T::default(); starts[lists]];
        for (list, entry) in pairs.iter().copied().flatten() {
            let place = &mut next[*list as usize];
            entries[*place] = *entry;
            *place += 1;
        }
        Self { starts, entries }
    }

    fn list(&self, number: u32) -> &[T] {
        let at = number as usize;
        &self.entries[self.starts[at]..self.starts[at + 1]]
    }
}

/// All squares of `1 << shift` tiles that triangles are listed with.
struct Squares {
    shift: u32,
    squares_x: u32,
    lists: Lists<(u32, Tiles)>,
}

impl Squares {
    /// The list of the square that holds tile `(x, y)`.
    fn list(&self, (x, y): (u32, u32)) -> &[(u32, Tiles)] {
        self.lists.list((y >> self.shift) * self.squares_x + (x >> self.shift))
    }
}

/// How far a tile's lists have been read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cursor {
    own: usize,
    squares: [usize; LEVELS],
    /// How many slices of loose triangles ([`super::bunches`]).
    pub slices: usize,
}

/// The lists of all tiles: places of triangles in their order.
#[derive(Default)]
pub(super) struct TileLists {
    /// Each row of tiles.
    rows: Vec<Lists<u32>>,
    levels: Vec<Squares>,
}

impl TileLists {
    /// From the tiles that each triangle touches, nearest first, in a picture of `columns` by `rows` tiles.
    pub(super) fn new(columns: u32, rows: u32, tiles: &[Tiles]) -> Self {
        /// What one task found: for each row of tiles (column, place), and for each level (square, entry).
        type Found = (Vec<Vec<(u32, u32)>>, [Vec<(u32, (u32, Tiles))>; LEVELS]);
        let squares_x = |shift: u32| ((columns - 1) >> shift) + 1;
        let found: Vec<Found> = tiles
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, tiles)| {
                let mut own: Vec<Vec<(u32, u32)>> = vec![Vec::new(); rows as usize];
                let mut above: [Vec<(u32, (u32, Tiles))>; LEVELS] = Default::default();
                for (place, touched) in (chunk * CHUNK..).zip(tiles) {
                    let place = place as u32;
                    if touched.count() <= MOST {
                        for y in touched.y0..=touched.y1 {
                            own[usize::from(y)]
                                .extend((touched.x0..=touched.x1).map(|x| (u32::from(x), place)));
                        }
                        continue;
                    }
                    let enough = |level: &usize| touched.squares(shift(*level)).count() <= MOST;
                    let level = (0..LEVELS).find(enough).unwrap_or(LEVELS - 1);
                    let squares = touched.squares(shift(level));
                    for y in squares.y0..=squares.y1 {
                        let row = u32::from(y) * squares_x(shift(level));
                        above[level].extend(
                            (squares.x0..=squares.x1).map(|x| (row + u32::from(x), (place, *touched))),
                        );
                    }
                }
                (own, above)
            })
            .collect();
        let own = (0..rows as usize)
            .into_par_iter()
            .map(|row| {
                let pairs: Vec<&[_]> = found.iter().map(|(own, _)| &own[row][..]).collect();
                Lists::new(columns as usize, &pairs)
            })
            .collect();
        let levels = (0..LEVELS)
            .into_par_iter()
            .filter(|&level| found.iter().any(|(_, above)| !above[level].is_empty()))
            .map(|level| {
                let (shift, pairs) = (shift(level), found.iter().map(|(_, above)| &above[level][..]));
                let squares = squares_x(shift) * (((rows - 1) >> shift) + 1);
                let lists = Lists::new(squares as usize, &pairs.collect::<Vec<_>>());
                Squares { shift, squares_x: squares_x(shift), lists }
            })
            .collect();
        Self { rows: own, levels }
    }

    /// How many entries there are.
    pub(super) fn entries(&self) -> usize {
        self.rows.iter().map(|row| row.entries.len()).sum::<usize>()
            + self.levels.iter().map(|level| level.lists.entries.len()).sum::<usize>()
    }

    /// At least the most triangles that a tile has.
    pub(super) fn fullest(&self) -> usize {
        let longest =
            |starts: &[usize]| starts.windows(2).map(|range| range[1] - range[0]).max().unwrap_or(0);
        let own = self.rows.iter().map(|row| longest(&row.starts)).max().unwrap_or(0);
        own + self.levels.iter().map(|level| longest(&level.lists.starts)).sum::<usize>()
    }

    /// How many triangles are listed with a tile itself.
    pub(super) fn crowd(&self, tile: (u32, u32)) -> usize {
        self.own(tile).len()
    }

    fn own(&self, (x, y): (u32, u32)) -> &[u32] {
        self.rows.get(y as usize).map_or(&[][..], |row| row.list(x))
    }

    /// The next triangles that may touch tile `(x, y)` and come before place `end`, in any order.
    pub(super) fn until(&self, end: u32, (x, y): (u32, u32), cursor: &mut Cursor, out: &mut Vec<u32>) {
        out.clear();
        let own = self.own((x, y)).get(cursor.own..).unwrap_or_default();
        out.extend(own.iter().take_while(|&&place| place < end));
        cursor.own += out.len();
        for (level, read) in self.levels.iter().zip(&mut cursor.squares) {
            let list = level.list((x, y)).get(*read..).unwrap_or_default();
            let list = &list[..list.partition_point(|(place, _)| *place < end)];
            *read += list.len();
            out.extend(list.iter().filter(|(_, tiles)| tiles.contain((x, y))).map(|(place, _)| *place));
        }
    }

    /// The next triangles that may touch tile `(x, y)`, as many as `out` holds or there are; tells how many.
    pub(super) fn next(&self, (x, y): (u32, u32), cursor: &mut Cursor, out: &mut [u32]) -> usize {
        let own = self.own((x, y));
        let lists: [&[(u32, Tiles)]; LEVELS] =
            std::array::from_fn(|at| self.levels.get(at).map_or(&[][..], |level| level.list((x, y))));
        let mut count = 0;
        if lists.iter().zip(&cursor.squares).all(|(list, &read)| read >= list.len()) {
            // Mostly there are no squares.
            let rest = own.get(cursor.own..).unwrap_or_default();
            count = rest.len().min(out.len());
            out[..count].copy_from_slice(&rest[..count]);
            cursor.own += count;
            return count;
        }
        for out in out {
            let (mut first, mut from) = (own.get(cursor.own).copied(), LEVELS);
            for (at, list) in lists.iter().enumerate().take(self.levels.len()) {
                let read = &mut cursor.squares[at];
                while list.get(*read).is_some_and(|(_, tiles)| !tiles.contain((x, y))) {
                    *read += 1;
                }
                if let Some(&(place, _)) = list.get(*read)
                    && first.is_none_or(|first| place < first)
                {
                    (first, from) = (Some(place), at);
                }
            }
            let Some(place) = first else { break };
            *out = place;
            count += 1;
            match cursor.squares.get_mut(from) {
                Some(read) => *read += 1,
                None => cursor.own += 1,
            }
        }
        count
    }
}

/// Squares of a level are `1 << shift(level)` tiles wide.
fn shift(level: usize) -> u32 {
    2 * (level as u32 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn every_tile_gets_its_triangles_in_order() {
        let (columns, rows) = (70, 45);
        let mut numbers = Random(3);
        let mut random = |below: u32| ((numbers.bits() >> 33) as u32 % below) as u16;
        let tiles: Vec<Tiles> = (0..3 * CHUNK / 2)
            .map(|i| {
                let (x0, y0) = (random(columns), random(rows));
                // A few are large, and one in a thousand is anything up to the whole picture.
                let size = if i % 1000 == 0 {
                    70
                } else if i % 50 == 0 {
                    12
                } else {
                    2
                };
                let x1 = (x0 + random(size)).min(columns as u16 - 1);
                let y1 = (y0 + random(size)).min(rows as u16 - 1);
                Tiles { x0, x1, y0, y1 }
            })
            .collect();
        let lists = TileLists::new(columns, rows, &tiles);
        assert!(lists.levels.len() > 1);
        for tile in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
            let mut cursor = Cursor::default();
            let found: Vec<u32> = std::iter::from_fn(|| {
                let mut next = [0];
                (lists.next(tile, &mut cursor, &mut next) == 1).then_some(next[0])
            })
            .collect();
            let wanted: Vec<u32> =
                (0..tiles.len() as u32).filter(|&t| tiles[t as usize].contain(tile)).collect();
            assert_eq!(found, wanted, "{tile:?}");
            let (mut cursor, mut some, mut all) = (Cursor::default(), Vec::new(), Vec::new());
            for end in (0..=tiles.len() as u32).step_by(CHUNK / 8) {
                lists.until(end, tile, &mut cursor, &mut some);
                some.sort_unstable();
                assert!(all.last() < some.first() || some.is_empty(), "{tile:?}");
                assert!(some.last().is_none_or(|&last| last < end), "{tile:?}");
                all.append(&mut some);
            }
            assert_eq!(all, wanted, "{tile:?}");
        }
    }
}
