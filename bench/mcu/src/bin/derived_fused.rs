//! The cost of [`derived::PlainFused`](bench_workload::filters::derived::PlainFused).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::derived::PlainFused);
