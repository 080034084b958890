//! Errors of estimates: standard errors, intervals and profiles against closed forms and against simulated
//! calibrations.

#[path = "estimates/models.rs"]
mod models;

#[path = "estimates/closed_forms.rs"]
mod closed_forms;
#[path = "estimates/coverage.rs"]
mod coverage;
#[path = "estimates/identifiability.rs"]
mod identifiability;
#[path = "estimates/local_tuners.rs"]
mod local_tuners;
#[path = "estimates/profile_ends.rs"]
mod profile_ends;
