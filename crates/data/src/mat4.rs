//! MATLAB level 4 reader: consecutive matrices, each with a header of five 32-bit integers.

use mops_language::Diagnostic;

use super::matlab::{Contents, Cursor, Kind, cut_off};

/// Matrix header: type, rows, columns, imaginary flag, length of the name with its final zero.
///
/// The type is `1000 M + 100 O + 10 P + T` (M: byte order, O: 0, P: number format, T: matrix kind). Source: MathWorks,
/// MAT-File Format (2015), chapter 2, "Level 4 MAT-Files".
struct Header {
    kind: Kind,
    matrix: u32,
    rows: usize,
    columns: usize,
    complex: bool,
    name_length: usize,
}

impl Header {
    const TEXT: u32 = 1;
    const SPARSE: u32 = 2;

    /// Reads the header at `cursor` and sets the cursor's byte order; `None` if there is no header.
    fn read(cursor: &mut Cursor<'_>) -> Option<Self> {
        // The type is below 5000 in exactly one of the two byte orders, which M states.
        cursor.big_endian = u32::from_le_bytes(*cursor.rest.first_chunk()?) >= 5000;
        let code = cursor.u32()?;
        let [rows, columns, imaginary, name_length] = [cursor.u32()?, cursor.u32()?, cursor.u32()?, cursor.u32()?];
        let order_fits = code / 1000 == u32::from(cursor.big_endian) && code / 100 % 10 == 0;
        let is_size = |size: u32| i32::try_from(size).is_ok();
        if !order_fits || !is_size(rows) || !is_size(columns) || imaginary > 1 || !is_size(name_length) {
            return None;
        }
        let kind = [Kind::F64, Kind::F32, Kind::I32, Kind::I16, Kind::U16, Kind::U8];
        Some(Self {
            kind: *kind.get((code / 10 % 10) as usize)?,
            matrix: code % 10,
            rows: rows as usize,
            columns: columns as usize,
            complex: imaginary == 1,
            name_length: name_length as usize,
        })
    }

    /// Returns the number of bytes of the numbers after the name.
    fn size(&self) -> Option<usize> {
        let parts = if self.complex { 2 } else { 1 };
        self.rows.checked_mul(self.columns)?.checked_mul(self.kind.size())?.checked_mul(parts)
    }
}

/// Returns true if the file starts like a level 4 file. Text never does: two of its first four bytes would be zero.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    Header::read(&mut Cursor { rest: bytes, big_endian: false }).is_some()
}

/// Reads every real numeric matrix.
///
/// # Errors
/// If the file ends too early, or lacks a header where one is required.
pub(super) fn read(bytes: &[u8]) -> Result<Contents, Diagnostic> {
    let mut contents = Contents::default();
    let mut cursor = Cursor { rest: bytes, big_endian: false };
    for variable in 1.. {
        if cursor.rest.is_empty() {
            break;
        }
        read_matrix(&mut cursor, variable, &mut contents)?;
    }
    Ok(contents)
}

fn read_matrix(cursor: &mut Cursor<'_>, variable: usize, contents: &mut Contents) -> Result<(), Diagnostic> {
    if cursor.rest.len() < 20 {
        return Err(cut_off(variable));
    }
    let header = Header::read(cursor).ok_or_else(|| {
        Diagnostic::new(format!("the file is damaged: variable {variable} has no MATLAB level 4 header"))
            .with_help("copy it again, or save it again")
    })?;
    let name = cursor.take(header.name_length).ok_or_else(|| cut_off(variable))?;
    let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
    let name = String::from_utf8_lossy(name).into_owned();
    let numbers = header.size().and_then(|size| cursor.take(size)).ok_or_else(|| cut_off(variable))?;
    match header.matrix {
        Header::TEXT => contents.skip(&name, "text"),
        Header::SPARSE => contents.skip(&name, "a sparse matrix"),
        0 if header.complex => contents.skip(&name, "complex numbers"),
        0 => contents.push(name, header.rows, header.columns, header.kind.numbers(numbers, cursor.big_endian)),
        other => contents.skip(&name, &format!("a matrix of unknown kind {other}")),
    }
    Ok(())
}
