//! Colours by what they mean. Each is a distinct colour in the SVG, so that a style sheet can
//! replace it by its value in the dark (`report.css` selects by attribute); without a style sheet
//! the light values stand. The curves' hues are Okabe and Ito's, which colour-blind readers can
//! tell apart; curves differ in their dashes too.

use plotters::style::RGBColor;

/// A colour of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// Text and axes.
    Ink,
    /// Labels.
    Muted,
    /// Lines of the mesh.
    Mesh,
    /// The firmware with a table.
    Symbolic,
    /// The baseline droop.
    Baseline,
    /// No response, or what was recorded.
    Without,
    /// A second fleet.
    Extra,
    /// The containment zone.
    Zone,
    /// I1.
    Outer,
    /// I2.
    Inner,
    /// No control.
    NoControl,
    /// C1.
    C1,
    /// C2.
    C2,
    /// Fixed.
    Fixed,
    /// Hold.
    Hold,
    /// Fallback.
    Fallback,
}

impl Colour {
    /// The light value.
    pub(super) const fn rgb(self) -> RGBColor {
        match self {
            Self::Ink => RGBColor(0x1f, 0x23, 0x28),
            Self::Muted => RGBColor(0x57, 0x60, 0x6a),
            Self::Mesh => RGBColor(0xe4, 0xe7, 0xea),
            Self::Symbolic => RGBColor(0x00, 0x72, 0xb2),
            Self::Baseline => RGBColor(0xd5, 0x5e, 0x00),
            Self::Without => RGBColor(0x6e, 0x77, 0x81),
            Self::Extra => RGBColor(0x82, 0x50, 0xa8),
            Self::Zone => RGBColor(0xcf, 0x22, 0x2e),
            Self::Outer => RGBColor(0x3a, 0x3f, 0x45),
            Self::Inner => RGBColor(0x1a, 0x7f, 0x37),
            Self::NoControl => RGBColor(0xdc, 0xeb, 0xfa),
            Self::C1 => RGBColor(0xff, 0xf3, 0xc4),
            Self::C2 => RGBColor(0xd9, 0xf2, 0xe0),
            Self::Fixed => RGBColor(0xfe, 0xfe, 0xfe),
            Self::Hold => RGBColor(0xe9, 0xe1, 0xf7),
            Self::Fallback => RGBColor(0xfb, 0xda, 0xd7),
        }
    }

    /// Dashes of a curve of this colour, as SVG writes them.
    pub(super) const fn dashes(self) -> Option<&'static str> {
        match self {
            Self::Baseline => Some("8 4"),
            Self::Without => Some("2 3"),
            Self::Extra => Some("10 3 2 3"),
            _ => None,
        }
    }

    /// The light value as SVG writes it.
    pub(super) fn hex(self) -> String {
        let RGBColor(r, g, b) = self.rgb();
        format!("#{r:02X}{g:02X}{b:02X}")
    }

    /// The background of a phase, by its name.
    pub fn of_phase(name: &str) -> Self {
        match name {
            "no-control" => Self::NoControl,
            "C1" => Self::C1,
            "C2" => Self::C2,
            "hold" => Self::Hold,
            "fallback" => Self::Fallback,
            _ => Self::Fixed,
        }
    }
}
