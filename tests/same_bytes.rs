//! The same bytes for every number of threads and every SIMD level. That debug and release builds and WebAssembly agree
//! is checked by `.ci/run`, with the same hashes.

#[path = "common/hashes.rs"]
mod hashes;

use groundglass::render::SimdLevel;

#[test]
fn threads_and_simd_levels_change_no_byte() {
    let first = hashes::all(Some(1), Some(SimdLevel::Scalar)).unwrap();
    print!("{first}");
    assert!(first.lines().count() > 20);
    for level in SimdLevel::ALL.into_iter().filter(|level| !level.is_available()) {
        println!("skipped: this machine has no {}", level.name());
    }
    for threads in [1, 2, 3, 8] {
        for simd in SimdLevel::ALL.into_iter().filter(|level| level.is_available()) {
            let found = hashes::all(Some(threads), Some(simd)).unwrap();
            assert_eq!(found, first, "{threads} threads, {}", simd.name());
            println!("{threads} threads, {}: the same", simd.name());
        }
    }
}
