//! The language both ends of the link speak: code words, payload, and the marks they make.
//!
//! This stage counts chips. It knows nothing of seconds, metres or light.
