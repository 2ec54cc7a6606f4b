//! Closed form: what theory says a simulation will measure.

pub mod comparison;
pub mod link;
pub mod multiple_access;
pub mod ranging;
