//! Long games on disk: a game that is interrupted, by a person or by a power cut, goes on where it
//! stood.
//!
//! One file a game, `NAME.game` in a folder. It is written beside its place and then moved there,
//! so that it is whole or absent, and its end holds a checksum of all before. Layout,
//! little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `HFGAME01` |
//! | 8 | CRC-64 of the program that wrote it |
//! | 16 | hash of the spec |
//! | | the state, as [`crate::game::state`] writes it |
//! | 8 | CRC-64 of all before |
//!
//! Another program may number cells or inputs otherwise, and another spec plays another game, so
//! either is refused.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crc::{CRC_64_ECMA_182, Crc, Digest};
use model::spec::Spec;

use crate::game::state::State;
use crate::game::{Sweep, Watch};

const MAGIC: &[u8; 8] = b"HFGAME01";
/// Magic, program and spec.
const HEADER: usize = 8 + 8 + 16;
const TRAILER: usize = 8;
static CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_ECMA_182);

/// Why there is no checkpoint, or none to go on from.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file or folder cannot be read or written.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Not a file of this kind, or cut short, or damaged.
    #[error("{path}: not a whole checkpoint of a game; remove it to start anew", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
    },
    /// Made by another program, or for another spec.
    #[error(
        "{path}: made {by}; remove it to start anew, or go on with what made it", path = path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What differs.
        by: &'static str,
    },
}

/// The folder of a run.
#[derive(Debug)]
pub struct Checkpoints {
    folder: PathBuf,
    header: [u8; HEADER],
    every: Duration,
    failure: Mutex<Option<CheckpointError>>,
}

impl Checkpoints {
    /// Opens a folder for a spec, makes it if need be, and checks every game in it. A state is
    /// written at most once in so long, besides when a game ends or is interrupted.
    ///
    /// # Errors
    /// A folder that cannot be used, or a game in it that is damaged or foreign.
    pub fn open(folder: &Path, spec: &Spec, every: Duration) -> Result<Self, CheckpointError> {
        std::fs::create_dir_all(folder).map_err(failed(folder))?;
        let mut header = [0; HEADER];
        header[..8].copy_from_slice(MAGIC);
        header[8..16].copy_from_slice(&program().map_err(failed(folder))?.to_le_bytes());
        header[16..].copy_from_slice(&spec.hash());
        let open = Self {
            folder: folder.to_owned(),
            header,
            every,
            failure: Mutex::new(None),
        };
        for path in open.games()? {
            open.check(&path)?;
        }
        Ok(open)
    }

    /// What a write failed with, if one did: the game was then interrupted.
    pub fn failure(&self) -> Option<CheckpointError> {
        self.failure
            .lock()
            .ok()
            .and_then(|mut failure| failure.take())
    }

    /// Removes the games: the run is done.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub fn done(&self) -> Result<(), CheckpointError> {
        for path in self.games()? {
            std::fs::remove_file(&path).map_err(failed(&path))?;
        }
        // A folder that holds something else stays.
        let _ = std::fs::remove_dir(&self.folder);
        Ok(())
    }

    /// A watch that keeps the state of a game, around one that shows its progress.
    pub fn watch<'w>(
        &'w self,
        game: &'static str,
        shown: Box<dyn Watch + 'w>,
    ) -> Box<dyn Watch + 'w> {
        Box::new(Keeper {
            checkpoints: self,
            path: self.folder.join(format!("{game}.game")),
            shown,
            written: Mutex::new(Instant::now()),
        })
    }

    fn games(&self) -> Result<Vec<PathBuf>, CheckpointError> {
        let mut games = Vec::new();
        for entry in std::fs::read_dir(&self.folder).map_err(failed(&self.folder))? {
            let path = entry.map_err(failed(&self.folder))?.path();
            if path.extension().is_some_and(|end| end == "game") {
                games.push(path);
            }
        }
        Ok(games)
    }

    /// Header and checksum of a game.
    fn check(&self, path: &Path) -> Result<(), CheckpointError> {
        let damaged = || CheckpointError::Damaged {
            path: path.to_owned(),
        };
        let foreign = |by| CheckpointError::Foreign {
            path: path.to_owned(),
            by,
        };
        let file = File::open(path).map_err(failed(path))?;
        let len = file.metadata().map_err(failed(path))?.len();
        let body = len.checked_sub(TRAILER as u64).ok_or_else(damaged)?;
        let mut from = BufReader::new(file);
        let mut digest = CRC.digest();
        let (mut left, mut at, mut chunk) = (body, 0usize, vec![0; 1 << 16]);
        let mut header = [0; HEADER];
        while left > 0 {
            let part = &mut chunk[..left.min(1 << 16) as usize];
            from.read_exact(part).map_err(failed(path))?;
            digest.update(part);
            if at < HEADER {
                let size = part.len().min(HEADER - at);
                header[at..at + size].copy_from_slice(&part[..size]);
            }
            at += part.len();
            left -= part.len() as u64;
        }
        let mut sum = [0; TRAILER];
        from.read_exact(&mut sum).map_err(failed(path))?;
        if at < HEADER
            || header[..8] != self.header[..8]
            || u64::from_le_bytes(sum) != digest.finalize()
        {
            return Err(damaged());
        }
        if header[8..16] != self.header[8..16] {
            return Err(foreign("by another build of this program"));
        }
        if header[16..] != self.header[16..] {
            return Err(foreign("for another spec"));
        }
        Ok(())
    }

    /// Writes a game beside its place and moves it there.
    fn write(&self, path: &Path, state: &State<'_>) -> io::Result<()> {
        let beside = path.with_extension("game.part");
        let written = (|| {
            let mut to = Summed {
                to: BufWriter::new(File::create(&beside)?),
                digest: CRC.digest(),
            };
            to.write_all(&self.header)?;
            state.write(&mut to)?;
            let Summed { mut to, digest } = to;
            to.write_all(&digest.finalize().to_le_bytes())?;
            to.into_inner()?.sync_all()?;
            std::fs::rename(&beside, path)
        })();
        if written.is_err() {
            let _ = std::fs::remove_file(&beside);
        }
        written
    }
}

fn failed(path: &Path) -> impl Fn(io::Error) -> CheckpointError {
    move |error| CheckpointError::Io {
        path: path.to_owned(),
        error,
    }
}

/// CRC-64 of the running program's file.
fn program() -> io::Result<u64> {
    let mut from = BufReader::new(File::open(std::env::current_exe()?)?);
    let (mut digest, mut chunk) = (CRC.digest(), vec![0; 1 << 16]);
    loop {
        match from.read(&mut chunk)? {
            0 => return Ok(digest.finalize()),
            size => digest.update(&chunk[..size]),
        }
    }
}

/// A writer that sums up what goes through it.
struct Summed<W> {
    to: W,
    digest: Digest<'static, u64>,
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let size = self.to.write(bytes)?;
        self.digest.update(&bytes[..size]);
        Ok(size)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Keeps the state of one game.
struct Keeper<'w> {
    checkpoints: &'w Checkpoints,
    path: PathBuf,
    shown: Box<dyn Watch + 'w>,
    /// When the state was last written.
    written: Mutex<Instant>,
}

impl Watch for Keeper<'_> {
    fn sweep(&self, sweep: &Sweep) -> bool {
        let failed = self
            .checkpoints
            .failure
            .lock()
            .is_ok_and(|failure| failure.is_some());
        self.shown.sweep(sweep) && !failed
    }

    fn guarded(&self, share: f64) {
        self.shown.guarded(share);
    }

    fn offer(&self, state: &State<'_>, interrupted: bool) {
        let Ok(mut written) = self.written.lock() else {
            return;
        };
        if !(interrupted || state.finished || written.elapsed() >= self.checkpoints.every) {
            return;
        }
        if let Err(error) = self.checkpoints.write(&self.path, state)
            && let Ok(mut failure) = self.checkpoints.failure.lock()
        {
            *failure = Some(failed(&self.path)(error));
        }
        *written = Instant::now();
    }

    fn saved(&self) -> Option<Box<dyn Read + '_>> {
        // The file was checked when the folder was opened.
        let mut from = BufReader::new(File::open(&self.path).ok()?);
        from.seek(SeekFrom::Start(HEADER as u64)).ok()?;
        Some(Box::new(from))
    }
}
