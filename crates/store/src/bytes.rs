//! Conversion of numbers to little-endian bytes, without loss of bits.

use mops_core::{Value, run::RowSlopes};

/// Converts numbers to bytes.
pub(super) fn of_numbers(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Converts bytes to numbers; an incomplete number at the end is ignored.
pub(super) fn numbers(bytes: &[u8]) -> Vec<f64> {
    let number = |chunk: &[u8]| f64::from_le_bytes(chunk.try_into().expect("chunks of eight"));
    bytes.chunks_exact(8).map(number).collect()
}

/// Returns the key of a point: the bits of its tuners, with negative zero, to which small numbers round, replaced by
/// zero.
pub(super) fn key(tuners: &[f64]) -> Vec<u64> {
    tuners.iter().map(|value| (value + 0.0).to_bits()).collect()
}

/// Converts a key to bytes.
pub(super) fn of_key(key: &[u64]) -> Vec<u8> {
    key.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Converts lists of numbers to bytes: for each list the row, the length, the numbers.
pub(super) fn of_lists<'a>(lists: impl Iterator<Item = (usize, &'a [f64])>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (row, numbers) in lists {
        bytes.extend((row as u64).to_le_bytes());
        bytes.extend((numbers.len() as u64).to_le_bytes());
        bytes.extend(of_numbers(numbers));
    }
    bytes
}

/// Converts bytes to lists of numbers; returns `None` if they are truncated.
pub(super) fn lists(bytes: &[u8]) -> Option<Vec<(usize, Vec<f64>)>> {
    let mut rest = bytes;
    let mut lists = Vec::new();
    while !rest.is_empty() {
        let row = word(&mut rest)?;
        let length = word(&mut rest)?.checked_mul(8)?;
        let (of_list, after) = rest.split_at_checked(length)?;
        lists.push((row, numbers(of_list)));
        rest = after;
    }
    Some(lists)
}

/// Converts derivatives of rows to bytes: for each row a list with one derivative per coordinate.
pub(super) fn of_slopes(slopes: &RowSlopes) -> Vec<u8> {
    let numbers = |along: &Vec<Value>| along.iter().map(|slope| slope.number).collect::<Vec<f64>>();
    let lists: Vec<(usize, Vec<f64>)> = slopes.iter().map(|(row, along)| (*row, numbers(along))).collect();
    of_lists(lists.iter().map(|(row, numbers)| (*row, numbers.as_slice())))
}

/// Converts bytes to derivatives; returns `None` if they are truncated.
pub(super) fn slopes(bytes: &[u8]) -> Option<RowSlopes> {
    let of_row = |(row, numbers): (usize, Vec<f64>)| (row, numbers.into_iter().map(Value::from).collect());
    Some(lists(bytes)?.into_iter().map(of_row).collect())
}

fn word(rest: &mut &[u8]) -> Option<usize> {
    let (word, after) = rest.split_at_checked(8)?;
    *rest = after;
    usize::try_from(u64::from_le_bytes(word.try_into().ok()?)).ok()
}
