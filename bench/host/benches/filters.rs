//! The time of ten predicts and one update: `cargo bench --package bench-host`.

use std::hint::black_box;

use bench_workload::filters::naive;
use bench_workload::model::{Range, Step};
use bench_workload::{Filter, drive, each_filter};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};

/// The first ten travels of the drive and the range after them, at one filter's estimates.
fn script() -> (Vec<Step>, Range) {
    let mut filter = naive::Joseph::new(drive::START, drive::VARIANCES);
    let mut steps = Vec::new();
    for i in 0..drive::STEPS_A_RANGE {
        let step = drive::step(&filter, i);
        filter.predict(&step);
        steps.push(step);
    }
    let range = drive::range(&filter, drive::STEPS_A_RANGE - 1);
    (steps, range.expect("a range is due after so many steps"))
}

fn measure<F: Filter>(criterion: &mut Criterion, name: &str) {
    let (steps, range) = script();
    criterion.bench_function(name, |bench| {
        bench.iter_batched_ref(
            || F::new(drive::START, drive::VARIANCES),
            |filter| {
                for step in &steps {
                    filter.predict(black_box(step));
                }
                filter.update(black_box(&range));
            },
            BatchSize::SmallInput,
        );
    });
}

macro_rules! measure_each {
    ($($(#[$feature:meta])* $name:ident: $filter:ty;)*) => {
        fn filters(criterion: &mut Criterion) {
            $($(#[$feature])* measure::<$filter>(criterion, stringify!($name));)*
        }
    };
}

each_filter! { measure_each, kernel: bench_ours::kernel::Kernel; shipped: bench_ours::Shipped; }

criterion_group!(benches, filters);
criterion_main!(benches);
