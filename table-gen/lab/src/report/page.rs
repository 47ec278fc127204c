//! Sections to one HTML page that needs nothing else: no network, no script.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::chart;
use super::figure::Figure;
use super::rendered::{FigureFile, Rendered, ReportError};
use super::section::{DataTable, Section};

/// The page of these sections, and its figures as files.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn render(title: &str, about: &str, sections: &[Section]) -> Result<Rendered, ReportError> {
    let mut figures = Vec::new();
    let mut bodies = Vec::new();
    for section in sections {
        let mut drawn = Vec::new();
        for figure in &section.figures {
            let svg = chart::svg(figure)?;
            figures.push(FigureFile {
                id: figure.id.clone(),
                svg: chart::with_style(&svg),
                csv: figure.csv(),
            });
            drawn.push(figure_markup(figure, &svg));
        }
        bodies.push(section_markup(section, &drawn));
    }
    let styles = concat!(include_str!("report.css"), include_str!("page.css"));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                link rel="icon" href="data:,";
                title { (title) }
                style { (PreEscaped(styles)) }
            }
            body {
                main {
                    h1 { (title) }
                    p { (about) }
                    @for body in &bodies { (body) }
                }
            }
        }
    };
    Ok(Rendered {
        html: page.into_string(),
        figures,
    })
}

fn section_markup(section: &Section, figures: &[Markup]) -> Markup {
    html! {
        section {
            h2 { (section.heading) }
            @for words in &section.words { p { (words) } }
            @for table in &section.tables { (table_markup(table)) }
            @for figure in figures { (figure) }
            @for (caption, text) in &section.listings {
                details { summary { (caption) } pre tabindex="0" { (text) } }
            }
        }
    }
}

fn table_markup(table: &DataTable) -> Markup {
    html! {
        div.wide {
            table {
                caption { (table.caption) }
                thead { tr { @for head in &table.header { th scope="col" { (head) } } } }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (index, cell) in row.iter().enumerate() {
                                @if index == 0 { th scope="row" { (cell) } }
                                @else { td class=[answer_class(cell)] { (cell) } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The page says yes and no in colour too.
fn answer_class(cell: &str) -> Option<&'static str> {
    match cell {
        "holds" | "satisfied" => Some("yes"),
        "fails" | "missed" => Some("no"),
        _ => None,
    }
}

fn figure_markup(figure: &Figure, svg: &str) -> Markup {
    html! {
        figure id=(figure.id) {
            figcaption { (figure.title) }
            div.drawing { (PreEscaped(svg)) }
            p.note { (figure.description) }
            details {
                summary { "Data" }
                (table_markup(&data(figure)))
            }
        }
    }
}

fn data(figure: &Figure) -> DataTable {
    let mut header = vec![figure.axis.head()];
    header.extend(figure.curves.iter().map(|curve| curve.name.as_str()));
    let mut table = DataTable::new(format!("{}: {}", figure.title, figure.value_label), &header);
    for (time, values) in figure.table() {
        let digits = figure.digits;
        let cells = values
            .iter()
            .map(|value| value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}")));
        table.row(std::iter::once(format!("{time:.1}")).chain(cells));
    }
    table
}
