//! {{project-name}}: the start and the loop. The parts of the board are in `parts.rs`; in this file only the motor code changes.

#![no_std]
#![no_main]

mod parts;

use core::ops::Range;

use defmt_rtt as _;
use panic_probe as _;
use sonarfix_app::store::Store;
use sonarfix_app::watchdog::Liveness;
use sonarfix_app::{App, FlashContents, boots, log};
use sonarfix_hal::robot::Devices;
use sonarfix_motors::Pattern;
use sonarfix_robot::{NextPoll, memory};
// Faster products and sums on a Cortex-M0 or M0+; no effect on other cores.
use sonarfix_soft_float as _;

use parts::{Board, ECHO};

#[cortex_m_rt::entry]
fn main() -> ! {
    let Board {
        clock,
        right,
        left,
        pulses,
        trigger,
        mut link,
        flash,
        mut enable,
        mut motors,
        mut watchdog,
        resets,
        ..
    } = Board::start();
    let servo = sonarfix_robot::servo(pulses);
    let ranger = sonarfix_robot::ranger(trigger, &ECHO);
    let mut hardware = Devices { right, left, servo, ranger };
    let contents = FlashContents::read(memory::map(), memory::config());
    log::flash_contents(&contents);
    let store: Range<u32> = parts::store();
    let Ok(store) = Store::new(flash, store) else {
        panic!("the store is not two or more whole sectors");
    };
    let reset = watchdog.reset();
    let count = boots::resets(resets.read());
    resets.write(boots::register(count.saturating_add(1)));
    let board = sonarfix_robot::board(reset, count);
    let mut app = App::new(board, contents, store, clock.now());
    // The motor code: your own controller takes the place of the example, which drives to and fro.
    let mut pattern = Pattern::default();
    let mut next_poll = NextPoll::AT_ONCE;
    let mut liveness = Liveness::new(clock.now());
    loop {
        // Until something is due, a byte has arrived or an edge of the echo is stamped. On a chip whose timer, UART and echo pin
        // interrupt, the end of this loop is the place of an instruction that sleeps.
        while clock.now() < next_poll.at(link.has_bytes()) && !ECHO.take_edge() {
            link.transmit();
        }
        let start = clock.now();
        let polled = app.poll(start, &mut hardware, &mut link);
        enable.set(polled.may_drive);
        if polled.is_settled {
            resets.write(boots::register(0));
        }
        link.transmit();
        log::polled(&polled, app.report());
        motors.set(pattern.drive(sonarfix_robot::estimate(&app, &polled)));
        if let Some(took) = clock.now().checked_duration_since(start) {
            app.took(took);
        }
        app.work(start, || clock.now());
        next_poll = sonarfix_robot::next_poll(&app, &mut hardware, start, polled.may_drive);
        if liveness.is_alive(start, &polled) {
            watchdog.feed();
        }
    }
}
