//! The cost of [`numeris::NumerisEkf`](bench_workload::filters::numeris::NumerisEkf).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::numeris::NumerisEkf);
