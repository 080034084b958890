//! Numbers as bytes: little-endian, bit by bit, so that what is read is what was computed.

use mops_core::{RowSlopes, Value};

/// The bytes of numbers.
pub(super) fn of_numbers(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// The numbers that bytes stand for; what is left over is no number.
pub(super) fn numbers(bytes: &[u8]) -> Vec<f64> {
    let number = |chunk: &[u8]| f64::from_le_bytes(chunk.try_into().expect("chunks of eight"));
    bytes.chunks_exact(8).map(number).collect()
}

/// The tuners by which a point is known: minus zero, to which small negative numbers round, is zero.
pub(super) fn key(tuners: &[f64]) -> Vec<u64> {
    tuners.iter().map(|value| (value + 0.0).to_bits()).collect()
}

/// The bytes of a key.
pub(super) fn of_key(key: &[u64]) -> Vec<u8> {
    key.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Lists of numbers that belong to rows: for each the row, the length, the numbers.
pub(super) fn of_lists<'a>(lists: impl Iterator<Item = (usize, &'a [f64])>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (row, numbers) in lists {
        bytes.extend((row as u64).to_le_bytes());
        bytes.extend((numbers.len() as u64).to_le_bytes());
        bytes.extend(of_numbers(numbers));
    }
    bytes
}

/// The lists that bytes stand for; `None` where they are cut short.
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

/// Derivatives of rows: for each coordinate a list that begins with the derivative of the value.
pub(super) fn of_slopes(slopes: &RowSlopes) -> Vec<u8> {
    let lists: Vec<(usize, Vec<f64>)> = (slopes.iter())
        .flat_map(|(row, along)| {
            along.iter().map(move |slope| (*row, [&[slope.number], &slope.residuals[..]].concat()))
        })
        .collect();
    of_lists(lists.iter().map(|(row, numbers)| (*row, numbers.as_slice())))
}

/// The derivatives that bytes stand for; `None` where they are cut short.
pub(super) fn slopes(bytes: &[u8]) -> Option<RowSlopes> {
    let mut slopes = RowSlopes::new();
    for (row, numbers) in lists(bytes)? {
        let (number, residuals) = numbers.split_first()?;
        let slope = Value { number: *number, residuals: residuals.to_vec(), ..Value::default() };
        match slopes.last_mut().filter(|(last, _)| *last == row) {
            Some((_, along)) => along.push(slope),
            None => slopes.push((row, vec![slope])),
        }
    }
    Some(slopes)
}

fn word(rest: &mut &[u8]) -> Option<usize> {
    let (word, after) = rest.split_at_checked(8)?;
    *rest = after;
    usize::try_from(u64::from_le_bytes(word.try_into().ok()?)).ok()
}
