//! The cost of [`derived::StabilisedFused`](bench_workload::filters::derived::StabilisedFused).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::derived::StabilisedFused);
