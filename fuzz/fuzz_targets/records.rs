#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| macropulse_fuzz::run("records", bytes));
