//! What tasks find: one block of `result.json` each.

use std::any::Any;
use std::fmt;
use std::sync::Arc;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

/// Finding of a task.
pub trait Finding: fmt::Debug + Send + Sync + 'static {
    /// Key of its block.
    const KEY: &'static str;

    /// What the block contains, in a sentence.
    const ABOUT: &'static str;

    /// Type of the block, for the schema.
    type Block: JsonSchema;

    /// Returns the block.
    fn block(&self) -> Value;
}

/// Makes a type that can be serialised a [`Finding`]: type, key, purpose in a sentence.
#[macro_export]
macro_rules! finding {
    ($type:ty, $key:literal, $about:literal) => {
        impl $crate::Finding for $type {
            const KEY: &'static str = $key;
            const ABOUT: &'static str = $about;
            type Block = Self;

            fn block(&self) -> $crate::Value {
                $crate::to_value(self)
            }
        }
    };
}

/// Block of `result.json` that a task may add.
#[derive(Clone, Copy)]
pub struct BlockKind {
    /// Key.
    pub key: &'static str,
    /// What it contains, in a sentence.
    pub about: &'static str,
    /// Returns the schema.
    pub schema: fn(&mut SchemaGenerator) -> Schema,
}

impl BlockKind {
    /// Creates the kind of the block of a finding.
    pub fn of<F: Finding>() -> Self {
        Self { key: F::KEY, about: F::ABOUT, schema: |generator| generator.subschema_for::<F::Block>() }
    }
}

/// Finding whose type is known to its task alone.
trait AnyFinding: Any + fmt::Debug + Send + Sync {
    fn key(&self) -> &'static str;
    fn block(&self) -> Value;
}

impl<F: Finding> AnyFinding for F {
    fn key(&self) -> &'static str {
        F::KEY
    }

    fn block(&self) -> Value {
        Finding::block(self)
    }
}

/// Findings of a run, at most one of each type.
#[derive(Debug, Clone, Default)]
pub struct Findings(Vec<Arc<dyn AnyFinding>>);

impl Findings {
    /// Adds a finding, in place of an earlier one of its type.
    pub fn add<F: Finding>(&mut self, found: F) {
        let found: Arc<dyn AnyFinding> = Arc::new(found);
        match self.0.iter_mut().find(|known| known.key() == F::KEY) {
            Some(known) => *known = found,
            None => self.0.push(found),
        }
    }

    /// Returns the finding of a type.
    pub fn get<F: Finding>(&self) -> Option<&F> {
        self.0.iter().find_map(|found| {
            let any: &dyn Any = &**found;
            any.downcast_ref()
        })
    }

    /// Removes the finding of a type.
    pub fn remove<F: Finding>(&mut self) {
        self.0.retain(|found| found.key() != F::KEY);
    }
}

impl Serialize for Findings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for found in &self.0 {
            map.serialize_entry(found.key(), &found.block())?;
        }
        map.end()
    }
}

/// Returns a block of `result.json`, for [`finding!`].
#[doc(hidden)]
pub fn to_value<T: Serialize>(of: &T) -> Value {
    serde_json::to_value(of).expect("a finding is JSON")
}
