//! The page in a browser: it shows what the frames say, comes back after a drop, and asks nobody
//! else.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![allow(clippy::panic, reason = "a browser that is not there fails the test")]

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use firmware::telemetry::{FRAME_MAX, Frame, TELEMETRY_VERSION, WireSetPoint, encode};
use live::feed::Feed;
use live::server::{Options, Page};
use live::source::{Pace, play};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket, stream::MaybeTlsStream};

/// How long anything may take.
const PATIENCE: Duration = Duration::from_secs(60);

fn frame(sequence: u32, f_uhz: i32, faults: u16) -> Frame {
    Frame {
        version: TELEMETRY_VERSION,
        sequence,
        now_ms: 100 * sequence,
        mode: 1,
        phase: 2,
        state: [f_uhz, -5, 6, 7],
        loss_kw: Some(1_320_000),
        participation_ppm: 250_000,
        set_point: WireSetPoint::PowerW(-7_000),
        faults,
        misfits: 0,
        table: None,
    }
}

fn bytes(frames: &[Frame]) -> Vec<u8> {
    let mut buffer = [0; FRAME_MAX];
    let line = |frame: &Frame| encode(frame, &mut buffer).to_vec();
    frames.iter().flat_map(line).collect()
}

fn serve(feed: &Arc<Feed>) -> Page {
    let options = Options {
        address: SocketAddr::from(([127, 0, 0, 1], 0)),
        host: None,
    };
    Page::serve(options, Arc::clone(feed)).unwrap()
}

/// The status line of a request with this host.
fn status(page: &Page, host: &str) -> String {
    let mut stream = TcpStream::connect(page.address()).unwrap();
    write!(stream, "GET /events HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let mut start = [0; 12];
    stream.read_exact(&mut start).unwrap();
    String::from_utf8_lossy(&start).into_owned()
}

#[test]
fn other_hosts_are_refused() {
    let page = serve(&Feed::new());
    assert_eq!(status(&page, "localhost"), "HTTP/1.1 200");
    assert_eq!(status(&page, "127.0.0.1:1"), "HTTP/1.1 200");
    for host in ["example.org", "localhost.example.org", "10.0.0.1"] {
        assert_eq!(status(&page, host), "HTTP/1.1 403", "{host}");
    }
}

/// A browser that is driven by its own protocol.
struct Browser {
    process: Child,
    _profile: tempfile::TempDir,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    session: Option<String>,
    last: u64,
    /// Addresses that the page asked for.
    requests: Vec<String>,
}

impl Browser {
    fn start() -> Self {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let has = |name: &&str| Command::new(name).arg("--version").output().is_ok();
        let Some(program) = names.into_iter().find(has) else {
            panic!("no Chromium on the search path; cargo test-all prerequisites installs it");
        };
        let profile = tempfile::tempdir().unwrap();
        let process = Command::new(program)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
            ])
            .args(["--disable-sync", "--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let port_file = profile.path().join("DevToolsActivePort");
        let told = wait("the browser", || {
            let text = std::fs::read_to_string(&port_file).ok()?;
            let (port, path) = text.split_once('\n')?;
            Some(format!("ws://127.0.0.1:{port}{}", path.trim()))
        });
        let (socket, _) = tungstenite::connect(told).unwrap();
        let mut browser = Self {
            process,
            _profile: profile,
            socket,
            session: None,
            last: 0,
            requests: Vec::new(),
        };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        let attached = browser.call("Target.attachToTarget", attach);
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        browser.call("Network.enable", json!({}));
        browser
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.last += 1;
        let mut request = json!({"id": self.last, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            request["sessionId"] = session.clone().into();
        }
        self.socket
            .send(Message::text(request.to_string()))
            .unwrap();
        loop {
            let message = self.socket.read().unwrap();
            let answer: Value = serde_json::from_str(message.to_text().unwrap()).unwrap();
            if answer["method"] == "Network.requestWillBeSent" {
                let url = answer["params"]["request"]["url"].as_str().unwrap();
                self.requests.push(url.to_owned());
            }
            if answer["id"] == self.last {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The value of an expression on the page.
    fn value(&mut self, expression: &str) -> Value {
        let found = self.call(
            "Runtime.evaluate",
            json!({"expression": expression, "returnByValue": true}),
        );
        found["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    fn until(&mut self, expression: &str) {
        wait(expression, || {
            (self.value(expression) == true).then_some(())
        });
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Its own process, by its handle.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn wait<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "waited in vain for: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A line between the browser and the server that can be cut.
struct Line {
    address: SocketAddr,
    state: Arc<Mutex<Wires>>,
}

#[derive(Default)]
struct Wires {
    cut: bool,
    open: Vec<TcpStream>,
}

impl Line {
    fn to(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(Wires::default()));
        let wires = Arc::clone(&state);
        std::thread::spawn(move || {
            for near in listener.incoming() {
                let near = near.unwrap();
                let mut wires = wires.lock().unwrap();
                if wires.cut {
                    continue;
                }
                let far = TcpStream::connect(server).unwrap();
                for (from, to) in [(&near, &far), (&far, &near)] {
                    let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    // Ends with the connection, whoever ends it.
                    std::thread::spawn(move || std::io::copy(&mut from, &mut to));
                }
                wires.open.extend([near, far]);
            }
        });
        Self { address, state }
    }

    fn cut(&self) {
        let mut wires = self.state.lock().unwrap();
        wires.cut = true;
        for wire in wires.open.drain(..) {
            // One that has ended already is as cut as it can be.
            let _ = wire.shutdown(Shutdown::Both);
        }
    }

    fn mend(&self) {
        self.state.lock().unwrap().cut = false;
    }
}

/// What a card of the page shows, as one text for each field.
const SHOWN: &str = "JSON.stringify([...document.querySelectorAll('section')].map(s => [s.querySelector('h2').textContent, \
     ...['frequency','phase','mode','participation','set_point','loss','faults','sequence'].map(n => s.querySelector(`[data-is=${n}]`).textContent), \
     s.querySelectorAll('.fails').length]))";

#[test]
fn the_page_shows_the_frames_and_comes_back_after_a_drop() {
    let feed = Feed::new();
    let page = serve(&feed);
    let line = Line::to(page.address());
    let address = line.address;
    let push = |charger: &str, frames: &[Frame]| {
        let recording = bytes(frames);
        let played = play(
            charger,
            &mut recording.as_slice(),
            Pace::Times(1e6),
            &feed,
            &|| false,
        );
        assert_eq!(played.unwrap(), frames.len() as u64);
    };
    let falling: Vec<Frame> = (1..=40).map(|n| frame(n, -10_000 * n as i32, 0)).collect();
    push("one", &falling);
    push("two", &[frame(7, 0, 0x81)]);

    let mut browser = Browser::start();
    browser.call(
        "Page.navigate",
        json!({"url": format!("http://{address}/")}),
    );
    browser.until("document.querySelectorAll('section').length === 2 && document.querySelectorAll('[data-is=sequence]')[0].textContent === '40'");
    let shown = |browser: &mut Browser| -> Value {
        serde_json::from_str(browser.value(SHOWN).as_str().unwrap()).unwrap()
    };
    // -0.4 Hz; phase 2 is C2; 25 %; 7 kW to the grid; faults 0 and 7 break two assumptions.
    let expected = json!([
        [
            "one", "49.6000", "C2", "table", "25.00", "-7.0 kW", "1.32", "-", "40", 0
        ],
        [
            "two",
            "50.0000",
            "C2",
            "table",
            "25.00",
            "-7.0 kW",
            "1.32",
            "bus outside-domain",
            "7",
            2
        ],
    ]);
    assert_eq!(shown(&mut browser), expected);
    assert_eq!(
        browser.value("document.querySelector('polyline').points.numberOfItems"),
        40
    );
    assert_eq!(
        browser.value("document.documentElement.scrollWidth > innerWidth"),
        false
    );

    // The line is cut and mended: the page comes back by itself and goes on where it was.
    line.cut();
    browser.until("document.getElementById('link').className === 'lost'");
    line.mend();
    browser.until("document.getElementById('link').textContent === 'connected'");
    push("one", &[frame(41, -123_400, 0)]);
    browser.until("document.querySelectorAll('[data-is=sequence]')[0].textContent === '41'");
    assert_eq!(shown(&mut browser)[0][1], "49.8766");

    let ours = format!("http://{address}/");
    assert!(browser.requests.len() >= 4, "{:?}", browser.requests);
    for url in &browser.requests {
        assert!(url.starts_with(&ours) || url == "data:,", "{url}");
    }
}
