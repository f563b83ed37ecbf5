//! The cost of [`naive::Joseph`](bench_workload::filters::naive::Joseph).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::naive::Joseph);
