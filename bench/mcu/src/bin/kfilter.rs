//! The cost of [`kfilter::Kfilter`](bench_workload::filters::kfilter::Kfilter).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::kfilter::Kfilter);
