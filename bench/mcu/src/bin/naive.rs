//! The cost of [`naive::Plain`](bench_workload::filters::naive::Plain).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::naive::Plain);
