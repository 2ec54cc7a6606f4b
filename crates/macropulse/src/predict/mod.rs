//! Closed form: what theory says a simulation will measure.

pub mod interference;
pub mod link;
pub mod multiple_access;
pub mod ranging;
