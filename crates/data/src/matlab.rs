//! Common parts of the readers of both MATLAB levels: byte order, number formats, variables.

use mops_language::Diagnostic;

use super::Variable;

/// Returns true for a level 7.3 (HDF5) file. The HDF5 signature is at the start, or after the 512 bytes that MATLAB
/// adds, which end with version 2.
pub(super) fn is_level_7_3(bytes: &[u8]) -> bool {
    let signature = b"\x89HDF\r\n\x1a\n";
    let text = b"MATLAB 7.3 MAT-file";
    bytes.starts_with(signature)
        || bytes.starts_with(text)
        || bytes.get(512..).is_some_and(|tail| tail.starts_with(signature))
        || bytes.get(124..128).is_some_and(|end| end == b"\x00\x02IM" || end == b"\x02\x00MI")
}

/// Remaining bytes and their byte order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cursor<'a> {
    pub rest: &'a [u8],
    pub big_endian: bool,
}

impl<'a> Cursor<'a> {
    /// Returns the next `count` bytes, or `None` if fewer remain.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.rest.split_at_checked(count)?;
        self.rest = tail;
        Some(head)
    }

    pub fn u32(&mut self) -> Option<u32> {
        let bytes = self.take(4)?.try_into().expect("`take` returns four bytes");
        Some(if self.big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }
}

/// Storage format of numbers.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// Returns the number of bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub fn numbers(self, bytes: &[u8], big_endian: bool) -> Vec<f64> {
        match self {
            Self::I8 => decode(bytes, big_endian, |b| i8::from_le_bytes(b).into()),
            Self::U8 => decode(bytes, big_endian, |b| u8::from_le_bytes(b).into()),
            Self::I16 => decode(bytes, big_endian, |b| i16::from_le_bytes(b).into()),
            Self::U16 => decode(bytes, big_endian, |b| u16::from_le_bytes(b).into()),
            Self::I32 => decode(bytes, big_endian, |b| i32::from_le_bytes(b).into()),
            Self::U32 => decode(bytes, big_endian, |b| u32::from_le_bytes(b).into()),
            Self::I64 => decode(bytes, big_endian, |b| i64::from_le_bytes(b) as f64),
            Self::U64 => decode(bytes, big_endian, |b| u64::from_le_bytes(b) as f64),
            Self::F32 => decode(bytes, big_endian, |b| f32::from_le_bytes(b).into()),
            Self::F64 => decode(bytes, big_endian, f64::from_le_bytes),
        }
    }
}

fn decode<const N: usize>(bytes: &[u8], big_endian: bool, little: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let (numbers, _) = bytes.as_chunks();
    let read = |mut number: [u8; N]| {
        if big_endian {
            number.reverse();
        }
        little(number)
    };
    numbers.iter().copied().map(read).collect()
}

/// Contents of a file.
#[derive(Debug, Default)]
pub(super) struct Contents {
    variables: Vec<Variable>,
    skipped: Vec<String>,
    skipped_unnamed: usize,
}

impl Contents {
    /// Largest number of skipped variables listed by name, since a small file can contain very many empty cells.
    const SKIPPED_BY_NAME: usize = 1000;

    /// Adds a matrix; each row is a sample.
    pub fn push(&mut self, name: String, rows: usize, columns: usize, values: Vec<f64>) {
        if values.is_empty() {
            self.skip(&name, "empty");
        } else if rows < columns {
            let turned = (0..rows).flat_map(|row| values.iter().skip(row).step_by(rows)).copied().collect();
            self.variables.push(Variable {
                name,
                unit: None,
                rows: columns,
                columns: rows,
                values: turned,
                origin: None,
            });
        } else {
            self.variables.push(Variable { name, unit: None, rows, columns, values, origin: None });
        }
    }

    pub fn skip(&mut self, name: &str, reason: &str) {
        if self.skipped.len() < Self::SKIPPED_BY_NAME {
            self.skipped.push(format!("{name}: {reason}"));
        } else {
            self.skipped_unnamed += 1;
        }
    }

    /// Returns the variables, and the skipped ones with reasons.
    pub fn finish(mut self) -> (Vec<Variable>, Vec<String>) {
        if self.skipped_unnamed > 0 {
            self.skipped.push(format!("and {} more", self.skipped_unnamed));
        }
        (self.variables, self.skipped)
    }
}

/// Returns the error for a file that is shorter than its sizes state, or for an invalid size.
pub(super) fn cut_off(variable: usize) -> Diagnostic {
    Diagnostic::new(format!("the file ends inside variable {variable}: it is cut off or damaged"))
        .with_help("copy it again, or save it again")
}
