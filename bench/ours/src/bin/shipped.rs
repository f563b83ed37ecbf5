//! The cost of [`Shipped`](bench_ours::Shipped).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_ours::Shipped);
