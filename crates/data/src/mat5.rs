//! MATLAB level 5 reader: elements with a tag of type and size, plain or compressed, and arrays in cell arrays.

use mops_language::Diagnostic;

use super::Variable;
use super::matlab::{Contents, Cursor, Kind, cut_off};

// Element types and array classes. Source: MathWorks, MAT-File Format (2015), chapter 1, tables 1-1 and 1-3.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const CELL: u32 = 1;
const DOUBLE: u32 = 6;
const UINT64: u32 = 15;
const OPAQUE: u32 = 17;
const COMPLEX: u32 = 0x0800;

/// Length of text, version and byte order before the first element, in bytes.
const HEADER: usize = 128;
/// Largest number of bytes for decompressed data and numbers of a small file.
const GROWTH: usize = 1 << 30;
/// Longest name of a variable, in bytes. MATLAB names have at most 63 characters; a cell repeats the name once per
/// element.
const LONGEST_NAME: usize = 255;
/// Largest nesting depth of cells, a bound for the recursion.
const DEEPEST: usize = 32;

const DAMAGED: &str = "damaged";

/// Returns true if the file starts like a level 5 file: the header ends with version 1 and `MI` in the writer's byte
/// order.
pub(super) fn recognises(bytes: &[u8]) -> bool {
    match bytes.get(124..HEADER) {
        Some(end) => end == b"\x00\x01IM" || end == b"\x01\x00MI",
        None => bytes.starts_with(b"MATLAB 5.0 MAT-file"),
    }
}

/// Reads every real numeric matrix, including those in cell arrays. Unreadable variables are skipped.
///
/// # Errors
/// If the file ends too early.
pub(super) fn read(bytes: &[u8]) -> Result<Contents, Diagnostic> {
    read_within(bytes, GROWTH.max(bytes.len().saturating_mul(8)))
}

/// Reads like [`read`], with a budget in bytes for decompressed data and numbers.
pub(super) fn read_within(bytes: &[u8], budget: usize) -> Result<Contents, Diagnostic> {
    let rest = bytes.get(HEADER..).ok_or_else(|| cut_off(1))?;
    let mut cursor = Cursor { rest, big_endian: bytes[HEADER - 2..].starts_with(b"MI") };
    let mut reader = Reader { budget, contents: Contents::default() };
    let mut variable = 1;
    while cursor.rest.iter().take(4).any(|byte| *byte != 0) {
        let (tag, data) = element(&mut cursor).ok_or_else(|| cut_off(variable))?;
        reader.variable(tag, Cursor { rest: data, ..cursor }, &format!("variable {variable}"));
        variable += 1;
    }
    // Some writers pad the file with zeros.
    if cursor.rest.iter().all(|byte| *byte == 0) { Ok(reader.contents) } else { Err(cut_off(variable)) }
}

struct Reader {
    budget: usize,
    contents: Contents,
}

impl Reader {
    fn variable(&mut self, tag: u32, data: Cursor<'_>, place: &str) {
        let done = match tag {
            MATRIX => self.array(data, place, 0),
            COMPRESSED => self.compressed(data, place),
            other => Err(format!("an element of unknown type {other}")),
        };
        done.unwrap_or_else(|reason| self.contents.skip(place, &reason));
    }

    fn compressed(&mut self, data: Cursor<'_>, place: &str) -> Result<(), String> {
        let inflated = inflated(data.rest, self.budget)?;
        self.charge(inflated.len())?;
        match element(&mut Cursor { rest: &inflated, ..data }) {
            Some((MATRIX, array)) => self.array(Cursor { rest: array, ..data }, place, 0),
            _ => Err(DAMAGED.to_owned()),
        }
    }

    /// Adds an array. `place` is its name in a cell (`depth > 0`), otherwise the name for an unnamed array.
    fn array(&mut self, data: Cursor<'_>, place: &str, depth: usize) -> Result<(), String> {
        if data.rest.is_empty() {
            return Err("empty".to_owned());
        }
        let array = Array::read(data).ok_or(DAMAGED)?;
        if depth == 0 && array.name.is_empty() {
            // Internal arrays of MATLAB objects have no name.
            return Ok(());
        }
        let name = if depth == 0 { &array.name } else { place };
        let done = match array.class {
            CELL => self.cells(&array, name, depth),
            DOUBLE..=UINT64 => self.matrix(&array, name),
            other => Err(what_is(other)),
        };
        done.unwrap_or_else(|reason| self.contents.skip(name, &reason));
        Ok(())
    }

    fn matrix(&mut self, array: &Array<'_>, name: &str) -> Result<(), String> {
        if array.complex {
            return Err("complex numbers".to_owned());
        }
        let &[rows, columns] = array.sizes.as_slice() else {
            return Err(format!("an array with {} dimensions", array.sizes.len()));
        };
        let mut data = array.data;
        let (tag, numbers) = element(&mut data).ok_or(DAMAGED)?;
        let kind = kind_of(tag).ok_or_else(|| format!("numbers of unknown type {tag}"))?;
        let count = rows.checked_mul(columns).ok_or(DAMAGED)?;
        if count.checked_mul(kind.size()) != Some(numbers.len()) {
            return Err(DAMAGED.to_owned());
        }
        self.charge(count.saturating_mul(size_of::<f64>()))?;
        self.contents.push(name.to_owned(), rows, columns, kind.numbers(numbers, data.big_endian));
        Ok(())
    }

    fn cells(&mut self, array: &Array<'_>, name: &str, depth: usize) -> Result<(), String> {
        if depth == DEEPEST {
            return Err(format!("cells nested deeper than {DEEPEST}"));
        }
        let count = array.sizes.iter().try_fold(1_usize, |count, size| count.checked_mul(*size)).ok_or(DAMAGED)?;
        if count == 0 {
            return Err("empty".to_owned());
        }
        let mut data = array.data;
        for k in 1..=count {
            let Some((MATRIX, cell)) = element(&mut data) else {
                return Err(format!("damaged from element {k} on"));
            };
            // A cell takes few compressed bytes, but each costs a name and time.
            self.charge(size_of::<Variable>())?;
            let name = format!("{name}{{{k}}}");
            let done = self.array(Cursor { rest: cell, ..data }, &name, depth + 1);
            done.unwrap_or_else(|reason| self.contents.skip(&name, &reason));
        }
        Ok(())
    }

    fn charge(&mut self, bytes: usize) -> Result<(), String> {
        self.budget = self.budget.checked_sub(bytes).ok_or("too large in memory")?;
        Ok(())
    }
}

/// Array up to the start of its data.
struct Array<'a> {
    class: u32,
    complex: bool,
    sizes: Vec<usize>,
    name: String,
    data: Cursor<'a>,
}

impl<'a> Array<'a> {
    fn read(mut data: Cursor<'a>) -> Option<Self> {
        let (_, flags) = element(&mut data)?;
        let flags = Cursor { rest: flags, ..data }.u32()?;
        let class = flags & 0xff;
        // N.B.: an opaque object has no sizes; its name follows directly.
        let sizes = if class == OPAQUE { Vec::new() } else { sizes(&mut data)? };
        let (_, name) = element(&mut data)?;
        if name.len() > LONGEST_NAME {
            return None;
        }
        let name = String::from_utf8_lossy(name).into_owned();
        Some(Self { class, complex: flags & COMPLEX != 0, sizes, name, data })
    }
}

fn sizes(data: &mut Cursor<'_>) -> Option<Vec<usize>> {
    let (_, sizes) = element(data)?;
    let mut sizes = Cursor { rest: sizes, ..*data };
    std::iter::from_fn(|| sizes.u32()).map(|size| usize::try_from(size).ok()).collect()
}

/// Returns type and data of the next element, or `None` if it exceeds the remaining bytes.
fn element<'a>(cursor: &mut Cursor<'a>) -> Option<(u32, &'a [u8])> {
    let word = cursor.u32()?;
    if word >> 16 != 0 {
        // Small element: size and type in one word, up to four bytes of data in the next.
        let data = cursor.take(4)?;
        return Some((word & 0xffff, data.get(..(word >> 16) as usize)?));
    }
    let size = usize::try_from(cursor.u32()?).ok()?;
    let data = cursor.take(size)?;
    if word != COMPRESSED {
        // N.B.: some files omit the padding of the last element.
        let padding = (8 - size % 8) % 8;
        cursor.take(padding.min(cursor.rest.len()));
    }
    Some((word, data))
}

fn kind_of(tag: u32) -> Option<Kind> {
    Some(match tag {
        1 => Kind::I8,
        2 => Kind::U8,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::I32,
        6 => Kind::U32,
        7 => Kind::F32,
        9 => Kind::F64,
        12 => Kind::I64,
        13 => Kind::U64,
        _ => return None,
    })
}

fn what_is(class: u32) -> String {
    match class {
        2 => "a struct".to_owned(),
        3 => "an object".to_owned(),
        4 => "text".to_owned(),
        5 => "a sparse matrix".to_owned(),
        16 => "a function".to_owned(),
        OPAQUE => "an object (table, string, datetime or the like)".to_owned(),
        other => format!("an array of unknown class {other}"),
    }
}

/// Decompresses at most `limit + 1` bytes.
#[cfg(feature = "compressed-mat")]
fn inflated(compressed: &[u8], limit: usize) -> Result<Vec<u8>, String> {
    use std::io::Read;

    let mut inflated = Vec::new();
    let mut decoder = flate2::read::ZlibDecoder::new(compressed).take((limit as u64).saturating_add(1));
    match decoder.read_to_end(&mut inflated) {
        Ok(_) => Ok(inflated),
        Err(error) => Err(format!("damaged: decompression failed ({error})")),
    }
}

/// Refuses compressed variables: the decoder is not part of this build.
#[cfg(not(feature = "compressed-mat"))]
fn inflated(_: &[u8], _: usize) -> Result<Vec<u8>, String> {
    Err("compressed, which this build cannot read (feature `compressed-mat`)".to_owned())
}
