//! The images: built by cargo, read as ELF, written as BIN and Intel HEX.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionKind};

use crate::root;

/// Target of the images: the reference board's Cortex-M4F.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// Names a table for the image, to the build script.
pub const TABLE_VARIABLE: &str = "HOLDFAST_TABLE";
/// Symbol of the TABLE region's first byte, from the memory map.
const TABLE_START: &str = "__table_start";
/// Bytes of a record of Intel HEX.
const HEX_RECORD: usize = 16;

/// An image and the features that it needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Image {
    /// Name of its files.
    pub name: &'static str,
    binary: &'static str,
    features: &'static str,
    log: bool,
}

impl Image {
    const fn new(name: &'static str, binary: &'static str, features: &'static str) -> Self {
        Self {
            name,
            binary,
            features,
            log: false,
        }
    }

    /// Whether it is built with a feature.
    #[must_use]
    pub fn has(&self, feature: &str) -> bool {
        self.features.split(',').any(|name| name == feature)
    }

    /// An image of the product with log lines.
    #[must_use]
    pub const fn with_log(self) -> Self {
        Self { log: true, ..self }
    }
}

/// The product: zero crossings on a timer, control pilot and contactor.
pub const HOLDFAST: Image = Image::new("holdfast", "holdfast", "board");
/// Every build of the product: each frequency source with each kind of charger.
pub const PRODUCTS: [Image; 4] = [
    HOLDFAST,
    Image::new("holdfast-ade7953", "holdfast", "board,ade7953"),
    Image::new("holdfast-bidirectional", "holdfast", "board,bidirectional"),
    Image::new(
        "holdfast-ade7953-bidirectional",
        "holdfast",
        "board,ade7953,bidirectional",
    ),
];
/// Processor in the loop.
pub const PIL: Image = Image::new("pil", "pil", "pil");
/// The charger without a HAL, for measuring.
pub const BARE: Image = Image::new("bare", "bare", "bare");

/// Why an image cannot be built or read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Cargo or a file.
    #[error("{what}: {source}")]
    Io {
        /// What was tried.
        what: String,
        /// Why it failed.
        source: io::Error,
    },
    /// Cargo said no; its messages are above.
    #[error("cargo did not build the image {0}")]
    Build(&'static str),
    /// The file is not an ELF of the target.
    #[error("{path}: {source}", path = path.display())]
    Elf {
        /// The file.
        path: PathBuf,
        /// Why.
        source: object::Error,
    },
    /// A symbol of the memory map is missing.
    #[error("the image has no symbol {0}")]
    Symbol(&'static str),
    /// A record of Intel HEX cannot be written.
    #[error("Intel HEX: {0}")]
    Hex(String),
}

fn io_error(what: impl Into<String>) -> impl FnOnce(io::Error) -> ImageError {
    let what = what.into();
    |source| ImageError::Io { what, source }
}

fn cargo() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Builds an image and says where it is.
///
/// # Errors
/// Cargo is not there, or does not build it.
pub fn build(image: Image, target: &str) -> Result<PathBuf, ImageError> {
    build_with(image, target, None)
}

/// The same with a table of one's own, at an absolute path.
///
/// # Errors
/// As [`build`].
pub fn build_with(image: Image, target: &str, table: Option<&Path>) -> Result<PathBuf, ImageError> {
    let mut command = Command::new(cargo());
    match table {
        Some(path) => command.env(TABLE_VARIABLE, path),
        None => command.env_remove(TABLE_VARIABLE),
    };
    let output = command
        .args(["build", "--package", "product", "--profile", "firmware"])
        .args(["--target", target, "--bin", image.binary])
        .args(["--features", image.features])
        .args(if image.log {
            &["--features", "log"][..]
        } else {
            &[]
        })
        .args(["--message-format", "json-render-diagnostics"])
        .current_dir(root())
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .map_err(io_error("cargo build"))?;
    let failed = ImageError::Build(image.name);
    if !output.status.success() {
        return Err(failed);
    }
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == image.binary)
        .find_map(|message| Some(PathBuf::from(message["executable"].as_str()?)))
        .ok_or(failed)
}

/// An image's ELF file.
#[derive(Debug, Clone)]
pub struct Elf {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// A section that takes flash or RAM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Name.
    pub name: String,
    /// Address.
    pub address: u32,
    /// Bytes.
    pub size: u32,
    /// Whether it takes flash.
    pub in_flash: bool,
    /// Whether it takes RAM.
    pub in_ram: bool,
}

impl Elf {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = fs::read(path).map_err(io_error(path.display().to_string()))?;
        let path = path.to_owned();
        Ok(Self { path, bytes })
    }

    fn parse(&self) -> Result<ElfFile32<'_, Endianness>, ImageError> {
        ElfFile32::parse(&*self.bytes).map_err(|source| self.error(source))
    }

    fn error(&self, source: object::Error) -> ImageError {
        let path = self.path.clone();
        ImageError::Elf { path, source }
    }

    /// The sections that are not empty and take flash or RAM.
    ///
    /// # Errors
    /// Not an ELF file.
    pub fn sections(&self) -> Result<Vec<Section>, ImageError> {
        let file = self.parse()?;
        let sections = file.sections().filter_map(|section| {
            let kind = section.kind();
            let stored = matches!(
                kind,
                SectionKind::Text | SectionKind::ReadOnlyData | SectionKind::ReadOnlyString
            );
            let address = section.address() as u32;
            let in_ram = matches!(kind, SectionKind::Data | SectionKind::UninitializedData);
            // .uninit and .data are in RAM; .data's initial values are in flash as well.
            let section = Section {
                name: section.name().ok()?.to_owned(),
                address,
                size: section.size() as u32,
                in_flash: stored || kind == SectionKind::Data,
                in_ram,
            };
            let counts = section.size > 0 && (section.in_flash || section.in_ram);
            counts.then_some(section)
        });
        Ok(sections.collect())
    }

    /// Names of all symbols, mangled.
    ///
    /// # Errors
    /// Not an ELF file.
    pub fn symbols(&self) -> Result<Vec<String>, ImageError> {
        let file = self.parse()?;
        let names = file.symbols().filter_map(|symbol| symbol.name().ok());
        Ok(names.map(str::to_owned).collect())
    }

    /// Writes the file's bytes elsewhere.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), ImageError> {
        fs::write(path, &self.bytes).map_err(io_error(path.display().to_string()))
    }

    /// Address of a symbol.
    ///
    /// # Errors
    /// Not an ELF file.
    pub fn symbol(&self, name: &str) -> Result<Option<u32>, ImageError> {
        let file = self.parse()?;
        let found = file.symbols().find(|symbol| symbol.name() == Ok(name));
        Ok(found.map(|symbol| symbol.address() as u32))
    }

    /// Start of the TABLE region, as the memory map of the image's board has it.
    ///
    /// # Errors
    /// Not an ELF file, or one without a TABLE region.
    pub fn table_start(&self) -> Result<u32, ImageError> {
        let missing = || ImageError::Symbol(TABLE_START);
        self.symbol(TABLE_START)?.ok_or_else(missing)
    }

    /// What is written to flash: load address and bytes of each segment, in order.
    ///
    /// # Errors
    /// Not an ELF file.
    pub fn segments(&self) -> Result<Vec<(u32, Vec<u8>)>, ImageError> {
        let file = self.parse()?;
        let endian = file.endian();
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            let bytes = header
                .data(endian, &*self.bytes)
                .map_err(|()| self.error_text())?;
            if header.p_type(endian) == object::elf::PT_LOAD && !bytes.is_empty() {
                segments.push((header.p_paddr(endian), bytes.to_vec()));
            }
        }
        segments.sort_by_key(|(address, _)| *address);
        Ok(segments)
    }

    fn error_text(&self) -> ImageError {
        let source = io::Error::other("a segment reaches past the end of the file");
        ImageError::Io {
            what: self.path.display().to_string(),
            source,
        }
    }
}

/// Bytes from `start` up to the last segment below `end`, gaps filled with 0xFF as erased flash.
fn flat(segments: &[(u32, Vec<u8>)], start: u32, end: u32) -> Vec<u8> {
    let mut image = Vec::new();
    for (address, bytes) in segments {
        if (start..end).contains(address) {
            image.resize((address - start) as usize, 0xFF);
            image.extend_from_slice(bytes);
        }
    }
    image
}

/// Intel HEX of all segments.
fn hex(segments: &[(u32, Vec<u8>)]) -> Result<String, ImageError> {
    let mut records = Vec::new();
    let mut upper = None;
    for (start, bytes) in segments {
        for (n, chunk) in bytes.chunks(HEX_RECORD).enumerate() {
            // A record must not cross 64 KB: split it there.
            let address = start + (n * HEX_RECORD) as u32;
            let room = (0x1_0000 - (address & 0xFFFF)) as usize;
            let (first, second) = chunk.split_at(chunk.len().min(room));
            for (address, part) in [(address, first), (address + first.len() as u32, second)] {
                if part.is_empty() {
                    continue;
                }
                if upper != Some(address >> 16) {
                    upper = Some(address >> 16);
                    let high = (address >> 16) as u16;
                    records.push(ihex::Record::ExtendedLinearAddress(high));
                }
                records.push(ihex::Record::Data {
                    offset: address as u16,
                    value: part.to_vec(),
                });
            }
        }
    }
    records.push(ihex::Record::EndOfFile);
    ihex::create_object_file_representation(&records)
        .map_err(|error| ImageError::Hex(error.to_string()))
}

/// Writes ELF, BIN (code and, if there is one, table apart) and HEX (both) to a folder; the files'
/// names.
///
/// # Errors
/// A file cannot be written.
pub fn write(image: Image, elf: &Elf, folder: &Path) -> Result<Vec<PathBuf>, ImageError> {
    fs::create_dir_all(folder).map_err(io_error(folder.display().to_string()))?;
    let segments = elf.segments()?;
    let flash = segments.first().map_or(0, |(address, _)| *address);
    let table_start = elf.table_start()?;
    let name = image.name;
    let mut files = vec![
        (format!("{name}.elf"), elf.bytes.clone()),
        (format!("{name}.bin"), flat(&segments, flash, table_start)),
        (format!("{name}.hex"), hex(&segments)?.into_bytes()),
    ];
    let table = flat(&segments, table_start, u32::MAX);
    if !table.is_empty() {
        files.push((format!("{name}-table.bin"), table));
    }
    let mut written = Vec::new();
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::write(&path, bytes).map_err(io_error(path.display().to_string()))?;
        written.push(path);
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_splits_at_64_kilobytes_and_names_the_upper_half() {
        let bytes = vec![0xAB; 20];
        let text = hex(&[(0x0800_FFF8, bytes)]).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], ":020000040800F2");
        assert!(lines[1].starts_with(":08FFF800ABAB"));
        assert_eq!(lines[2], ":020000040801F1");
        assert!(lines[3].starts_with(":08000000ABAB"));
        assert!(lines[4].starts_with(":04000800ABAB"));
        assert_eq!(lines[5], ":00000001FF");
    }

    #[test]
    fn a_flat_image_fills_gaps_as_erased_flash() {
        const FLASH: u32 = 0x0800_0000;
        const TABLE: u32 = 0x080E_0000;
        let segments = [(FLASH, vec![1, 2]), (FLASH + 4, vec![3]), (TABLE, vec![4])];
        assert_eq!(flat(&segments, FLASH, TABLE), [1, 2, 0xFF, 0xFF, 3]);
        assert_eq!(flat(&segments, TABLE, u32::MAX), [4]);
    }
}
