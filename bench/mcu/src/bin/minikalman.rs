//! The cost of [`minikalman::Minikalman`](bench_workload::filters::minikalman::Minikalman).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::minikalman::Minikalman);
