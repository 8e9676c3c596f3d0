#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| lightgraph_fuzz::image(bytes));
