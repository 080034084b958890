//! Contents of a study file, independent of its layout, and the data files it reads.

use std::cell::RefCell;
use std::io;

use serde_json::Value;
use toml::de::DeValue;

use mops_language::files::Files;

/// Returns a value of the file, settings included.
pub(super) fn of(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => Value::from(text.as_ref()),
        DeValue::Integer(number) => {
            let digits = number.as_str().replace('_', "");
            i64::from_str_radix(&digits, number.radix()).map_or_else(|_| Value::from(digits), Value::from)
        }
        DeValue::Float(number) => {
            let digits = number.as_str().replace('_', "");
            match digits.parse::<f64>().ok().and_then(serde_json::Number::from_f64) {
                Some(number) => Value::Number(number),
                // Infinity and NaN have no other form.
                None => Value::from(digits),
            }
        }
        DeValue::Boolean(value) => Value::from(*value),
        DeValue::Datetime(when) => Value::from(when.to_string()),
        DeValue::Array(values) => values.iter().map(|value| of(value.get_ref())).collect(),
        DeValue::Table(table) => {
            table.iter().map(|(key, value)| (key.get_ref().to_string(), of(value.get_ref()))).collect()
        }
    }
}

/// Data files, recorded as they are read.
pub(super) struct Listed<'f> {
    inner: &'f dyn Files,
    read: RefCell<Vec<(String, String)>>,
}

impl<'f> Listed<'f> {
    pub fn new(inner: &'f dyn Files) -> Self {
        Self { inner, read: RefCell::default() }
    }

    /// Returns the files read so far, each once, with a digest of its bytes.
    pub fn digests(&self) -> Vec<(String, String)> {
        self.read.borrow().clone()
    }
}

impl Files for Listed<'_> {
    fn list(&self, folder: &str) -> io::Result<Vec<String>> {
        self.inner.list(folder)
    }

    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        let bytes = self.inner.read(path)?;
        let mut read = self.read.borrow_mut();
        if read.iter().all(|(known, _)| known != path) {
            read.push((path.to_owned(), digest(&bytes)));
        }
        Ok(bytes)
    }

    fn show(&self, path: &str) -> String {
        self.inner.show(path)
    }
}

/// Returns the 128-bit FNV-1a hash, in hexadecimal, to detect accidental differences between files.
///
/// Source: G. Fowler, L. C. Noll, K.-P. Vo, The FNV non-cryptographic hash algorithm, IETF draft (2019).
pub fn digest(bytes: &[u8]) -> String {
    const PRIME: u128 = 0x0100_0000_0000_0000_0000_013b;
    let basis = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d_u128;
    format!("{:032x}", bytes.iter().fold(basis, |hash, &byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published test vector of FNV-1a 128 for "foobar".
    #[test]
    fn the_digest_is_the_published_one() {
        assert_eq!(digest(b"foobar"), "343e1662793c64bf6f0d3597ba446f18");
        assert_eq!(digest(b""), "6c62272e07bb014262b821756295c58d");
    }
}
