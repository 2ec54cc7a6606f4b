//! The benchmarks of Macropulse lie in `benches`; docs/performance.md says how to run them. They are
//! a package of their own so that tests of Macropulse do not wait for the libraries that it is
//! measured against.
