//! The whole way from a study to a diagnosis.
