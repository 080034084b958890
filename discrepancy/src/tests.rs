//! How a search for missing effects goes wrong, one file for each way, on experiments whose truth is known.

mod correlated;
mod signs;
mod starts;
mod tangents;
