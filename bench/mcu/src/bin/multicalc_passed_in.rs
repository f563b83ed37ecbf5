//! The cost of [`multicalc::PassedIn`](bench_workload::filters::multicalc::PassedIn).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::multicalc::PassedIn);
