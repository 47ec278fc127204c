//! The specs that are part of the program, by name.

/// Name and text of each shipped spec.
pub(super) const SHIPPED: &[(&str, &str)] = &[
    ("paper-bi", include_str!("../../../specs/paper-bi.toml")),
    ("paper-uni", include_str!("../../../specs/paper-uni.toml")),
    ("gb-bi", include_str!("../../../specs/gb-bi.toml")),
    ("gb-uni", include_str!("../../../specs/gb-uni.toml")),
    ("gb-bi-slow", include_str!("../../../specs/gb-bi-slow.toml")),
    (
        "gb-bi-ade7953",
        include_str!("../../../specs/gb-bi-ade7953.toml"),
    ),
    (
        "gb-uni-ade7953",
        include_str!("../../../specs/gb-uni-ade7953.toml"),
    ),
    ("gb-2019", include_str!("../../../specs/gb-2019.toml")),
    (
        "gb-uni-cars",
        include_str!("../../../specs/gb-uni-cars.toml"),
    ),
    (
        "gb-low-inertia",
        include_str!("../../../specs/gb-low-inertia.toml"),
    ),
    ("gb-bi-band", include_str!("../../../specs/gb-bi-band.toml")),
    (
        "gb-uni-band",
        include_str!("../../../specs/gb-uni-band.toml"),
    ),
    (
        "gb-bi-delay",
        include_str!("../../../specs/gb-bi-delay.toml"),
    ),
    (
        "gb-bi-normal",
        include_str!("../../../specs/gb-bi-normal.toml"),
    ),
];

/// Names of the shipped specs, in the order of [`SHIPPED`].
pub(super) const NAMES: &[&str] = &names();

/// The text of a shipped spec.
pub(super) fn text(name: &str) -> Option<&'static str> {
    SHIPPED
        .iter()
        .find(|(shipped, _)| *shipped == name)
        .map(|(_, text)| *text)
}

const fn names() -> [&'static str; SHIPPED.len()] {
    let mut names = [""; SHIPPED.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = SHIPPED[i].0;
        i += 1;
    }
    names
}
