//! Loops over a known number of states.

/// Evaluates an expression with the constant `$N`: the number of states where it is small and there are no tangents.
/// Otherwise `$N` is 0, which means any number. The compiler unrolls loops over a known number of states.
macro_rules! by_size {
    ($states:expr, $S:ty, $N:ident => $body:expr) => {
        match if <$S as mops_language::Scalar>::DIRECTIONS == 0 { $states } else { 0 } {
            1 => {
                const $N: usize = 1;
                $body
            }
            2 => {
                const $N: usize = 2;
                $body
            }
            3 => {
                const $N: usize = 3;
                $body
            }
            4 => {
                const $N: usize = 4;
                $body
            }
            5 => {
                const $N: usize = 5;
                $body
            }
            6 => {
                const $N: usize = 6;
                $body
            }
            _ => {
                const $N: usize = 0;
                $body
            }
        }
    };
}

pub(super) use by_size;
