//! The page and its events over HTTP.
//!
//! Who may ask: the server listens on a loopback address and answers requests for `localhost` or a
//! loopback address alone (the `Host` header), so that a page of another host cannot read the
//! telemetry by a name that it has pointed here. [`Options::host`] allows one more name, and with
//! it an address that others can reach.

use std::io::{self, Write};
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tiny_http::{Header, Method, Request, Response, Server};

use crate::feed::Feed;

/// Silence after which a comment is sent, by which both sides notice a broken connection.
const KEEP_ALIVE: Duration = Duration::from_secs(2);
/// Time between two looks at `stop`.
const NAP: Duration = Duration::from_millis(100);
/// Time after which the browser connects again \[ms\].
const RETRY_MS: u32 = 500;
/// The page may run its own script and ask its own server, and nothing else.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
                      connect-src 'self'; img-src data:; frame-ancestors 'none'; base-uri 'none'";

const PAGE: &str = include_str!("page/live.html");
const SCRIPT: &str = include_str!("page/live.js");
const STYLE: &str = include_str!("page/live.css");

/// How the server is run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Where it listens; port 0 takes a free one.
    pub address: SocketAddr,
    /// A host name that it answers to besides the loopback's.
    pub host: Option<String>,
}

/// Why the page is not served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Others could reach it.
    #[error(
        "{address} can be reached by others; allowed: a loopback address, or any with --host NAME"
    )]
    Reachable {
        /// The address.
        address: SocketAddr,
    },
    /// The address cannot be taken.
    #[error("{address}: {reason}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// Why.
        reason: String,
    },
}

/// A server that runs until it is dropped.
pub struct Page {
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Page {
    /// Serves a feed.
    ///
    /// # Errors
    /// An address that others can reach, or that cannot be taken.
    pub fn serve(options: Options, feed: Arc<Feed>) -> Result<Self, ServeError> {
        let address = options.address;
        if !address.ip().is_loopback() && options.host.is_none() {
            return Err(ServeError::Reachable { address });
        }
        let listen = |reason: String| ServeError::Listen { address, reason };
        let server = Server::http(address).map_err(|error| listen(error.to_string()))?;
        let taken = server.server_addr().to_ip();
        let address = taken.ok_or_else(|| listen("not an IP address".to_owned()))?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                // An error of one connection is its own.
                if let Ok(Some(request)) = server.recv_timeout(NAP) {
                    answer(request, &options, &feed, &stopped);
                }
            }
        });
        Ok(Self {
            address,
            stop,
            thread: Some(thread),
        })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has nothing to say.
            let _ = thread.join();
        }
    }
}

/// Answers a request; a reader of events gets a thread of its own.
fn answer(request: Request, options: &Options, feed: &Arc<Feed>, stop: &Arc<AtomicBool>) {
    let host = header(&request, "Host");
    if !host.is_some_and(|host| is_ours(host, options)) {
        let words = "403: this page is for this machine alone (the Host header names another)\n";
        return reply(request, 403, "text/plain", words);
    }
    if *request.method() != Method::Get {
        return reply(request, 405, "text/plain", "405: GET alone\n");
    }
    match request.url() {
        "/" => reply(request, 200, "text/html; charset=utf-8", PAGE),
        "/live.js" => reply(request, 200, "text/javascript; charset=utf-8", SCRIPT),
        "/live.css" => reply(request, 200, "text/css; charset=utf-8", STYLE),
        "/events" => {
            let (feed, stop) = (Arc::clone(feed), Arc::clone(stop));
            std::thread::spawn(move || {
                // The reader has gone: nobody is left to tell.
                let _ = events(request, &feed, &stop);
            });
        }
        _ => reply(
            request,
            404,
            "text/plain",
            "404: /, /live.js, /live.css, /events\n",
        ),
    }
}

fn header<'r>(request: &'r Request, name: &'static str) -> Option<&'r str> {
    let mut headers = request.headers().iter();
    let found = headers.find(|header| header.field.equiv(name));
    found.map(|header| header.value.as_str())
}

/// Whether a `Host` header names this server.
fn is_ours(host: &str, options: &Options) -> bool {
    // A port, if any, follows the last colon that is not inside brackets.
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    name.eq_ignore_ascii_case("localhost")
        || bare
            .parse::<IpAddr>()
            .is_ok_and(|address| address.is_loopback())
        || options
            .host
            .as_deref()
            .is_some_and(|ours| name.eq_ignore_ascii_case(ours))
}

fn reply(request: Request, status: u16, kind: &str, body: &str) {
    let fields = [
        ("Content-Type", kind),
        ("Content-Security-Policy", POLICY),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cache-Control", "no-store"),
    ];
    let mut response = Response::from_string(body).with_status_code(status);
    for (name, value) in fields {
        if let Ok(header) = Header::from_bytes(name, value) {
            response.add_header(header);
        }
    }
    // The reader has gone: nobody is left to tell.
    let _ = request.respond(response);
}

/// Sends ticks until the reader goes.
fn events(request: Request, feed: &Feed, stop: &AtomicBool) -> io::Result<()> {
    let last = header(&request, "Last-Event-ID").and_then(|id| id.parse::<u64>().ok());
    let mut next = last.map_or(0, |last| last.saturating_add(1));
    let mut writer = request.into_writer();
    write!(
        writer,
        "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nConnection: close\r\n\r\nretry: {RETRY_MS}\n\n"
    )?;
    writer.flush()?;
    while !stop.load(Ordering::Relaxed) {
        let ticks = feed.wait(next, KEEP_ALIVE);
        if ticks.is_empty() {
            writer.write_all(b": still here\n\n")?;
        }
        for (number, text) in ticks {
            write!(writer, "id: {number}\ndata: {text}\n\n")?;
            next = number + 1;
        }
        writer.flush()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hosts_that_are_ours() {
        let mut options = Options {
            address: SocketAddr::from(([127, 0, 0, 1], 0)),
            host: None,
        };
        for host in [
            "localhost",
            "LOCALHOST:8080",
            "127.0.0.1:8080",
            "127.0.0.1",
            "[::1]:80",
            "[::1]",
        ] {
            assert!(is_ours(host, &options), "{host}");
        }
        for host in [
            "",
            "example.org",
            "localhost.example.org",
            "127.0.0.1.example.org",
            "192.168.0.7:8080",
            "box:80",
        ] {
            assert!(!is_ours(host, &options), "{host}");
        }
        options.host = Some("box".to_owned());
        assert!(is_ours("box:80", &options) && !is_ours("boxes:80", &options));
    }

    #[test]
    fn an_address_that_others_reach_needs_a_name() {
        let options = Options {
            address: SocketAddr::from(([0, 0, 0, 0], 0)),
            host: None,
        };
        let refused = Page::serve(options, Feed::new());
        assert!(matches!(refused, Err(ServeError::Reachable { .. })));
    }
}
