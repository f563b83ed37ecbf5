//! The cost of [`minikalman::Boxed`](bench_workload::filters::minikalman::Boxed).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::minikalman::Boxed);
