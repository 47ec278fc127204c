//! The report: its numbers are those of the runs, it is the same every time, and a browser shows
//! it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test that cannot go on fails"
)]

use std::process::Command;
use std::sync::OnceLock;

use firmware::table::TableView;
use lab::compare::chargers::ChargersConfig;
use lab::compare::{CompareConfig, compare};
use lab::fleet::FleetConfig;
use lab::report::digits;
use lab::report::figure::thin;
use lab::report::study::{BaselineEvent, Study, frequency, steady_states};
use lab::report::{Findings, FleetFinding, Rendered, render_studies};
use lab::simulation::closed_loop::{Estimator, simulate};
use lab::simulation::scenario::Scenario;
use lab::simulation::trajectory::Run;
use model::verdict::{Counts, Method, Verdict};
use serde_json::Value;
use tests::testing::{dense, load};

/// Runs of the robustness section: enough to fill it.
const RUNS: usize = 20;

fn study() -> &'static Study {
    static STUDY: OnceLock<Study> = OnceLock::new();
    STUDY.get_or_init(|| {
        let (spec, bytes) = dense("paper-bi");
        Study::new(&spec, &bytes, RUNS).unwrap()
    })
}

/// What other commands found, each with something to show.
fn findings() -> &'static Findings {
    static FINDINGS: OnceLock<Findings> = OnceLock::new();
    FINDINGS.get_or_init(find)
}

fn find() -> Findings {
    let spec = &study().spec;
    let table = TableView::parse(&study().table).unwrap();
    let config = CompareConfig {
        losses_gw: vec![1.0, 2.0],
        duration_s: 60.0,
        chargers: ChargersConfig::of(spec, 10),
        ..CompareConfig::of(spec)
    };
    let found = compare(spec, &table, &config, &|| true).unwrap();
    let fleet = FleetConfig::sound(spec, 10);
    let scenario = Scenario::of(spec);
    let run = lab::fleet::run(spec, &table, &fleet, &scenario, &|| true).unwrap();
    let verdict = Verdict {
        verified: false,
        spec: "spec <&>".to_owned(),
        claims: Vec::new(),
        reachable_cells: 0,
        counterexample: None,
        hostile_share: None,
        plant: Vec::new(),
        spec_hash: String::new(),
        table_spec_hash: String::new(),
        table_sha256: String::new(),
        table_bytes: 0,
        method: Method::TightSets,
        counts: Counts::default(),
        tool_version: String::new(),
        failures: Vec::new(),
    };
    Findings {
        verdict: Some(verdict),
        budget: Some(synth::budget::budget(&table)),
        scorecard: Some((config, found)),
        fleet: Some(FleetFinding {
            config: fleet,
            loss_gw: scenario.loss_gw,
            duration_s: scenario.duration_s,
            run,
        }),
    }
}

fn rendered() -> Rendered {
    render_studies(std::slice::from_ref(study()), findings(), Vec::new()).unwrap()
}

#[test]
fn numbers_are_those_of_simulate() {
    let study = study();
    let table = TableView::parse(&study.table).unwrap();
    let scenario = Scenario::of(&study.spec);
    let run = simulate(&study.spec, &table, &scenario, Estimator::FullState).unwrap();
    assert_eq!(run, study.symbolic);
    let page = rendered().html;
    let summary = &run.summary;
    for number in [
        format!("<td>{:.3}</td>", summary.nadir_hz),
        format!("<td>{:.3}</td>", summary.final_hz),
        format!(
            "<td>{}</td>",
            digits::four(summary.entered_outer_s.unwrap())
        ),
        format!(
            "<td>{}</td>",
            digits::four(summary.entered_inner_s.unwrap())
        ),
        format!("<td>{}</td>", digits::four(summary.max_participation)),
    ] {
        assert!(page.contains(&number), "{number}");
    }
    // What a finding says is text, not markup.
    assert!(page.contains("spec &lt;&amp;&gt;") && !page.contains("spec <&>"));
}

#[test]
fn the_page_begins_with_the_answer() {
    let page = rendered().html;
    let headings: Vec<&str> = page
        .split("<h2>")
        .skip(1)
        .filter_map(|rest| rest.split("</h2>").next())
        .collect();
    let first = ["The answer", "Scorecard", "The fleet"].map(|word| format!("{word}: paper-bi"));
    assert_eq!(headings[..3], first, "{headings:?}");
    let answer = page.split("<h2>").nth(1).unwrap();
    for words in [
        // The verdict of the fixture is a no.
        "NOT proven",
        "f never below 49.2 Hz; back in 49.85 to 50 Hz within 60 s; claimed over 120 s.",
        "For: a loss of 2 GW, H = 4 GW s/Hz",
        "Lowest frequency against the droop's: ",
        " times (at most ",
        "its contactor operates ",
    ] {
        assert!(answer.contains(words), "{words}: {answer}");
    }
}

/// The words of a page: without drawings, style, what is folded away, and tags.
fn words_of(page: &str) -> String {
    let mut text = page.to_owned();
    for tag in ["style", "svg", "details"] {
        let (open, close) = (format!("<{tag}"), format!("</{tag}>"));
        while let Some(start) = text.find(&open) {
            // Details are not nested here, so the first end is the one.
            let end = start + text[start..].find(&close).unwrap() + close.len();
            text.replace_range(start..end, " ");
        }
    }
    text.split('<')
        .filter_map(|part| part.split_once('>'))
        .map(|(_, words)| words)
        .collect::<Vec<_>>()
        .join(" ")
}

#[test]
fn numbers_have_at_most_four_digits() {
    let page = rendered().html;
    let mut measured = 0;
    for word in words_of(&page).split(|c: char| !(c.is_ascii_digit() || c == '.')) {
        let word = word.trim_end_matches('.');
        let Some((whole, decimals)) = word.split_once('.') else {
            continue;
        };
        measured += 1;
        // A frequency goes down to the millihertz, and a version has two points.
        let frequency = whole.len() == 2 && decimals.len() <= 3;
        let digits = [whole, decimals].concat();
        let digits = digits.trim_start_matches('0').len();
        assert!(frequency || digits <= 4 || decimals.contains('.'), "{word}");
    }
    assert!(measured > 100, "{measured}");
}

#[test]
fn the_same_study_gives_the_same_files() {
    // Compared without being printed: the files are long.
    assert!(rendered() == rendered());
    let again = Study::new(&study().spec, &study().table, RUNS).unwrap();
    let files = render_studies(&[again], &find(), Vec::new()).unwrap();
    assert_eq!(files.figures.len(), rendered().figures.len());
    for (figure, other) in files.figures.iter().zip(rendered().figures) {
        assert!(*figure == other, "{}", figure.id);
    }
}

/// A run at every fifth second: time, frequency, participation.
fn rows(name: &str, run: &Run) -> String {
    let participation = |time: f64| {
        let at = run.samples.partition_point(|s| s.time_s <= time + 1e-9);
        run.samples[at - 1].participation
    };
    let points = thin(frequency(run), 5.0, 120.0);
    let line = |(time, f): (f64, f64)| {
        format!("{name} {time:5.1} s {f:.5} Hz {:.4}\n", participation(time))
    };
    points.into_iter().map(line).collect()
}

#[test]
fn data_of_the_figures_is_as_committed() {
    let spec = load("paper-bi", &[]);
    let event = BaselineEvent::new(&spec);
    let mut text = String::new();
    text += &rows("none", &event.none);
    text += &rows("unidirectional", &event.unidirectional);
    text += &rows("bidirectional", &event.bidirectional);
    text += &rows("firmware", &study().symbolic);
    text += &rows("firmware, 10 %", &study().uncertain);
    for row in steady_states(&spec) {
        text += &format!(
            "Table II {:.2} Hz: {:.4} {:.4}\n",
            row.deadband_hz, row.unidirectional_hz, row.bidirectional_hz
        );
    }
    insta::assert_snapshot!("figures", text);
}

#[test]
fn figures_stand_alone() {
    for figure in rendered().figures {
        assert!(
            figure.svg.starts_with("<svg role=\"img\" aria-labelledby="),
            "{}",
            figure.id
        );
        assert!(figure.svg.contains("<title id=") && figure.svg.contains("<style>"));
        assert!(!figure.svg.contains("http://") || figure.svg.matches("http://").count() == 1);
        let lines = figure.csv.lines().count();
        // Four controllers at two losses, under a heading; else a point each tenth of a second.
        let expected = if figure.id.contains("-compare-") {
            9..=9
        } else {
            1001..=usize::MAX
        };
        assert!(expected.contains(&lines), "{}: {lines}", figure.id);
        assert!(figure.svg.contains("<polyline"), "{}", figure.id);
    }
}

/// Appended to a copy of the page: what the browser made of it, as JSON in the title.
const PROBE: &str = r#"<script>
addEventListener('load', () => {
  const figures = [...document.querySelectorAll('figure svg')].map(svg => {
    const box = svg.getBoundingClientRect();
    const curves = [...svg.querySelectorAll('polyline')].map(p => p.getBBox()).filter(b => b.width > 100);
    return {name: svg.getAttribute('aria-labelledby').split(' ').map(id => document.getElementById(id).textContent),
            width: box.width, height: box.height, curves: curves.length, texts: svg.querySelectorAll('text').length};
  });
  const ink = getComputedStyle(document.querySelector('figure svg text')).fill;
  document.title = JSON.stringify({figures, ink, overflow: document.documentElement.scrollWidth > innerWidth,
    tables: document.querySelectorAll('table caption').length, headings: document.querySelectorAll('h2').length});
});
</script></body>"#;

/// A frame as wide as a phone with the page in it, which tells what it found.
const PHONE: &str = r#"<!DOCTYPE html><title></title><body style="margin: 0"><script>
onmessage = event => { document.title = event.data; };
</script><iframe src="report.html" style="width: 390px; height: 844px; border: 0"></iframe></body>"#;

/// Appended to the page in the frame: how wide it is, and the smallest print.
const PHONE_PROBE: &str = r#"<script>
addEventListener('load', () => {
  const shown = [...document.querySelectorAll('p, h1, h2, th, td, caption')];
  const sizes = shown.map(e => parseFloat(getComputedStyle(e).fontSize));
  const wide = shown.filter(e => !e.closest('.wide') && e.getBoundingClientRect().right > innerWidth + 1);
  parent.postMessage(JSON.stringify({inner: innerWidth, scroll: document.documentElement.scrollWidth,
    smallest: Math.min(...sizes), shown: shown.length, wide: wide.length}), '*');
});
</script></body>"#;

/// The title of a page, which a probe has filled with JSON: `report.html` itself, or another page
/// beside it.
fn probed(report: &str, other: Option<&str>, dark: bool) -> Value {
    let chromium = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok())
        .expect("no Chromium on the search path; cargo test-all installs it");
    let dir = tempfile::tempdir().unwrap();
    let mut path = dir.path().join("report.html");
    std::fs::write(&path, report).unwrap();
    if let Some(other) = other {
        path = dir.path().join("other.html");
        std::fs::write(&path, other).unwrap();
    }
    let scheme = format!("--blink-settings=preferredColorScheme={}", u8::from(!dark));
    let output = Command::new(chromium)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            "--window-size=1000,1200",
            // The clock of the page runs ahead until it has nothing left to do.
            "--virtual-time-budget=10000",
            "--dump-dom",
        ])
        .arg(scheme)
        .arg(format!(
            "--user-data-dir={}",
            dir.path().join("profile").display()
        ))
        .arg(format!("file://{}", path.display()))
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    let console: Vec<&str> = log
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(console.is_empty(), "{console:#?}");
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let title = dom.split("<title>").nth(1).unwrap();
    let title = title.split("</title>").next().unwrap();
    let title = title
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    serde_json::from_str(&title).unwrap()
}

/// What a browser makes of the page.
fn probe(page: &str, dark: bool) -> Value {
    probed(&page.replacen("</body>", PROBE, 1), None, dark)
}

#[test]
fn a_phone_shows_the_page() {
    let page = rendered().html.replacen("</body>", PHONE_PROBE, 1);
    let found = probed(&page, Some(PHONE), false);
    assert_eq!(found["inner"], 390);
    // Nothing scrolls sideways but tables and drawings inside their own frames.
    assert!(found["scroll"].as_u64().unwrap() <= 390, "{found}");
    assert_eq!(found["wide"], 0, "{found}");
    assert!(found["shown"].as_u64().unwrap() > 100, "{found}");
    // 16 px is the size of the page's text; below 12 px it has to be enlarged to be read.
    assert!(found["smallest"].as_f64().unwrap() >= 12.0, "{found}");
}

#[test]
fn a_browser_shows_the_page() {
    let page = rendered();
    let light = probe(&page.html, false);
    let figures = light["figures"].as_array().unwrap();
    assert_eq!(figures.len(), page.figures.len());
    for figure in figures {
        let number = |key: &str| figure[key].as_f64().unwrap();
        // The page is 1000 px wide and the drawing 960 by 400 in shape.
        assert!(
            number("width") > 600.0 && number("height") > 250.0,
            "{figure}"
        );
        assert!(
            number("curves") >= 1.0 && number("texts") > 10.0,
            "{figure}"
        );
        assert!(
            figure["name"]
                .as_array()
                .unwrap()
                .iter()
                .all(|text| text.as_str().unwrap().len() > 5)
        );
    }
    assert_eq!(light["overflow"], false);
    assert!(light["tables"].as_u64().unwrap() > figures.len() as u64);
    let dark = probe(&page.html, true);
    assert_ne!(
        light["ink"], dark["ink"],
        "the drawing does not follow the colour scheme"
    );
}
