//! Runs the filter that is named on the command line over the drive, under callgrind, which counts the instructions of
//! `bench_predict` or `bench_update`; prints the number of calls of each.

use std::env;
use std::process::ExitCode;

use bench_workload::model::{Range, Step};
use bench_workload::{Filter, drive, each_filter};

#[inline(never)]
fn bench_predict<F: Filter>(filter: &mut F, step: &Step) {
    filter.predict(step);
}

#[inline(never)]
fn bench_update<F: Filter>(filter: &mut F, range: &Range) {
    filter.update(range);
}

fn run<F: Filter>() {
    let mut filter = F::new(drive::START, drive::VARIANCES);
    let mut updates = 0;
    for i in 0..drive::STEPS {
        let step = drive::step(&filter, i);
        bench_predict(&mut filter, &step);
        if let Some(range) = drive::range(&filter, i) {
            bench_update(&mut filter, &range);
            updates += 1;
        }
    }
    println!("predict {}", drive::STEPS);
    println!("update {updates}");
}

macro_rules! run_named {
    ($($(#[$feature:meta])* $name:ident: $filter:ty;)*) => {
        fn run_named(name: &str) -> bool {
            match name {
                $($(#[$feature])* stringify!($name) => run::<$filter>(),)*
                _ => return false,
            }
            true
        }
    };
}

each_filter! { run_named, kernel: bench_ours::kernel::Kernel; shipped: bench_ours::Shipped; }

fn main() -> ExitCode {
    let name = env::args().nth(1).unwrap_or_default();
    if run_named(&name) {
        ExitCode::SUCCESS
    } else {
        eprintln!("no filter is called `{name}`");
        ExitCode::FAILURE
    }
}
