//! How a search for missing effects goes wrong, one file for each way, on experiments whose truth is known.

mod absorbed;
mod aligned;
mod bounds;
mod candidates;
mod correlated;
mod derivatives;
mod drawn;
mod holds;
mod interrupted;
mod limits;
mod namesakes;
mod open;
mod other_optimum;
mod pairs;
mod play;
mod selection;
mod sessions;
mod shapes;
mod signs;
mod starts;
mod steps;
mod stops;
mod switched_on;
mod tangents;
mod undefined;
mod unidentified;
