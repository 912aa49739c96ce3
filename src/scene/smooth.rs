//! Where a texture is smooth: a level's texels in, the places around which one look-up stands for many out.
//!
//! Palettes of low-poly models are broad fields of one colour or of a straight slope from one to another. There the
//! mean of what samples see is the colour at their mean place. Squares of 8 x 8 texels are fitted with a
//! plane a channel; a square is smooth where it and the eight around it lie on its plane, and each channel of each only rises or
//! only falls along rows and along columns, as steps of 8 bits on a slope do and noise, however weak, does not. Photographs
//! have hardly any such squares, and most of theirs are told by five texels.

use rayon::prelude::*;

use super::texture::Level;

/// Texels on a square's side.
const SIDE: usize = 8;

/// How far a texel may be from its square's plane, linear light: a step of an 8-bit sRGB slope is up to 0.009.
const OFF: f32 = 1.0 / 128.0;

/// Squares of a level, row by row; those that the level's size cuts off are left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Smooth {
    columns: usize,
    /// Empty where no square is.
    squares: Vec<bool>,
}

/// The texels of a square, row by row.
type Square = [[[u16; 4]; SIDE]; SIDE];

/// Red, green and blue at the middle of a square, and their change with a texel to the right and down.
#[derive(Clone, Copy)]
struct Plane([[f32; 3]; 3]);

impl Smooth {
    /// How far around a place of [`Self::around`] the texture lies on the plane, texels to each side.
    pub(crate) const REACH: f32 = SIDE as f32 - 1.0;

    /// The smooth squares of a level.
    pub(crate) fn of(level: &Level) -> Self {
        let (columns, rows) = (level.width as usize / SIDE, level.height as usize / SIDE);
        let planes: Vec<Option<Plane>> = (0..rows)
            .into_par_iter()
            .flat_map_iter(|row| (0..columns).map(move |column| Plane::of(level, column, row)))
            .collect();
        let whole = [level.width, level.height].map(|size| (size as usize).is_multiple_of(SIDE));
        // The neighbour's number, around the border where squares go on there.
        let next = |at: usize, step: usize, count: usize, whole: bool| {
            let to = at + step;
            (whole || (1..=count).contains(&to)).then(|| (to + count - 1) % count)
        };
        let squares: Vec<bool> = (0..rows * columns)
            .map(|at| {
                let Some(plane) = &planes[at] else { return false };
                (0..9).all(|around| {
                    let (dx, dy) = (around % 3, around / 3);
                    let column = next(at % columns, dx, columns, whole[0]);
                    let row = next(at / columns, dy, rows, whole[1]);
                    let (Some(column), Some(row)) = (column, row) else { return false };
                    let moved = [dx, dy].map(|d| (d as f32 - 1.0) * SIDE as f32);
                    planes[row * columns + column].as_ref().is_some_and(|other| plane.meets(other, moved))
                })
            })
            .collect();
        if squares.contains(&true) { Self { columns, squares } } else { Self::default() }
    }

    /// No place at all.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    /// Whether the level is smooth for [`Self::REACH`] texels around texel `(x, y)`.
    #[inline(always)]
    pub(crate) fn around(&self, x: u32, y: u32) -> bool {
        let (column, row) = (x as usize / SIDE, y as usize / SIDE);
        column < self.columns && self.squares.get(row * self.columns + column).copied().unwrap_or_default()
    }
}

impl Plane {
    /// The plane of a square, where all of its texels lie on one.
    fn of(level: &Level, column: usize, row: usize) -> Option<Self> {
        let mut square: Square = [[[0; 4]; SIDE]; SIDE];
        for (y, texels) in square.iter_mut().enumerate() {
            let first = (row * SIDE + y) * level.width as usize + column * SIDE;
            texels.copy_from_slice(&level.texels[first..first + SIDE]);
        }
        let texel = |x: usize, y: usize| {
            let [r, g, b, _] = square[y][x];
            [r, g, b].map(|value| f32::from(value) * (1.0 / 65535.0))
        };
        // Least squares: the places are the same in every square, so a slope is a weighted sum.
        let middle = 0.5 * (SIDE as f32 - 1.0);
        let far = SIDE - 1;
        let corners = [texel(0, 0), texel(far, 0), texel(0, far), texel(far, far)];
        let bent =
            |c: usize| (corners[0][c] + corners[3][c] - corners[1][c] - corners[2][c]).abs() > 4.0 * OFF;
        if (0..3).any(bent) {
            return None;
        }
        let mut sums = [[0.0; 3]; 3];
        for y in 0..SIDE {
            for x in 0..SIDE {
                let (value, dx, dy) = (texel(x, y), x as f32 - middle, y as f32 - middle);
                for c in 0..3 {
                    sums[0][c] += value[c];
                    sums[1][c] += value[c] * dx;
                    sums[2][c] += value[c] * dy;
                }
            }
        }
        let places = (SIDE * SIDE) as f32;
        let spread = places * (places - 1.0) / 12.0;
        let plane = Self([
            sums[0].map(|sum| sum / places),
            sums[1].map(|sum| sum / spread),
            sums[2].map(|sum| sum / spread),
        ]);
        let lies = |x: usize, y: usize| {
            let (found, wanted) = (texel(x, y), plane.at([x as f32 - middle, y as f32 - middle]));
            (0..3).all(|c| (found[c] - wanted[c]).abs() <= OFF)
        };
        let is_straight = (0..SIDE * SIDE).all(|i| lies(i % SIDE, i / SIDE));
        (is_straight && is_monotone(&square)).then_some(plane)
    }

    /// The colour this far from the middle, texels.
    fn at(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let Self([value, right, down]) = self;
        [0, 1, 2].map(|c| value[c] + right[c] * x + down[c] * y)
    }

    /// Whether the plane of a square `moved` texels away lies on this one.
    fn meets(&self, other: &Self, moved: [f32; 2]) -> bool {
        let half = 0.5 * SIDE as f32;
        [[-half, -half], [half, -half], [-half, half], [half, half]].iter().all(|&[x, y]| {
            let (own, found) = (self.at([moved[0] + x, moved[1] + y]), other.at([x, y]));
            (0..3).all(|c| (own[c] - found[c]).abs() <= 2.0 * OFF)
        })
    }
}

/// Whether each channel of a square only rises or only falls along its rows, and along its columns: steps of a slope that 8 bits
/// hold do, noise does not, however weak.
fn is_monotone(square: &Square) -> bool {
    [[1, 0], [0, 1]].iter().all(|&[right, down]| {
        let [mut rises, mut falls] = [[false; 4]; 2];
        for y in down..SIDE {
            for x in right..SIDE {
                let (one, next) = (square[y - down][x - right], square[y][x]);
                for c in 0..4 {
                    rises[c] |= next[c] > one[c];
                    falls[c] |= next[c] < one[c];
                }
            }
        }
        (0..3).all(|c| !(rises[c] && falls[c]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> Level {
        let texel = |i: u32| [(value(i % width, i / width) * 65535.0) as u16, 30000, 0, 65535];
        Level { width, height, texels: (0..width * height).map(texel).collect() }
    }

    #[test]
    fn fields_and_slopes_are_smooth_and_borders_are_not() {
        let slope = Smooth::of(&level(64, 64, |x, y| 0.2 + 0.004 * x as f32 + 0.006 * y as f32));
        // It does not go on beyond the border, but jumps back.
        assert!(!slope.around(3, 30) && !slope.around(30, 60));
        assert!((8..56).all(|x| (8..56).all(|y| slope.around(x, y))));
        let fields = Smooth::of(&level(64, 64, |x, _| if x < 32 { 0.1 } else { 0.9 }));
        for x in 0..64 {
            let is_far = (8..24).contains(&x) || (40..56).contains(&x);
            assert!((0..64).all(|y| fields.around(x, y) == is_far), "{x}");
        }
    }

    #[test]
    fn noise_and_curves_are_not_smooth() {
        let hash = |x: u32, y: u32| f32::from((((x * 31 + y * 17) * 2_654_435_769_u32) >> 24) as u8) / 255.0;
        assert!(Smooth::of(&level(64, 64, hash)).is_empty());
        assert!(Smooth::of(&level(64, 64, |x, _| (x * x) as f32 / 1024.0 % 1.0)).is_empty());
        // One texel spoils its square and the eight around it.
        let spot = Smooth::of(&level(64, 64, |x, y| if (x, y) == (30, 30) { 0.6 } else { 0.5 }));
        let spoilt = (0..64).filter(|i| !spot.around(i % 8 * 8, i / 8 * 8)).count();
        assert_eq!(spoilt, 9);
    }

    #[test]
    fn steps_of_eight_bits_are_smooth_and_noise_of_one_step_is_not() {
        let step = 1.0 / 255.0;
        let steps = Smooth::of(&level(64, 64, |x, y| ((x + 2 * y) as f32 * 0.1).floor() * step + 0.2));
        assert!((8..56).all(|x| (8..56).all(|y| steps.around(x, y))));
        let odd = |x: u32, y: u32| ((x * 31 + y * 17) * 2_654_435_769_u32) >> 31;
        assert!(Smooth::of(&level(64, 64, |x, y| 0.2 + odd(x, y) as f32 * step)).is_empty());
        let dithered = |x: u32, y: u32| ((x as f32 * 0.1).floor() + odd(x, y) as f32) * step + 0.2;
        assert!(Smooth::of(&level(64, 64, dithered)).is_empty());
    }

    #[test]
    fn squares_that_are_cut_off_are_left_out() {
        let cut = Smooth::of(&level(67, 40, |_, _| 0.5));
        assert!(cut.around(8, 0) && cut.around(55, 39));
        assert!(!cut.around(0, 0) && !cut.around(57, 8) && !cut.around(66, 8) && !cut.around(8, 41));
        assert!(Smooth::of(&level(7, 7, |_, _| 0.5)).is_empty());
    }
}
