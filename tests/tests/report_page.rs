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
use lab::report::figure::thin;
use lab::report::study::{BaselineEvent, Study, frequency, steady_states};
use lab::report::{Findings, Rendered, render_studies};
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

fn rendered() -> Rendered {
    let verdict = Verdict {
        verified: false,
        spec: "spec <&>".to_owned(),
        claims: Vec::new(),
        reachable_cells: 0,
        counterexample: None,
        spec_hash: String::new(),
        table_spec_hash: String::new(),
        table_sha256: String::new(),
        table_bytes: 0,
        method: Method::TightSets,
        counts: Counts::default(),
        tool_version: String::new(),
        failures: Vec::new(),
    };
    let findings = Findings {
        verdict: Some(verdict),
        budget: Some(synth::budget::budget(
            &TableView::parse(&study().table).unwrap(),
        )),
    };
    render_studies(std::slice::from_ref(study()), &findings, Vec::new()).unwrap()
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
        format!("<td>{:.4}</td>", summary.nadir_hz),
        format!("<td>{:.4}</td>", summary.final_hz),
        format!("<td>{:.2}</td>", summary.entered_outer_s.unwrap()),
        format!("<td>{:.2}</td>", summary.entered_inner_s.unwrap()),
        format!("<td>{:.3}</td>", summary.max_participation),
    ] {
        assert!(page.contains(&number), "{number}");
    }
    // What a finding says is text, not markup.
    assert!(page.contains("spec &lt;&amp;&gt;") && !page.contains("spec <&>"));
}

#[test]
fn the_same_study_gives_the_same_files() {
    assert_eq!(rendered(), rendered());
    let again = Study::new(&study().spec, &study().table, RUNS).unwrap();
    let files = render_studies(&[again], &Findings::default(), Vec::new()).unwrap();
    for (figure, other) in files.figures.iter().zip(rendered().figures) {
        assert_eq!(*figure, other);
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
        assert!(figure.csv.lines().count() > 1000, "{}", figure.id);
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

/// What the page measures of itself in a browser.
fn probe(page: &str, dark: bool) -> Value {
    let chromium = ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok())
        .expect("no Chromium on the search path: `cargo test-all prerequisites` installs it");
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("report.html");
    std::fs::write(&path, page.replacen("</body>", PROBE, 1)).unwrap();
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
