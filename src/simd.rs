//! SIMD levels: which the machine has, and the one place where a kernel is compiled for each.
//!
//! Kernels are generic over [`fearless_simd::Simd`]; [`at_level!`] runs one at a level. The plain level is what
//! every machine of an architecture has: on x86-64 SSE2, which its scalar arithmetic uses too, in WebAssembly what it was
//! built for. (Written out number
//! by number, as `fearless_simd`'s fallback is, the kernels took 3 of 4 minutes of the build, and that only for
//! machines that do not exist.) Fuzzers have the plain level alone: the others' sources are the same.

use fearless_simd::Level;

/// A set of vector instructions. It changes the time that a picture takes, and no bit of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SimdLevel {
    /// Nothing beyond what every machine of the architecture has.
    Scalar,
    /// x86-64: 128 bits, SSE4.2.
    Sse42,
    /// x86-64: 256 bits, AVX2.
    Avx2,
    /// x86-64: 512 bits, AVX-512 as of Ice Lake.
    Avx512,
    /// aarch64: 128 bits.
    Neon,
    /// WebAssembly: 128 bits.
    Simd128,
}

impl SimdLevel {
    /// All levels, the narrowest first.
    pub const ALL: [Self; 6] =
        [Self::Scalar, Self::Sse42, Self::Avx2, Self::Avx512, Self::Neon, Self::Simd128];

    /// The widest level that this machine has.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Scalar)
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        self.token().is_some()
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse42 => "sse4.2",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
            Self::Simd128 => "simd128",
        }
    }

    /// What the kernels take; scalar where the machine lacks the level.
    pub(crate) fn level(self) -> Level {
        self.token().unwrap_or(plain())
    }

    fn token(self) -> Option<Level> {
        #[allow(unused_variables, reason = "where there is only the plain level nothing asks for the best")]
        let best = Level::new();
        match self {
            Self::Scalar => Some(plain()),
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            Self::Sse42 => best.as_sse4_2().map(Level::Sse4_2),
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            Self::Avx2 => best.as_avx2().map(Level::Avx2),
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            Self::Avx512 => best.as_avx512().map(Level::Avx512),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => best.as_neon().map(Level::Neon),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => best.as_wasm_simd128().map(Level::WasmSimd128),
            _ => None,
        }
    }
}

fn plain() -> Level {
    #[cfg(target_arch = "x86_64")]
    if let Some(level) = Level::new().as_sse2() {
        return Level::Sse2(level);
    }
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    if let Some(level) = Level::new().as_wasm_simd128() {
        return Level::WasmSimd128(level);
    }
    Level::Fallback(fearless_simd::Fallback::new())
}

/// Makes the function that this is inlined into align its frame to 64 bytes.
///
/// Where registers run out, the compiler sees too late that what it puts into the frame wants to be aligned. Most loads
/// and stores of 64 bytes then lie across two lines of the cache, or none do, as the callers' frames happen to end: a
/// change elsewhere made the city 11 % slower, the sorting into groups two times. What wants to be aligned from the start
/// makes it the best of these, and 3 to 6 % better (city, Sponza).
#[cfg(all(target_arch = "x86_64", not(fuzzing)))]
#[inline(always)]
pub(crate) fn align_frame() {
    #[repr(align(64))]
    struct Aligned([u8; 1]);
    let mut anchor = Aligned([0]);
    std::hint::black_box(&mut anchor.0);
}

/// Runs an expression, compiled for the instructions of a level, with `simd` standing for them.
macro_rules! at_level {
    ($level:expr, $simd:ident => $run:expr) => {
        match $level {
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            fearless_simd::Level::Avx512($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || {
                    $crate::simd::align_frame();
                    $run
                },
            ),
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            fearless_simd::Level::Avx2($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || {
                    $crate::simd::align_frame();
                    $run
                },
            ),
            #[cfg(all(target_arch = "x86_64", not(fuzzing)))]
            fearless_simd::Level::Sse4_2($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            #[cfg(target_arch = "aarch64")]
            fearless_simd::Level::Neon($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            fearless_simd::Level::WasmSimd128($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            #[cfg(target_arch = "x86_64")]
            fearless_simd::Level::Sse2($simd) => fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $run,
            ),
            // No machine that this is compiled for comes here.
            #[cfg(any(target_arch = "x86_64", target_feature = "simd128"))]
            _ => Default::default(),
            #[cfg(not(any(target_arch = "x86_64", target_feature = "simd128")))]
            _ => {
                let $simd = fearless_simd::Fallback::new();
                fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $run,
                )
            }
        }
    };
}
pub(crate) use at_level;

/// Runs an expression of a kernel as a function of its own.
///
/// Without optimisation each value of what is inlined has a place of its own in the frame: shading took 2 to 3.5 MB, more than the
/// 2 MiB of stack that a thread has. With it the slowest frames are of 1.6 MB (SSE2), and optimised pictures take 0.95 to 1.02 of the time.
macro_rules! apart {
    ($simd:ident, $run:expr) => {
        fearless_simd::Simd::vectorize(
            $simd,
            #[inline(always)]
            || $run,
        )
    };
}
pub(crate) use apart;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_level_is_there_and_has_a_name_of_its_own() {
        assert!(SimdLevel::best().is_available() && SimdLevel::Scalar.is_available());
        for (i, level) in SimdLevel::ALL.into_iter().enumerate() {
            assert!(SimdLevel::ALL[..i].iter().all(|other| other.name() != level.name()));
        }
    }
}
