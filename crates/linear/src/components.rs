//! Strongly connected components of a matrix: groups of states that act on each other.

use nalgebra::DMatrix;

use super::extended::Entry;

/// Returns the groups of indices that reach each other through nonzero entries, ordered by smallest index.
///
/// With the indices in a suitable order the matrix is block triangular, one block per group. Its eigenvalues are then
/// those of the blocks, without rounding between blocks. Hence a chain of integrators has poles at exactly 0, and equal
/// lags in series have equal poles.
///
/// Source: I. S. Duff, J. K. Reid, An implementation of Tarjan's algorithm for the block triangularization of a matrix,
/// ACM Transactions on Mathematical Software 4 (1978) 137-147. The matrices are small, so Warshall's transitive closure
/// is used here.
pub(super) fn strong_components<T: Entry>(a: &DMatrix<T>) -> Vec<Vec<usize>> {
    let n = a.nrows();
    let reaches = paths(a);
    let mut placed = vec![false; n];
    let mut components = Vec::new();
    for i in 0..n {
        if !placed[i] {
            let group: Vec<usize> = (i..n).filter(|&j| j == i || (reaches[(i, j)] && reaches[(j, i)])).collect();
            group.iter().for_each(|&j| placed[j] = true);
            components.push(group);
        }
    }
    components
}

/// Returns for each entry whether nonzero entries lead from its column to its row, over any number of other indices.
pub(super) fn paths<T: Entry>(a: &DMatrix<T>) -> DMatrix<bool> {
    let n = a.nrows();
    let mut reaches = a.map(|x| x != T::ZERO);
    for k in 0..n {
        for i in 0..n {
            if reaches[(i, k)] {
                (0..n).for_each(|j| reaches[(i, j)] |= reaches[(k, j)]);
            }
        }
    }
    reaches
}

/// Returns the block of a matrix with these rows and columns.
pub(super) fn block<T: Entry>(a: &DMatrix<T>, indices: &[usize]) -> DMatrix<T> {
    DMatrix::from_fn(indices.len(), indices.len(), |i, j| a[(indices[i], indices[j])])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_that_act_on_each_other_are_one_component_and_a_chain_is_many() {
        // 0 <-> 2 -> 1 -> 3, and 4 isolated.
        let mut a = DMatrix::zeros(5, 5);
        [(0, 2), (2, 0), (2, 1), (1, 3)].iter().for_each(|&(i, j)| a[(i, j)] = 1.0);
        assert_eq!(strong_components(&a), [vec![0, 2], vec![1], vec![3], vec![4]]);
        assert_eq!(block(&a, &[0, 2]), DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]));
        assert!(strong_components::<f64>(&DMatrix::zeros(0, 0)).is_empty());
    }
}
