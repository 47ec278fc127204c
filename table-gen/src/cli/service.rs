//! `service`: reads a charger over its telemetry line, and has orders carried out.

use std::path::PathBuf;

use ::service::message::{Order, Pairs};
use clap::{Subcommand, ValueEnum};
use firmware::telemetry::TableId;
use serde_json::{Value, json};
use service_client::client::{self, Client, ClientError};
use service_client::key_file;
use settings::key::Key;
use settings::orders::{LIMIT_MOST_MA, ORDER_MOST_S};

use super::{Failure, OutputArgs, output};

/// Arguments of `service`.
#[derive(Debug, clap::Args)]
pub(super) struct ServiceArgs {
    /// Serial port of the charger
    #[arg(value_name = "PORT")]
    port: PathBuf,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Who it is: build, serial number, table, whether it has a key
    Identity(OutputArgs),
    /// How it is: mode, set-point, limits in force, override
    Status(OutputArgs),
    /// Every setting: value, range, default
    Settings(OutputArgs),
    /// Change settings, all or none of them; limits at once, the rest from the next start on
    Set(SetArgs),
    /// Every setting at its default
    Defaults(KeyArgs),
    /// Limit the current until the next start or for a while
    Limit(LimitArgs),
    /// Charge whatever the grid needs, or pause
    Override(OverrideArgs),
    /// Start again
    Restart(KeyArgs),
    /// Give the first key to a charger that has none; only on a line that nobody else hears
    Provision(KeyArgs),
    /// Replace the key
    NewKey(NewKeyArgs),
    /// Which table that came by update is in force, and which waits for the next start
    Tables(OutputArgs),
    /// Send a signed table, to be in force from the next start on
    Install(InstallArgs),
}

#[derive(Debug, clap::Args)]
struct InstallArgs {
    /// Container written by `sign`
    #[arg(value_name = "FILE")]
    container: PathBuf,
}

#[derive(Debug, clap::Args)]
struct KeyArgs {
    /// The charger's key: 32 bytes in Base64
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
}

#[derive(Debug, clap::Args)]
struct SetArgs {
    /// Settings, such as rated_current_ma=16000
    #[arg(value_name = "KEY=VALUE", required = true)]
    settings: Vec<String>,
    #[command(flatten)]
    key: KeyArgs,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Source {
    User,
    Site,
    Cable,
}

#[derive(Debug, clap::Args)]
struct LimitArgs {
    /// Whose limit
    source: Source,
    /// Current in each phase [mA], below 6000 a pause; none gives it back to its setting
    #[arg(value_name = "MA|none", value_parser = limit)]
    limit: Limit,
    #[command(flatten)]
    time: TimeArgs,
    #[command(flatten)]
    key: KeyArgs,
}

/// A limit, or none.
#[derive(Debug, Clone, Copy)]
struct Limit(Option<u32>);

fn limit(text: &str) -> Result<Limit, String> {
    if text == "none" {
        return Ok(Limit(None));
    }
    let ma = text.parse().ok().filter(|ma| *ma <= LIMIT_MOST_MA);
    ma.map(|ma| Limit(Some(ma)))
        .ok_or_else(|| format!("allowed: 0 to {LIMIT_MOST_MA}, or none"))
}

#[derive(Debug, clap::Args)]
struct TimeArgs {
    /// For how long [s]; 0 until the next start
    #[arg(long, value_name = "S", default_value_t = 0,
        value_parser = clap::value_parser!(u32).range(..=i64::from(ORDER_MOST_S)))]
    for_s: u32,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Owner {
    None,
    Charge,
    Pause,
}

#[derive(Debug, clap::Args)]
struct OverrideArgs {
    /// What the owner wants
    what: Owner,
    #[command(flatten)]
    time: TimeArgs,
    #[command(flatten)]
    key: KeyArgs,
}

#[derive(Debug, clap::Args)]
struct NewKeyArgs {
    #[command(flatten)]
    key: KeyArgs,
    /// The new key: 32 bytes in Base64
    #[arg(long, value_name = "FILE")]
    new: PathBuf,
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        match error {
            ClientError::Port { .. } => Self::bad(error),
            _ => Self::No(error.to_string()),
        }
    }
}

pub(super) fn run(args: &ServiceArgs) -> Result<(), Failure> {
    // What can be wrong without a charger comes first.
    let order = match &args.action {
        Action::Identity(out) => return identity(&mut Client::open(&args.port)?, *out),
        Action::Status(out) => return status(&mut Client::open(&args.port)?, *out),
        Action::Settings(out) => return all_settings(&mut Client::open(&args.port)?, *out),
        Action::Provision(key) => {
            let key = read_key(&key.key)?;
            return Ok(Client::open(&args.port)?.provision(&key)?);
        }
        Action::NewKey(keys) => {
            let (key, new) = (read_key(&keys.key.key)?, read_key(&keys.new)?);
            return Ok(Client::open(&args.port)?.new_key(&key, &new)?);
        }
        Action::Tables(out) => return tables(&mut Client::open(&args.port)?, *out),
        Action::Install(install) => return self::install(args, install),
        Action::Set(set) => (&set.key, Order::Settings(pairs(&set.settings)?)),
        Action::Defaults(key) => (key, Order::Defaults),
        Action::Limit(limit) => {
            let order = Order::Limit {
                source: limit.source as u8,
                ma: limit.limit.0,
                for_s: limit.time.for_s,
            };
            (&limit.key, order)
        }
        Action::Override(owner) => {
            let order = Order::Override {
                what: owner.what as u8,
                for_s: owner.time.for_s,
            };
            (&owner.key, order)
        }
        Action::Restart(key) => (key, Order::Restart),
    };
    let (key, order) = (read_key(&order.0.key)?, order.1);
    Ok(Client::open(&args.port)?.order(&key, &order)?)
}

fn read_key(path: &std::path::Path) -> Result<::service::seal::DeviceKey, Failure> {
    key_file::read(path).map_err(Failure::bad)
}

/// Settings as they are written on the command line, each within its range.
fn pairs(texts: &[String]) -> Result<Pairs, Failure> {
    let mut pairs = Pairs::new();
    for text in texts {
        let (name, value) = text.split_once('=').ok_or_else(|| {
            Failure::BadInput(format!("{text}: not a setting; allowed: KEY=VALUE"))
        })?;
        let key = Key::of_name(name).ok_or_else(|| {
            let names = Key::ALL.map(|key| key.about().name).join(", ");
            Failure::BadInput(format!("{name}: no such setting; allowed: {names}"))
        })?;
        let about = key.about();
        let allowed = about.least..=about.most;
        let value = value.parse().ok().filter(|value| allowed.contains(value));
        let value = value.ok_or_else(|| {
            let (least, most) = (about.least, about.most);
            Failure::BadInput(format!("{text} is out of range: {least} to {most}"))
        })?;
        if pairs.push((key.number(), value)).is_err() {
            let reason = "more settings than fit an order; allowed: 16";
            return Err(Failure::BadInput(reason.to_owned()));
        }
    }
    Ok(pairs)
}

fn table(table: Option<&TableId>) -> Value {
    table.map_or(Value::Null, |table| {
        let hash: String = table.spec_hash.iter().map(|b| format!("{b:02x}")).collect();
        json!({ "spec_hash": hash, "crc": format!("{:08x}", table.crc) })
    })
}

/// One JSON object, or its members as lines.
fn show(value: &Value, out: OutputArgs) -> Result<(), Failure> {
    if out.json {
        return output::json(value);
    }
    for (name, value) in value.as_object().into_iter().flatten() {
        let text = value
            .as_str()
            .map_or_else(|| value.to_string(), str::to_owned);
        output::line(format_args!("{name:14} {text}"));
    }
    Ok(())
}

fn identity(client: &mut Client, out: OutputArgs) -> Result<(), Failure> {
    let found = client.identity()?;
    let origin = match found.settings {
        0 => "defaults",
        1 => "stored",
        _ => "unreadable: it offers nothing",
    };
    let value = json!({
        "build": found.build.as_str(),
        "serial": format!("{:08x}", found.serial),
        "direction": if found.direction == 0 { "unidirectional" } else { "bidirectional" },
        "meter": if found.meter == 0 { "zero crossings" } else { "ADE7953" },
        "table": table(found.table.as_ref()),
        "has_key": found.provisioned,
        "settings": origin,
    });
    show(&value, out)
}

fn tables(client: &mut Client, out: OutputArgs) -> Result<(), Failure> {
    let found = client.update_state()?;
    let value = json!({
        "in_force": found.running,
        "slot": found.running.map(|_| if found.slot == 0 { "A" } else { "B" }),
        "on_trial": found.running.map(|_| !found.confirmed),
        "from_next_start": found.waiting,
        "container_max": found.room,
    });
    show(&value, out)
}

fn install(args: &ServiceArgs, install: &InstallArgs) -> Result<(), Failure> {
    let path = &install.container;
    let bytes = std::fs::read(path)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))?;
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let now_s = now.ok().and_then(|now| u32::try_from(now.as_secs()).ok());
    let version = Client::open(&args.port)?.install(&bytes, now_s)?;
    output::line(format_args!(
        "version {version} is in force from the next start on, and kept once it has run well"
    ));
    Ok(())
}

fn status(client: &mut Client, out: OutputArgs) -> Result<(), Failure> {
    let found = client.status()?;
    let [user, site, cable] = found.limits_ma;
    let owner = match found.owner {
        0 => "none",
        1 => "charge",
        _ => "pause",
    };
    let value = json!({
        "limits_ma": { "user": user, "site": site, "cable": cable },
        "override": owner,
        "override_s": if found.owner_s == u32::MAX { Value::Null } else { found.owner_s.into() },
        "waiting": found.waiting,
        "tick": found.frame.map(|frame| frame.sequence),
        "f_hz": found.frame.map(|frame| 50.0 + f64::from(frame.state[0]) * 1e-6),
        "participation_ppm": found.frame.map(|frame| frame.participation_ppm),
        "set_point": found.frame.map(|frame| format!("{:?}", frame.set_point)),
        "faults": found.frame.map(|frame| frame.faults),
        "misfits": found.frame.map(|frame| frame.misfits),
        "table": table(found.frame.and_then(|frame| frame.table).as_ref()),
    });
    show(&value, out)
}

fn all_settings(client: &mut Client, out: OutputArgs) -> Result<(), Failure> {
    let found = client.settings()?;
    if out.json {
        let members = found
            .iter()
            .map(|(number, value)| (client::name(*number), Value::from(*value)));
        return output::json(&Value::Object(members.collect()));
    }
    let mut rows = output::table(&["setting", "value", "least", "most", "default"]);
    for (number, value) in found {
        let about = Key::of_number(number).map(Key::about);
        let number_of = |of: fn(&settings::key::About) -> u32| {
            about
                .as_ref()
                .map_or_else(|| "?".to_owned(), |about| of(about).to_string())
        };
        rows.add_row([
            client::name(number),
            value.to_string(),
            number_of(|about| about.least),
            number_of(|about| about.most),
            number_of(|about| about.default),
        ]);
    }
    output::line(rows);
    Ok(())
}
