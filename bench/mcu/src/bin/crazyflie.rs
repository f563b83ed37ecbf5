//! The cost of [`crazyflie::Crazyflie`](bench_workload::filters::crazyflie::Crazyflie).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_workload::filters::crazyflie::Crazyflie);
