//! The cost of [`Ours`](bench_ours::Ours).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_ours::Ours);
