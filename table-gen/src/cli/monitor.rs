//! `monitor`: chargers' telemetry, live or from recordings, as lines or as a page.

use std::fs::File;
use std::io::Read;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Failure, OutputArgs, output, progress};
use lab::telemetry_lines;
use live::feed::Feed;
use live::server::{Options, Page};
use live::source::{self, Pace};
use service_client::introductions::{self, Introductions};

/// Fastest and slowest that a recording is played.
const SPEED: [f64; 2] = [0.01, 1000.0];

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub(super) struct MonitorArgs {
    /// Serial port (set its speed first: stty -F PORT 115200 raw -echo) or recorded file; - for
    /// standard input; with --serve any number of them
    #[arg(value_name = "PORT|FILE", required = true)]
    sources: Vec<PathBuf>,
    /// Print every N-th tick; ticks that change mode, phase or faults are always printed
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Show the chargers on a page at this address, such as 127.0.0.1:8080
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["every", "json"])]
    serve: Option<SocketAddr>,
    /// Play recordings so many times as fast as they were made
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "serve")]
    speed: f64,
    /// Answer requests for this host name too; with it an address that others can reach is allowed
    #[arg(long, value_name = "NAME", requires = "serve")]
    host: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

pub(super) fn run(args: &MonitorArgs) -> Result<(), Failure> {
    if let Some(address) = args.serve {
        return serve(args, address);
    }
    let [source] = args.sources.as_slice() else {
        let reason = "more than one PORT|FILE; allowed: one, or any number with --serve";
        return Err(Failure::BadInput(reason.to_owned()));
    };
    lines(args, source)
}

/// The telemetry of a port, a recording or standard input. Who the charger says that it is goes to
/// standard error, at first and when it has changed.
fn open(source: &Path) -> Result<Box<dyn Read + Send>, Failure> {
    let stream: Box<dyn Read + Send> = if source.as_os_str() == "-" {
        Box::new(std::io::stdin())
    } else {
        Box::new(File::open(source).map_err(|error| failed(source, error))?)
    };
    let name = source.display().to_string();
    let mut last = String::new();
    let found = move |who: &::service::message::Identity| {
        let line = introductions::line(who);
        if line != last {
            eprintln!("{name}: {line}");
            last = line;
        }
    };
    Ok(Box::new(Introductions::new(stream, Box::new(found))))
}

fn failed(source: &Path, error: impl std::fmt::Display) -> Failure {
    Failure::BadInput(format!("{}: {error}", source.display()))
}

fn nothing_found(source: &Path) -> Failure {
    Failure::No(format!(
        "{}: no telemetry frame was found",
        source.display()
    ))
}

fn lines(args: &MonitorArgs, source: &Path) -> Result<(), Failure> {
    let mut stream = open(source)?;
    let mut stdout = std::io::stdout();
    let out: Option<&mut dyn std::io::Write> = if args.output.json {
        None
    } else {
        Some(&mut stdout)
    };
    progress::catch_interrupts();
    let summary = match telemetry_lines::watch(&mut stream, out, args.every, &progress::interrupted)
    {
        Ok(summary) => summary,
        // Whoever read the lines has seen enough.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
        Err(error) => return Err(failed(source, error)),
    };
    if args.output.json {
        output::json(&summary)?;
    } else {
        eprintln!(
            "{} frames, {} lost, {} rejected, {} of another version",
            summary.frames, summary.lost, summary.rejected, summary.other_version
        );
    }
    if summary.frames == 0 {
        return Err(nothing_found(source));
    }
    Ok(())
}

fn serve(args: &MonitorArgs, address: SocketAddr) -> Result<(), Failure> {
    let [slowest, fastest] = SPEED;
    if !(slowest..=fastest).contains(&args.speed) {
        let speed = args.speed;
        let reason = format!("--speed = {speed} is out of range: {slowest} to {fastest}");
        return Err(Failure::BadInput(reason));
    }
    let mut streams = Vec::new();
    for source in &args.sources {
        streams.push((source, open(source)?));
    }
    progress::catch_interrupts();
    let feed = Feed::new();
    let options = Options {
        address,
        host: args.host.clone(),
    };
    let page = Page::serve(options, Arc::clone(&feed)).map_err(Failure::bad)?;
    eprintln!(
        "http://{}/ shows {} chargers; Ctrl-C ends it",
        page.address(),
        streams.len()
    );
    std::thread::scope(|scope| {
        let players: Vec<_> = streams
            .into_iter()
            .map(|(source, mut stream)| {
                let feed = &feed;
                scope.spawn(move || {
                    let name = source.display().to_string();
                    let pace = pace(source, args.speed);
                    let played =
                        source::play(&name, &mut stream, pace, feed, &progress::interrupted);
                    match played {
                        Ok(0) => eprintln!("{name}: no telemetry frame was found"),
                        Ok(frames) => eprintln!("{name}: its end, after {frames} frames"),
                        Err(error) => eprintln!("{name}: {error}"),
                    }
                })
            })
            .collect();
        // The page stays when recordings have ended.
        while !progress::interrupted() {
            std::thread::sleep(std::time::Duration::from_millis(100));
        }
        // A port that says nothing does not come back from its read: the process ends with its
        // page.
        if players.iter().any(|player| !player.is_finished()) {
            std::thread::sleep(std::time::Duration::from_millis(200));
            if players.iter().any(|player| !player.is_finished()) {
                std::process::exit(0);
            }
        }
    });
    Ok(())
}

/// A recording is played by its clock, a port as it comes.
fn pace(source: &Path, speed: f64) -> Pace {
    let is_file = std::fs::metadata(source).is_ok_and(|about| about.is_file());
    if is_file {
        Pace::Times(speed)
    } else {
        Pace::Live
    }
}
