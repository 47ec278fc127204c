//! Which kind of charger a container is for.
//!
//! A table is proven for chargers of one direction, power and meter. The class says so in a number,
//! which the maker gives: a container for another class is refused before its table is looked at.

/// Number of a kind of charger; the maker's to give.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceClass(pub u32);

/// The first of this repository's numbers: `HF` and two zero bytes.
const REFERENCE: u32 = 0x4846_0000;

impl DeviceClass {
    /// Of a product of this repository.
    pub const fn reference(bidirectional: bool, ade7953: bool) -> Self {
        Self(REFERENCE | (bidirectional as u32) << 1 | ade7953 as u32)
    }

    /// Every product of this repository with its class, by the name of its image.
    pub const REFERENCE: [(&'static str, Self); 4] = [
        ("holdfast", Self::reference(false, false)),
        ("holdfast-ade7953", Self::reference(false, true)),
        ("holdfast-bidirectional", Self::reference(true, false)),
        (
            "holdfast-ade7953-bidirectional",
            Self::reference(true, true),
        ),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::charger::reference::products;

    #[test]
    fn every_product_has_a_class_of_its_own() {
        for product in products() {
            let named = DeviceClass::REFERENCE
                .iter()
                .filter(|(name, _)| *name == product.name);
            assert_eq!(named.count(), 1, "{}", product.name);
        }
        for (n, (_, class)) in DeviceClass::REFERENCE.iter().enumerate() {
            let rest = &DeviceClass::REFERENCE[n + 1..];
            assert!(rest.iter().all(|(_, other)| other != class));
        }
    }
}
