//! Front to back: keys in, the places of their owners in rising order out.
//!
//! In: for each candidate of [`super::bin`] the depth `z` of its nearest corner, and its place. Out: the places, nearest first,
//! equal ones as they came, for [`super::tile_lists`]. The key is the bits of `max(0, z)`, sorted by eleven of them at a time, lowest
//! first.

/// Bits of a key that one pass sorts by.
const DIGIT: u32 = 11;

/// What a depth sorts by: positive floats order as their bits do. Behind the lens all are equally near.
pub(super) fn key(depth: f64) -> u32 {
    (depth.max(0.0) as f32).to_bits()
}

/// The places of (key, place) by rising key, equal ones in their order.
pub(super) fn by_key(mut sorted: Vec<(u32, u32)>) -> Vec<u32> {
    const BINS: usize = 1 << DIGIT;
    let digit = |key: u32, pass: usize| (key >> (DIGIT * pass as u32)) as usize % BINS;
    let mut counts = [[0u32; BINS]; 3];
    for &(key, _) in &sorted {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(key, pass)] += 1;
        }
    }
    let mut spare = vec![(0, 0); sorted.len()];
    for (pass, counts) in counts.iter_mut().enumerate() {
        let mut next = 0;
        for count in counts.iter_mut() {
            next += std::mem::replace(count, next);
        }
        for &pair in &sorted {
            let place = &mut counts[digit(pair.0, pass)];
            spare[*place as usize] = pair;
            *place += 1;
        }
        std::mem::swap(&mut sorted, &mut spare);
    }
    sorted.into_iter().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn nearest_come_first_and_equals_stay_in_order() {
        let mut random = Random(9);
        let keys: Vec<u32> = (0..5000)
            .map(|i| {
                let depth = (random.bits() >> 40) as f64 * 0.37;
                if i % 3 == 0 { key(-1.0) } else { key(depth) }
            })
            .collect();
        let mut wanted: Vec<u32> = (0..5000).collect();
        wanted.sort_by_key(|&place| keys[place as usize]);
        assert_eq!(by_key(keys.into_iter().zip(0..).collect()), wanted);
        assert!(by_key(Vec::new()).is_empty());
    }
}
