//! The cost of [`multicalc::OwnTrigonometry`](bench_workload::filters::multicalc::OwnTrigonometry).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::multicalc::OwnTrigonometry);
