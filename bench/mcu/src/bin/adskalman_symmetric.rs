//! The cost of [`adskalman::Symmetric`](bench_workload::filters::adskalman::Symmetric).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::adskalman::Symmetric);
