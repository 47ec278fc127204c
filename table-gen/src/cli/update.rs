//! `update`: a signed container into the slots of a charger's flash, as the charger would do it.

use std::path::PathBuf;

use embedded_storage::nor_flash::NorFlash as _;
use serde::Serialize;
use update::device::Device;
use update::key::PublicKey;
use update::layout::{Layout, Slot};
use update::mapped::MemoryFlash;
use update::marks::TRIALS;
use update::slots::{Running, Slots};

use super::files::write_one;
use super::{Failure, OutputArgs, output, signing};

/// Bytes of a slot of the reference board: a sector.
const SLOT_LEN: u32 = 128 * 1024;

/// Unit of erasing of a file.
const ERASE: u32 = MemoryFlash::ERASE_SIZE as u32;

/// Arguments of `update`.
#[derive(Debug, clap::Args)]
pub(super) struct UpdateArgs {
    /// The container, as `sign` writes it
    #[arg(value_name = "CONTAINER")]
    container: PathBuf,
    /// The charger's two slots: their bytes, A before B. Written if the charger takes the
    /// container; erased flash if there is no such file
    #[arg(long, value_name = "FILE")]
    flash: PathBuf,
    /// The charger, by the name of its image
    #[arg(long, value_name = "NAME")]
    product: String,
    /// Public key that its image was built with
    #[arg(long, value_name = "KEY.pub")]
    trust: PathBuf,
    /// What the charger takes for the time, such as 2027-01-31T00:00:00Z; it has no clock of its
    /// own
    #[arg(long, value_name = "TIME", value_parser = signing::moment)]
    now: Option<u32>,
    /// Say what the charger would do, and write nothing
    #[arg(long)]
    dry_run: bool,
    /// Bytes of a slot
    #[arg(long, value_name = "N", default_value_t = SLOT_LEN)]
    slot_bytes: u32,
    #[command(flatten)]
    output: OutputArgs,
}

/// A table in force.
#[derive(Debug, Serialize)]
struct InForce {
    slot: &'static str,
    version: u32,
    confirmed: bool,
}

#[derive(Debug, Serialize)]
struct UpdateReport {
    /// What is in force before.
    before: Option<InForce>,
    /// What is in force at the next start.
    after: Option<InForce>,
    written: bool,
}

/// Runs the command.
pub(super) fn run(args: &UpdateArgs) -> Result<(), Failure> {
    let container = signing::read(&args.container)?;
    let (product, class) = signing::product(&args.product)?;
    let charger = signing::charger(&product, class, signing::trusted(&args.trust)?);
    let layout = Layout::new(0, args.slot_bytes, args.slot_bytes);
    let layout = layout.filter(|_| args.slot_bytes.is_multiple_of(ERASE));
    let layout = layout.ok_or_else(|| {
        let found = args.slot_bytes;
        let reason = format!("--slot-bytes {found}; allowed: multiples of {ERASE}, to 2147483392");
        Failure::BadInput(reason)
    })?;
    let len = 2 * args.slot_bytes as usize;
    let mut flash = match std::fs::read(&args.flash) {
        Ok(bytes) if bytes.len() == len => bytes,
        Ok(bytes) => {
            let found = bytes.len();
            let reason = format!("{found} bytes, and two slots have {len} (--slot-bytes)");
            return Err(signing::in_file(&args.flash, reason));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => vec![0xFF; len],
        Err(error) => return Err(signing::in_file(&args.flash, error)),
    };
    // A look at a copy: a start notes a trial.
    let before = starts_with(&flash, layout, charger);
    let mut slots = Slots::start(MemoryFlash(&mut flash), layout, charger);
    slots
        .install(&container, args.now)
        .map_err(|refusal| refused(args, signing::told(refusal)))?;
    let after = starts_with(&flash, layout, charger);
    if !args.dry_run {
        write_one(&args.flash, &flash)?;
    }
    let report = UpdateReport {
        before: before.as_ref().map(InForce::from),
        after: after.as_ref().map(InForce::from),
        written: !args.dry_run,
    };
    if args.output.json {
        return output::json(&report);
    }
    output::line(format_args!("in force before: {}", shown(&report.before)));
    output::line(format_args!(
        "from the next start: {}",
        shown(&report.after)
    ));
    output::line(if report.written {
        format!("wrote {}", args.flash.display())
    } else {
        "nothing was written".to_owned()
    });
    Ok(())
}

fn refused(args: &UpdateArgs, reason: String) -> Failure {
    let container = args.container.display();
    Failure::No(format!(
        "{container}: the charger refuses it: {reason}; nothing was written"
    ))
}

/// The table that a charger starts with.
fn starts_with(flash: &[u8], layout: Layout, charger: Device<PublicKey>) -> Option<Running> {
    let mut copy = flash.to_vec();
    let slots = Slots::start(MemoryFlash(&mut copy), layout, charger);
    slots.running().cloned()
}

impl From<&Running> for InForce {
    fn from(running: &Running) -> Self {
        Self {
            slot: match running.slot {
                Slot::A => "A",
                Slot::B => "B",
            },
            version: running.version,
            confirmed: running.confirmed,
        }
    }
}

fn shown(in_force: &Option<InForce>) -> String {
    let Some(in_force) = in_force else {
        return "the built-in table, or the droop without one".to_owned();
    };
    let InForce { slot, version, .. } = in_force;
    if in_force.confirmed {
        format!("version {version} in slot {slot}, confirmed")
    } else {
        format!("version {version} in slot {slot}, on trial: {TRIALS} starts to be confirmed in")
    }
}
