//! The cost of [`Kernel`](bench_ours::kernel::Kernel).
#![no_std]
#![no_main]

bench_mcu::measure!(bench_ours::kernel::Kernel);
