//! The language both ends of the link speak: code words, payload, and the marks they make.
//!
//! This stage counts chips. It knows nothing of seconds, metres or light.

mod codebook;
pub mod correlation;
mod error;
mod family;
mod payload;
mod word;

pub use codebook::{Codebook, Keying};
pub use error::Error;
pub use family::{Family, Separated, Sparse, prime_sequence};
pub use payload::{Crc, Payload, PayloadFault, ShiftAlias};
pub use word::CodeWord;
