//! Loops in the widest registers that the processor has.
//!
//! Nothing is computed otherwise than in narrow ones: no sum is reordered, no product fused by that.

// Inlined, a loop runs in the registers of who calls it; called, in those that every processor has.
#![allow(clippy::inline_always)]

use pulp::{Arch, Simd, WithSimd};

struct Wide<F>(F);

// A closure given to `dispatch` as it is runs behind a shim that is not inlined, in the registers that
// every processor has.
impl<R, F: FnMut() -> R> WithSimd for Wide<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}

/// Runs an `#[inline(always)]` closure in the widest registers that the processor has.
#[inline(always)]
pub(crate) fn wide<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Wide(work))
}
