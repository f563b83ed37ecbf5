//! Tests across the crates live in `tests/`; there is nothing to use here.
