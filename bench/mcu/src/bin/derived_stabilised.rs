//! The cost of [`derived::Stabilised`](bench_workload::filters::derived::Stabilised).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::derived::Stabilised);
