//! Sobol sequence: points that fill the unit cube evenly.

/// Largest number of tabulated dimensions.
pub const MOST_DIMENSIONS: usize = 21;

/// Number of bits of a coordinate.
const BITS: usize = 32;

/// Degree of the primitive polynomial, its inner coefficients as bits, and the first direction numbers, from the second
/// dimension on.
///
/// Source: S. Joe, F. Y. Kuo, Constructing Sobol sequences with better two-dimensional projections, SIAM Journal on
/// Scientific Computing 30 (2008) 2635-2654; table new-joe-kuo-6.21201.
const TABLE: [(usize, u32, &[u32]); MOST_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// Returns the first `count` points in `dimensions` dimensions, as 32-bit fractions, in Gray-code order; the first is
/// the origin.
///
/// In this order each point differs from its predecessor by one direction number. Source: that of the table; I. A.
/// Antonov, V. M. Saleev, USSR Computational Mathematics and Mathematical Physics 19 (1979) 252-256 (Gray-code order).
///
/// # Panics
/// For more than [`MOST_DIMENSIONS`] dimensions.
pub fn sobol_sequence(count: usize, dimensions: usize) -> Vec<Vec<u32>> {
    let directions: Vec<[u32; BITS]> = (0..dimensions).map(directions).collect();
    let mut point = vec![0; dimensions];
    (0..count)
        .map(|i| {
            if i > 0 {
                let changed = (i - 1).trailing_ones() as usize;
                point.iter_mut().zip(&directions).for_each(|(x, v)| *x ^= v[changed]);
            }
            point.clone()
        })
        .collect()
}

/// Returns the direction numbers `v_k = m_k 2^-k`, with
/// `m_k = 2 a_1 m_(k-1) ^ 4 a_2 m_(k-2) ^ ... ^ 2^(s-1) a_(s-1) m_(k-s+1) ^ 2^s m_(k-s) ^ m_(k-s)`.
fn directions(dimension: usize) -> [u32; BITS] {
    assert!(dimension < MOST_DIMENSIONS, "a Sobol sequence has at most {MOST_DIMENSIONS} dimensions here");
    let mut m = [1u32; BITS];
    if dimension > 0 {
        let (degree, coefficients, first) = TABLE[dimension - 1];
        m[..degree].copy_from_slice(first);
        for k in degree..BITS {
            m[k] = m[k - degree] ^ (m[k - degree] << degree);
            for i in 1..degree {
                if coefficients >> (degree - 1 - i) & 1 == 1 {
                    m[k] ^= m[k - i] << i;
                }
            }
        }
    }
    std::array::from_fn(|k| m[k] << (BITS - 1 - k))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the points published with the authors' generator for three dimensions.
    #[test]
    fn the_first_points_are_the_published_ones() {
        let found: Vec<Vec<f64>> = sobol_sequence(8, 3)
            .into_iter()
            .map(|point| point.into_iter().map(|x| f64::from(x) / 4_294_967_296.0).collect())
            .collect();
        let published = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
        ];
        assert_eq!(found, published);
    }

    /// Checks that of `2^k` points one lies in each of `2^k` equal intervals; a wrong direction number would break
    /// this.
    #[test]
    fn every_coordinate_of_a_power_of_two_of_points_fills_its_axis_evenly() {
        for k in [1u32, 4, 7, 10] {
            let points = sobol_sequence(1 << k, MOST_DIMENSIONS);
            for j in 0..MOST_DIMENSIONS {
                let mut cells: Vec<u32> = points.iter().map(|point| point[j] >> (32 - k)).collect();
                cells.sort_unstable();
                assert!(cells.iter().enumerate().all(|(i, &cell)| i == cell as usize), "dimension {j}, 2^{k} points");
            }
        }
    }
}
