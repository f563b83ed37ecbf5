//! The cost of [`derived::Plain`](bench_workload::filters::derived::Plain).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::derived::Plain);
