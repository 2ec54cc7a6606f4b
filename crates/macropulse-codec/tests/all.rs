//! The tests of the codec across its modules, as one program: it is linked once, and its tests share
//! the cores. A test that limits its own process is a program of its own.
#![allow(missing_docs)]

mod waveform;

mod beat_files;
mod contract;
mod files;
mod histogram;
mod histogram_files;
mod readme;
mod recorded_histograms;
mod sample_files;
mod sampled;
mod tap_files;
