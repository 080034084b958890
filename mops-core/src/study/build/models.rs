//! Models of a study while it is built.

use std::sync::Arc;

use crate::model::Model;

pub(super) type Models = [(String, Arc<dyn Model>)];
