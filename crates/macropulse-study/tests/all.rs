//! The tests of the studies across their modules, as one program: it is linked once, and its tests
//! share the cores.
#![allow(missing_docs)]

mod claims;
mod clean_scan;
mod closed_form;
mod designs;
mod external;
mod others;
mod paper;
mod table_4;
