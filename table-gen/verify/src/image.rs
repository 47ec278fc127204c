//! The claim `image`: a product of this repository is what the table assumes.
//!
//! The comparison is the charger's own, [`misfits`]: where it finds something, the charger runs the
//! droop and the proof is of no use on it. A spec with an ideal meter is about no product, and gets
//! no such claim.

use firmware::charger::reference::{Product, products};
use firmware::charger::{ChargerConfig, Misfits, misfits};
use firmware::frequency::filter::Filter;
use firmware::table::TableView;
use model::spec::{MeterKind, Spec};
use model::verdict::{Claim, ClaimName};

/// The claim, for a spec with a real meter.
pub(super) fn claim(table: &TableView<'_>, spec: &Spec) -> Option<Claim> {
    if spec.meter.kind == MeterKind::Ideal {
        return None;
    }
    let compared = products().map(|product| (product, compare(table, &product)));
    let fitting: Vec<&str> = compared
        .iter()
        .filter(|(_, found)| found.is_empty())
        .map(|(product, _)| product.name)
        .collect();
    let reason = fitting.is_empty().then(|| {
        let each = compared.map(|(product, found)| {
            let names: Vec<&str> = found.names().collect();
            format!("{}: {}", product.name, names.join(", "))
        });
        format!("it fits no image: {}", each.join("; "))
    });
    let statement = match &reason {
        None => format!("the charger accepts it: {}", fitting.join(", ")),
        Some(_) => "the charger of some image accepts it".to_owned(),
    };
    Some(Claim {
        name: ClaimName::Image,
        holds: reason.is_none(),
        bound: None,
        limit: None,
        unit: "".into(),
        statement,
        reason,
    })
}

fn compare(table: &TableView<'_>, product: &Product) -> Misfits {
    misfits(
        table.header(),
        &product.installation,
        product.meter,
        &Filter::new(ChargerConfig::DEFAULT.filter_ticks),
    )
}
