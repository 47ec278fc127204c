//! What a charger says of itself on its telemetry line, told apart from the telemetry.
//!
//! A charger sends its identity at its start and every minute, as an answer that nobody asked for.
//! Whoever reads telemetry reads it through [`Introductions`]: telemetry passes, frames of the
//! service are taken out.

use std::collections::VecDeque;
use std::io::{self, Read};

use service::frame::{ANSWER, ASK, Collector};
use service::message::{Answer, Identity, UNASKED, read_answer};

/// Bytes read at a time.
const CHUNK: usize = 4096;
/// Bytes without a delimiter from which on they are no frame, and pass as they are.
const PENDING_MAX: usize = 4096;

/// A line without its service frames.
pub struct Introductions<R> {
    inner: R,
    collector: Collector,
    /// Bytes since the last delimiter.
    pending: Vec<u8>,
    /// Bytes that may pass.
    ready: VecDeque<u8>,
    found: Box<dyn FnMut(&Identity) + Send>,
}

impl<R> std::fmt::Debug for Introductions<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Introductions").finish_non_exhaustive()
    }
}

impl<R: Read> Introductions<R> {
    /// The line; `found` is told who the charger says that it is.
    pub fn new(inner: R, found: Box<dyn FnMut(&Identity) + Send>) -> Self {
        Self {
            inner,
            collector: Collector::EMPTY,
            pending: Vec::new(),
            ready: VecDeque::new(),
            found,
        }
    }

    fn pass(&mut self) {
        self.ready.extend(self.pending.drain(..));
    }

    fn take(&mut self, byte: u8) {
        self.pending.push(byte);
        match self.collector.take(byte) {
            Some(record @ [ASK | ANSWER, ..]) => {
                if let Some((UNASKED, Answer::Identity(identity))) = read_answer(record) {
                    (self.found)(&identity);
                }
                self.pending.clear();
            }
            _ if byte == 0 || self.pending.len() >= PENDING_MAX => self.pass(),
            _ => {}
        }
    }
}

impl<R: Read> Read for Introductions<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut chunk = [0; CHUNK];
        while self.ready.is_empty() {
            match self.inner.read(&mut chunk)? {
                0 => {
                    self.pass();
                    break;
                }
                length => chunk.iter().take(length).for_each(|byte| self.take(*byte)),
            }
        }
        self.ready.read(buffer)
    }
}

/// Who a charger is, in a line.
pub fn line(identity: &Identity) -> String {
    let table = identity.table.as_ref().map_or_else(
        || "no table".to_owned(),
        |table| {
            let hash: String = table.spec_hash.iter().map(|b| format!("{b:02x}")).collect();
            format!("table {:08x}, spec {hash}", table.crc)
        },
    );
    let settings = match identity.settings {
        0 => "default settings",
        1 => "stored settings",
        _ => "unreadable settings",
    };
    format!(
        "charger {:08x}, build {}, {table}, {settings}",
        identity.serial, identity.build
    )
}
