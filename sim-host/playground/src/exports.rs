//! The functions that the page calls: plain C functions, so that no tool has to generate glue code.
//!
//! The page asks for room for a request (`request`), writes it there, and calls `run`, which returns the length of the
//! answer at `answer`. `scenes` makes the scenes of the tour the answer.

#![expect(unsafe_code, reason = "a function that WebAssembly exports by name needs `no_mangle`")]

use std::cell::RefCell;

thread_local! {
    static REQUEST: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static ANSWER: RefCell<String> = const { RefCell::new(String::new()) };
}

fn answer_with(text: String) -> usize {
    let length = text.len();
    ANSWER.set(text);
    length
}

/// Makes room for a request of this many bytes of UTF-8, and returns its address.
#[unsafe(no_mangle)]
pub extern "C" fn request(length: usize) -> *mut u8 {
    REQUEST.with_borrow_mut(|request| {
        request.clear();
        request.resize(length, b' ');
        request.as_mut_ptr()
    })
}

/// Runs the request, and returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> usize {
    let request = REQUEST.take();
    answer_with(crate::answer(&String::from_utf8_lossy(&request)))
}

/// Makes the request's scenario, as a scenario file, the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn file() -> usize {
    let request = REQUEST.take();
    answer_with(crate::file(&String::from_utf8_lossy(&request)))
}

/// Makes the scenes of the tour the answer, and returns its length.
#[unsafe(no_mangle)]
pub extern "C" fn scenes() -> usize {
    answer_with(crate::scenes())
}

/// The address of the answer, UTF-8.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    ANSWER.with_borrow(|answer| answer.as_ptr())
}
