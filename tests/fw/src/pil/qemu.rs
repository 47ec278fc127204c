//! The `pil` image on an emulated board, behind two FIFOs.
//!
//! The image opens `to-target` and `to-host` by semihosting in QEMU's working folder, a temporary
//! one. When QEMU ends, a thread opens both FIFOs once more, so that a host that waits on one of
//! them gets an error instead of waiting for ever.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;

use super::machine::Machine;
use crate::images::Elf;
use firmware::link::{
    self, FRAME_MAX, LENGTH_LEN, LinkError, Reply, Request, decode, record_length,
};

/// Virtual time of one instruction is 2^6 ns.
pub const ICOUNT_SHIFT: u32 = 6;
/// Core clock of the emulated board \[MHz\].
pub const CORE_MHZ: u32 = 168;

/// Why the link failed.
#[derive(Debug)]
pub enum PilError {
    /// A file, a FIFO or a program.
    Io(String, io::Error),
    /// The image sent what is no reply.
    Reply(LinkError),
    /// Host and target disagree; the text says where.
    Differs(String),
}

impl std::fmt::Display for PilError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Io(what, error) => write!(f, "{what}: {error}"),
            Self::Reply(error) => write!(f, "not a reply: {error:?}"),
            Self::Differs(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for PilError {}

fn io_error(what: impl Into<String>) -> impl FnOnce(io::Error) -> PilError {
    let what = what.into();
    |error| PilError::Io(what, error)
}

/// The emulated charger.
#[derive(Debug)]
pub struct Target {
    to_target: File,
    to_host: File,
    frame: [u8; FRAME_MAX],
    _folder: tempfile::TempDir,
}

impl Target {
    /// Starts QEMU with the image and the table's bytes in the TABLE region. `count` makes the
    /// clock follow the instructions executed (Arm).
    ///
    /// # Errors
    /// QEMU or `mkfifo` is missing, or the image does not open its files.
    pub fn start(
        machine: Machine,
        image: &Path,
        table: &[u8],
        count: bool,
    ) -> Result<Self, PilError> {
        let folder = tempfile::tempdir().map_err(io_error("temporary folder"))?;
        let table_start = Elf::read(image)
            .and_then(|elf| elf.table_start())
            .map_err(|error| PilError::Io("image".into(), io::Error::other(error)))?;
        let table_file = folder.path().join("table.bin");
        std::fs::write(&table_file, table).map_err(io_error("table.bin"))?;
        let fifos = ["to-target", "to-host"].map(|name| folder.path().join(name));
        let made = Command::new("mkfifo")
            .args(&fifos)
            .status()
            .and_then(|status| {
                if status.success() {
                    Ok(())
                } else {
                    Err(io::Error::other(status.to_string()))
                }
            });
        made.map_err(io_error("mkfifo"))?;
        let mut qemu = Command::new(machine.qemu);
        qemu.args(machine.board)
            .args(["-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(image)
            .arg("-device")
            .arg(format!(
                "loader,file={},addr={table_start:#x},force-raw=on",
                table_file.display(),
            ))
            .current_dir(folder.path())
            .stdin(Stdio::null());
        if count {
            qemu.args(["-icount", &format!("shift={ICOUNT_SHIFT},sleep=off")]);
        }
        let child = qemu.spawn().map_err(io_error(machine.qemu))?;
        let [to_target, to_host] = fifos;
        let ends = [to_target.clone(), to_host.clone()];
        thread::spawn(move || release(child, &ends));
        let to_target = OpenOptions::new()
            .write(true)
            .open(to_target)
            .map_err(io_error("to-target"))?;
        let to_host = File::open(to_host).map_err(io_error("to-host"))?;
        Ok(Self {
            to_target,
            to_host,
            frame: [0; FRAME_MAX],
            _folder: folder,
        })
    }

    /// Sends a request and waits for the reply.
    ///
    /// # Errors
    /// QEMU is gone, or answers with something else.
    pub fn ask(&mut self, request: &Request) -> Result<Reply, PilError> {
        let frame = link::encode(request, &mut self.frame);
        self.to_target
            .write_all(frame)
            .map_err(io_error("the image stopped reading"))?;
        let mut prefix = [0; LENGTH_LEN];
        self.to_host
            .read_exact(&mut prefix)
            .map_err(io_error("the image stopped answering"))?;
        let length = record_length(prefix).map_err(PilError::Reply)?;
        let record = &mut self.frame[..length];
        self.to_host
            .read_exact(record)
            .map_err(io_error("the image stopped in a reply"))?;
        decode(record).map_err(PilError::Reply)
    }
}

/// Waits for the end of QEMU, then opens and closes both FIFOs, which ends every wait on them.
fn release(mut child: Child, fifos: &[std::path::PathBuf; 2]) {
    let _status = child.wait();
    let _ends: Vec<_> = fifos
        .iter()
        .map(|fifo| OpenOptions::new().read(true).write(true).open(fifo))
        .collect();
}

/// Instructions of an interval in ticks of the system timer, under `-icount`: one instruction lasts
/// 2^shift ns.
pub fn instructions(systick: u32) -> u32 {
    let nanoseconds = u64::from(systick) * 1000 / u64::from(CORE_MHZ);
    ((nanoseconds + (1 << (ICOUNT_SHIFT - 1))) >> ICOUNT_SHIFT) as u32
}
