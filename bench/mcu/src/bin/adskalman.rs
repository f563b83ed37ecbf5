//! The cost of [`adskalman::Joseph`](bench_workload::filters::adskalman::Joseph).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::adskalman::Joseph);
