//! Runs a filter over the drive on an emulated Cortex-M and reports the cost of each call. Each filter has its own program, so
//! that no two share code.

#![no_std]

use core::alloc::{GlobalAlloc, Layout};
use core::cell::UnsafeCell;
use core::ptr;
use core::sync::atomic::{AtomicUsize, Ordering};

use bench_workload::model::{Range, Step};
use bench_workload::{Filter, drive};
use emulated_board::meter::{Call, Cost, Meter};
use emulated_board::report;

/// Generates the program of a filter. `cargo xtask bench` finds the filter's code by the names `bench_predict` and
/// `bench_update`.
#[macro_export]
macro_rules! measure {
    ($filter:ty) => {
        use bench_workload::Filter;
        use bench_workload::model::{Range, Step};

        #[unsafe(no_mangle)]
        extern "C" fn bench_predict(filter: &mut $filter, step: &Step) {
            filter.predict(step);
        }

        #[unsafe(no_mangle)]
        extern "C" fn bench_update(filter: &mut $filter, range: &Range) {
            filter.update(range);
        }

        #[emulated_board::entry]
        fn main() -> ! {
            $crate::run(bench_predict, bench_update)
        }
    };
}

/// Runs a filter over the drive and reports its cost.
pub fn run<F: Filter>(predict: Call<F, Step>, update: Call<F, Range>) -> ! {
    let mut meter = Meter::start();
    let mut filter = F::new(drive::START, drive::VARIANCES);
    let (mut predicts, mut updates) = (Cost::default(), Cost::default());
    for i in 0..drive::STEPS {
        let step = drive::step(&filter, i);
        meter.measure(&mut predicts, predict, &mut filter, &step);
        if let Some(range) = drive::range(&filter, i) {
            meter.measure(&mut updates, update, &mut filter, &range);
        }
    }
    report::cost(c"predict", &predicts);
    report::cost(c"update", &updates);
    report::done()
}

/// A heap for the peers that need one. Memory is never freed.
struct Heap(AtomicUsize);

#[global_allocator]
static HEAP: Heap = Heap(AtomicUsize::new(0));

const HEAP_BYTES: usize = 16 * 1024;

#[repr(align(8))]
struct Memory(UnsafeCell<[u8; HEAP_BYTES]>);

// SAFETY: there is one thread, and each byte is allocated once.
unsafe impl Sync for Memory {}

static MEMORY: Memory = Memory(UnsafeCell::new([0; HEAP_BYTES]));

// SAFETY: allocations do not overlap and are aligned; null means that the memory is exhausted.
unsafe impl GlobalAlloc for Heap {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let from = self.0.load(Ordering::Relaxed).next_multiple_of(layout.align().max(8));
        let to = from + layout.size();
        if to > HEAP_BYTES || layout.align() > 8 {
            return ptr::null_mut();
        }
        // Not a single atomic operation, which a Cortex-M0+ lacks.
        self.0.store(to, Ordering::Relaxed);
        MEMORY.0.get().cast::<u8>().wrapping_add(from)
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}
