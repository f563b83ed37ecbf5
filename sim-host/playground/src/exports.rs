//! The functions that the page calls: plain C functions, so that no tool has to generate glue code.
//!
//! The page asks for room for a request (`request`), writes it there, and calls `run`, which returns the length of the
//! answer at `answer`. `drawing` and `own_map` read a map, and `map_file` writes one. `scenes` makes the scenes of the tour the answer. `questions`, `program`, `robot` and
//! `zip` are those of the form; `parts`, `part` and `md5` those of a board that is flashed; `connect`, `receive`, `order`, `due` and `events` those of a robot on a serial port. Times are
//! milliseconds since any fixed moment.

#![expect(unsafe_code, reason = "a function that WebAssembly exports by name needs `no_mangle`")]

use std::cell::RefCell;
use std::time::Duration;

use crate::live::Live;

thread_local! {
    static REQUEST: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static DRAWING: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static PROGRAM: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static PARTS: RefCell<Vec<Vec<u8>>> = const { RefCell::new(Vec::new()) };
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static LIVE: RefCell<Option<Live>> = const { RefCell::new(None) };
}

fn answer_with(answer: impl Into<Vec<u8>>) -> usize {
    let answer = answer.into();
    let length = answer.len();
    ANSWER.set(answer);
    length
}

/// Takes the request, and makes the answer to it.
fn answer_to<A: Into<Vec<u8>>>(answer: impl FnOnce(&str) -> A) -> usize {
    let request = REQUEST.take();
    answer_with(answer(&String::from_utf8_lossy(&request)))
}

/// Makes room for this many bytes, and returns their address.
fn room(bytes: &mut Vec<u8>, length: usize) -> *mut u8 {
    bytes.clear();
    bytes.resize(length, b' ');
    bytes.as_mut_ptr()
}

/// Makes room for a request of this many bytes of UTF-8, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn request(length: usize) -> *mut u8 {
    REQUEST.with_borrow_mut(|request| room(request, length))
}

/// Runs the request, and returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> usize {
    answer_to(crate::answer)
}

/// Makes the request's scenario, as a scenario file, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn file() -> usize {
    answer_to(crate::file)
}

/// Makes room for a file with a map, or an archive of a robot, of this many bytes, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn drawing(length: usize) -> *mut u8 {
    DRAWING.with_borrow_mut(|drawing| room(drawing, length))
}

/// Makes the map in the file, read as the request says, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn own_map() -> usize {
    let drawing = DRAWING.take();
    answer_to(|request| crate::own_map::answer(request, drawing))
}

/// Makes the map of the request's scenario, as a map file, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn map_file() -> usize {
    answer_to(crate::own_map::file)
}

/// Makes the scenes of the tour the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn scenes() -> usize {
    answer_with(crate::scenes())
}

/// Makes the questions of a new robot the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn questions() -> usize {
    answer_with(crate::new_robot::questions())
}

/// Makes room for the program of a board, UF2 or ELF, of this many bytes, and returns its address. It is used until the next one;
/// 0 bytes are none.
#[unsafe(no_mangle)]
pub extern "C" fn program(length: usize) -> *mut u8 {
    PROGRAM.with_borrow_mut(|program| room(program, length))
}

/// Makes the files of the request's robot the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn robot() -> usize {
    PROGRAM.with_borrow(|program| answer_to(|request| crate::new_robot::answer(request, program)))
}

/// Makes the files of the request's robot, as an archive, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn zip() -> usize {
    PROGRAM.with_borrow(|program| answer_to(|request| crate::new_robot::zip(request, program)))
}

/// Makes the parts of the flash of the request's robot, whose archive is in the file, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn parts() -> usize {
    let archive = DRAWING.take();
    PROGRAM.with_borrow(|program| {
        answer_to(|request| {
            let (shown, parts) = crate::flash::answer(request, &archive, program);
            PARTS.set(parts);
            shown
        })
    })
}

/// Makes the bytes of a part the answer, and returns their number.
#[unsafe(no_mangle)]
pub extern "C" fn part(index: usize) -> usize {
    answer_with(PARTS.with_borrow(|parts| parts.get(index).cloned().unwrap_or_default()))
}

/// Makes the MD5 of the request's bytes the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn md5() -> usize {
    answer_with(crate::flash::md5(&REQUEST.take()))
}

fn since(millis: f64) -> Duration {
    Duration::try_from_secs_f64(1e-3 * millis).unwrap_or_default()
}

/// Passes a value of the robot on, if there is one.
fn with_live<A: Default>(take: impl FnOnce(&mut Live) -> A) -> A {
    LIVE.with_borrow_mut(|live| live.as_mut().map(take).unwrap_or_default())
}

/// Begins with a robot of which nothing was received, as the request says. The answer is what is wrong with the request; its length
/// is returned, and 0 if nothing is.
#[unsafe(no_mangle)]
pub extern "C" fn connect() -> usize {
    answer_to(|request| match Live::new(request) {
        Ok(live) => {
            LIVE.set(Some(live));
            String::new()
        }
        Err(error) => format!("{error:#}"),
    })
}

/// Takes the request as bytes that the robot has sent.
#[unsafe(no_mangle)]
pub extern "C" fn receive() {
    let bytes = REQUEST.take();
    with_live(|live| live.receive(&bytes));
}

/// Takes the request as an order with this number.
#[unsafe(no_mangle)]
pub extern "C" fn order(number: u32, millis: f64) {
    let request = REQUEST.take();
    with_live(|live| live.order(number, &String::from_utf8_lossy(&request), since(millis)));
}

/// Makes the bytes that are to be sent to the robot now the answer, and returns their number.
#[unsafe(no_mangle)]
pub extern "C" fn due(millis: f64) -> usize {
    answer_with(with_live(|live| live.due(since(millis))))
}

/// Makes the events since the last call the answer, a line of JSON each, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn events() -> usize {
    answer_with(with_live(Live::events))
}

/// The address of the answer: UTF-8, an archive, or bytes for a robot.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    ANSWER.with_borrow(|answer| answer.as_ptr())
}
