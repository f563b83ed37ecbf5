#![no_main]
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sonarfix_fuzz::c_interface(bytes));
