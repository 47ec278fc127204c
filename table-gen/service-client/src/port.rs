//! A serial port.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, isatty, tcgetattr, tcsetattr};
use service::frame::{Collector, FRAME_MAX, encode};

/// Speed of the line \[baud\].
pub const BAUD: u32 = 115_200;

/// A port that is open.
#[derive(Debug)]
pub struct Port {
    file: File,
    bytes: Receiver<Vec<u8>>,
    ready: Vec<Vec<u8>>,
    collector: Collector,
    /// Bytes that came since it was opened.
    heard: u64,
}

impl Port {
    /// Opens a port: raw and at [`BAUD`] if it is a terminal.
    ///
    /// # Errors
    /// It cannot be opened or set.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(OFlags::NOCTTY.bits().cast_signed())
            .open(path)?;
        if !isatty(&file) {
            let reason = "not a serial port";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
        }
        let mut line = tcgetattr(&file)?;
        line.make_raw();
        line.set_speed(BAUD)?;
        tcsetattr(&file, OptionalActions::Now, &line)?;
        let mut reader = file.try_clone()?;
        let (sender, bytes) = channel();
        // It ends with the port, or with the process.
        std::thread::spawn(move || {
            let mut buffer = [0; 512];
            while let Ok(length) = reader.read(&mut buffer) {
                let chunk = buffer.get(..length).unwrap_or_default().to_vec();
                if length == 0 || sender.send(chunk).is_err() {
                    return;
                }
            }
        });
        Ok(Self {
            file,
            bytes,
            ready: Vec::new(),
            collector: Collector::EMPTY,
            heard: 0,
        })
    }

    /// Sends a record.
    ///
    /// # Errors
    /// The port's.
    pub fn send(&mut self, record: &[u8]) -> io::Result<()> {
        // A delimiter first: what stands on the line already is another frame's.
        self.file.write_all(&[0])?;
        self.file.write_all(encode(record, &mut [0; FRAME_MAX]))?;
        self.file.flush()
    }

    /// The next record that comes until then, whatever it is.
    pub fn receive(&mut self, until: Instant) -> Option<Vec<u8>> {
        loop {
            if !self.ready.is_empty() {
                return Some(self.ready.remove(0));
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            for byte in self.bytes.recv_timeout(left).ok()? {
                self.heard += 1;
                self.ready
                    .extend(self.collector.take(byte).map(<[u8]>::to_vec));
            }
        }
    }

    /// Bytes that came since it was opened.
    pub const fn heard(&self) -> u64 {
        self.heard
    }
}
