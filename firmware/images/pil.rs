//! The processor-in-the-loop image: the charger of [`firmware::link`] on an emulated STM32F405.
//!
//! It reads requests from the file `to-target` and writes replies to `to-host`, both opened by semihosting in the
//! emulator's working folder; they are FIFOs there. The table is whatever the TABLE region holds. Each reply carries what
//! the answer cost: ticks of the system timer, and stack below this frame, which is painted before and searched after.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, syscall};
use firmware::flash;
use firmware::link::session::{Session, Wires};
use firmware::link::{FRAME_MAX, LENGTH_LEN, RECORD_MAX, Reply, Request, Response};
use firmware::link::{decode, encode, record_length};

#[path = "table_region.rs"]
mod table_region;

/// Modes of SYS_OPEN: "rb" and "wb".
const READ_BINARY: usize = 1;
const WRITE_BINARY: usize = 5;
/// Counts of the system timer.
const SYSTICK_MASK: u32 = 0x00FF_FFFF;
/// Stack that is painted below the frame of `main` \[words\].
const PAINTED_WORDS: usize = 1024;
/// What unused stack holds.
const PAINT: u32 = 0xCCCC_CCCC;

/// A file on the host, by its semihosting handle.
struct HostFile(usize);

impl HostFile {
    /// Opens a file; the name ends with a zero byte.
    fn open(name: &[u8], mode: usize) -> Option<Self> {
        // SAFETY: OPEN reads `len` bytes at the pointer, which are the name's, and its zero.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.len().wrapping_sub(1)) };
        (handle != usize::MAX).then_some(Self(handle))
    }

    /// Fills the buffer; `false` at the end of the file.
    fn read(&self, buffer: &mut [u8]) -> bool {
        let mut rest = buffer;
        while !rest.is_empty() {
            // SAFETY: READ writes at most `len` bytes to the pointer, which are `rest`'s.
            let unread = unsafe { syscall!(READ, self.0, rest.as_mut_ptr(), rest.len()) };
            if unread >= rest.len() {
                return false;
            }
            let Some(at) = rest.len().checked_sub(unread) else {
                return false;
            };
            rest = rest.get_mut(at..).unwrap_or_default();
        }
        true
    }

    /// Writes all bytes; `false` when the host does not take them.
    fn write(&self, bytes: &[u8]) -> bool {
        // SAFETY: WRITE reads `len` bytes at the pointer, which are `bytes`'s.
        let unwritten = unsafe { syscall!(WRITE, self.0, bytes.as_ptr(), bytes.len()) };
        unwritten == 0
    }
}

/// The next request; `None` at the end of the input.
fn receive(input: &HostFile) -> Option<Result<Request, ()>> {
    let mut prefix = [0; LENGTH_LEN];
    if !input.read(&mut prefix) {
        return None;
    }
    let length = record_length(prefix).ok()?;
    let mut record = [0; RECORD_MAX];
    let bytes = record.get_mut(..length)?;
    if !input.read(bytes) {
        return None;
    }
    Some(decode(bytes).map_err(|_| ()))
}

/// Fills the unused stack below this frame with [`PAINT`] and says where the paint starts.
#[inline(never)]
fn paint() -> *mut u32 {
    let top = cortex_m::register::msp::read() as *mut u32;
    // Leave this function's own frame and what the loop below may push alone.
    let top = top.wrapping_sub(16);
    let bottom = top.wrapping_sub(PAINTED_WORDS);
    for word in 0..PAINTED_WORDS {
        // SAFETY: the words lie below the stack pointer, where nothing lives while no interrupt is enabled, and within
        // the 128 KB of RAM, of which this image's variables take less than 4 KB at the other end.
        unsafe { bottom.wrapping_add(word).write_volatile(PAINT) };
    }
    bottom
}

/// Bytes of stack used below the caller's frame since [`paint`]; the painted size if all was overwritten.
#[inline(never)]
fn used(bottom: *mut u32) -> u32 {
    let untouched = (0..PAINTED_WORDS).find(|word| {
        // SAFETY: the words that `paint` wrote.
        unsafe { bottom.wrapping_add(*word).read_volatile() != PAINT }
    });
    let words = PAINTED_WORDS.saturating_sub(untouched.unwrap_or(PAINTED_WORDS));
    // The words that `paint` left alone count as used.
    (words as u32 + 16) * 4
}

/// The session's answer, in a frame of its own so that the paint starts where the answer starts.
#[inline(never)]
fn answer(session: &mut Session<'_>, request: &Request) -> (Response, u32) {
    let before = SYST::get_current();
    let response = session.handle(request);
    let after = SYST::get_current();
    (response, before.wrapping_sub(after) & SYSTICK_MASK)
}

fn serve(input: &HostFile, output: &HostFile) -> bool {
    let wires = Wires::default();
    let mut session = Session::new(&wires, flash::image(table_region::bytes()));
    let mut frame = [0; FRAME_MAX];
    while let Some(received) = receive(input) {
        let (reply, last) = match received {
            Ok(request) => {
                let bottom = paint();
                let (response, systick) = answer(&mut session, &request);
                let stack = used(bottom);
                let reply = Reply {
                    response,
                    systick,
                    stack,
                };
                (reply, request == Request::Stop)
            }
            Err(()) => {
                let reply = Reply {
                    response: Response::Refused,
                    systick: 0,
                    stack: 0,
                };
                (reply, false)
            }
        };
        if !output.write(encode(&reply, &mut frame)) || last {
            return last;
        }
    }
    false
}

#[entry]
fn main() -> ! {
    if let Some(mut peripherals) = cortex_m::Peripherals::take() {
        let timer = &mut peripherals.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(SYSTICK_MASK);
        timer.clear_current();
        timer.enable_counter();
    }
    let input = HostFile::open(b"to-target\0", READ_BINARY);
    let output = HostFile::open(b"to-host\0", WRITE_BINARY);
    let done = match (input, output) {
        (Some(input), Some(output)) => serve(&input, &output),
        _ => false,
    };
    debug::exit(if done {
        debug::EXIT_SUCCESS
    } else {
        debug::EXIT_FAILURE
    });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    debug::exit(debug::EXIT_FAILURE);
    loop {
        cortex_m::asm::wfi();
    }
}
