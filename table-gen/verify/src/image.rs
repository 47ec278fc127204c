//! The claim `image`: a product of this repository is what the table assumes.
//!
//! The comparison is the charger's own, [`misfits`]: where it finds something, the charger runs the
//! droop and the proof is of no use on it. A spec with an ideal meter, or for chargers of another
//! direction or power than the products', is about no product and gets no such claim: that charger
//! compares itself when it starts, as every charger does.

use firmware::charger::reference::{Product, products};
use firmware::charger::{ChargerConfig, Misfits, misfits};
use firmware::frequency::filter::Filter;
use firmware::table::TableView;
use model::spec::{MeterKind, Spec};
use model::verdict::{Claim, ClaimName};

/// The claim, for a spec with a real meter and the direction and power of a product.
pub(super) fn claim(table: &TableView<'_>, spec: &Spec) -> Option<Claim> {
    if spec.meter.kind == MeterKind::Ideal {
        return None;
    }
    let compared = products().map(|product| (product, compare(table, &product)));
    let another =
        |found: &Misfits| found.contains(Misfits::DIRECTION) || found.contains(Misfits::POWER);
    if compared.iter().all(|(_, found)| another(found)) {
        return None;
    }
    let fitting: Vec<&str> = compared
        .iter()
        .filter(|(_, found)| found.is_empty())
        .map(|(product, _)| product.name)
        .collect();
    let reason = fitting.is_empty().then(|| {
        let alike = compared.iter().filter(|(_, found)| !another(found));
        let each = alike.map(|(product, found)| {
            let names: Vec<&str> = found.names().collect();
            format!("{}: {}", product.name, names.join(", "))
        });
        let each: Vec<String> = each.collect();
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
        &table.header(),
        &product.installation,
        product.meter,
        &Filter::new(ChargerConfig::DEFAULT.filter_ticks),
    )
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]
mod tests {
    use super::*;
    use firmware::table::{field, seal};

    const TABLE: &[u8] = include_bytes!("../../../firmware/tables/gb-bi.bin");

    /// The claim of gb-bi's table with a field changed.
    fn with(field: &field::Field, bytes: &[u8]) -> Option<Claim> {
        let mut image = TABLE.to_vec();
        image[field.clone()].copy_from_slice(bytes);
        seal(&mut image).unwrap();
        let spec = Spec::load("gb-bi", &[]).unwrap();
        claim(&TableView::parse(&image).unwrap(), &spec)
    }

    #[test]
    fn a_product_accepts_it_or_says_why_not() {
        let same = with(&field::GENERATOR, &[0; 4]).unwrap();
        assert!(same.holds && same.statement.contains("holdfast-bidirectional"));
        // A meter of half a millihertz, which no product has.
        let exact = with(
            &field::ESTIMATE_ERROR,
            &[500u32.to_le_bytes(), [0; 4], [0; 4], [0; 4]].concat(),
        );
        let reason = exact.unwrap().reason.unwrap();
        assert!(
            reason.contains("holdfast-bidirectional: meter-error"),
            "{reason}"
        );
        assert!(!reason.contains("holdfast:"), "{reason}");
    }

    #[test]
    fn a_charger_of_another_power_is_no_product() {
        assert_eq!(
            with(&field::POWER_PER_CHARGER, &22_000u32.to_le_bytes()),
            None
        );
    }
}
