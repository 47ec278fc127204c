//! The processor-in-the-loop image: the charger of [`firmware::link`] on an emulated core, Arm or
//! RISC-V.
//!
//! It reads requests from the file `to-target` and writes replies to `to-host`, both opened by
//! semihosting in the emulator's working folder; they are FIFOs there. The table is whatever the
//! TABLE region holds. Each reply carries what the answer cost: ticks of the system timer (Arm),
//! and stack below this frame, which is painted before and searched after.
#![no_std]
#![no_main]

use core::panic::PanicInfo;

use firmware::flash;
use firmware::link::session::{Session, Wires};
use firmware::link::{FRAME_MAX, LENGTH_LEN, RECORD_MAX, Reply, Request, Response};
use firmware::link::{decode, encode, record_length};
use semihosting::fs::File;
use semihosting::io::{Read as _, Write as _};
use semihosting::process;

#[cfg_attr(target_arch = "arm", path = "boards/pil-arm.rs")]
#[cfg_attr(target_arch = "riscv32", path = "boards/pil-riscv.rs")]
mod machine;
#[path = "table_region.rs"]
mod table_region;

/// Stack that is painted below the frame of `main` \[words\].
const PAINTED_WORDS: usize = 1024;
/// What unused stack holds.
const PAINT: u32 = 0xCCCC_CCCC;

/// The next request; `None` at the end of the input.
fn receive(mut input: &File) -> Option<Result<Request, ()>> {
    let mut prefix = [0; LENGTH_LEN];
    input.read_exact(&mut prefix).ok()?;
    let length = record_length(prefix).ok()?;
    let mut record = [0; RECORD_MAX];
    let bytes = record.get_mut(..length)?;
    input.read_exact(bytes).ok()?;
    Some(decode(bytes).map_err(|_| ()))
}

/// Fills the unused stack below this frame with [`PAINT`] and says where the paint starts.
#[inline(never)]
fn paint() -> *mut u32 {
    let top = machine::stack_pointer();
    // Leave this function's own frame and what the loop below may push alone.
    let top = top.wrapping_sub(16);
    let bottom = top.wrapping_sub(PAINTED_WORDS);
    for word in 0..PAINTED_WORDS {
        // SAFETY: the words lie below the stack pointer, where nothing lives while no interrupt is
        // enabled, and within the RAM of at least 16 KB, of which this image's variables take less
        // than 4 KB at the other end.
        unsafe { bottom.wrapping_add(word).write_volatile(PAINT) };
    }
    bottom
}

/// Bytes of stack used below the caller's frame since [`paint`]; the painted size if all was
/// overwritten.
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
    let before = machine::timer();
    let response = session.handle(request);
    (response, machine::elapsed(before, machine::timer()))
}

fn serve(input: &File, mut output: &File) -> bool {
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
        if output.write_all(encode(&reply, &mut frame)).is_err() {
            return false;
        }
        if last {
            return true;
        }
    }
    false
}

#[machine::entry]
fn main() -> ! {
    machine::start_timer();
    let done = match (File::open(c"to-target"), File::create(c"to-host")) {
        (Ok(input), Ok(output)) => serve(&input, &output),
        _ => false,
    };
    process::exit(i32::from(!done))
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    process::exit(1)
}
