//! Columns of a sparse matrix that share no row.

/// Partitions the columns of a square matrix, given by the rows of their nonzero entries, into groups in which no two
/// share a row; each column joins the first group that fits. Finite differences perturb the columns of a group
/// together.
///
/// Source: A. Curtis, M. Powell, J. Reid, Journal of the Institute of Mathematics and its Applications 13 (1974)
/// 117-119.
#[must_use]
pub fn column_groups(rows: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut groups: Vec<(Vec<usize>, Vec<bool>)> = Vec::new();
    for (column, of_column) in rows.iter().enumerate() {
        let fits = |(_, taken): &&mut (Vec<usize>, Vec<bool>)| of_column.iter().all(|&row| !taken[row]);
        let group = match groups.iter_mut().find(fits) {
            Some(group) => group,
            None => {
                groups.push((Vec::new(), vec![false; rows.len()]));
                groups.last_mut().expect("one was pushed")
            }
        };
        group.0.push(column);
        of_column.iter().for_each(|&row| group.1[row] = true);
    }
    groups.into_iter().map(|(columns, _)| columns).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_share_no_row_are_grouped() {
        let tridiagonal: Vec<Vec<usize>> =
            (0..9_usize).map(|j| (j.saturating_sub(1)..=(j + 1).min(8)).collect()).collect();
        assert_eq!(column_groups(&tridiagonal).len(), 3);
    }
}
