//! The functions that the page calls: plain C functions, so that no tool has to generate glue code.
//!
//! The page asks for room for a request (`request`), writes it there, and calls `run`, which returns the length of the
//! answer at `answer`. `scenes` makes the scenes of the tour the answer. `questions`, `program`, `robot` and
//! `zip` are those of the form.

#![expect(unsafe_code, reason = "a function that WebAssembly exports by name needs `no_mangle`")]

use std::cell::RefCell;

thread_local! {
    static REQUEST: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static PROGRAM: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
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

/// The address of the answer, UTF-8 or an archive.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    ANSWER.with_borrow(|answer| answer.as_ptr())
}
