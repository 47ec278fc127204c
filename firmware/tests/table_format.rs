//! The table format: bytes written by hand, every way in which an image can be wrong, and total
//! lookups.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on fails"
)]

use firmware::control_loop::{ControlLoop, Source};
use firmware::droop::Droop;
use firmware::grid::{Cell, Grid};
use firmware::phase::Phase;
use firmware::prediction::{History, prediction_len};
use firmware::response::ResponseLaw;
use firmware::table::field::{Field, entry};
use firmware::table::*;
use firmware::units::{Band, Participation, State};
use proptest::prelude::*;

/// A tree over 4 x 3 x 2 x 2 cells: f below 2 gives level 1; else g below 1 gives level 2, else the
/// piece.
const TREE: [u8; 18] = [
    0x01, // one affine piece
    0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, // f counts 1024 to the cell: one level a cell
    0x00, 0xFC, 0xFF, 0xFF, // constant -1024: level f - 1
    0x10, 0x01, // f, delta 2; left leaf 1, right node follows
    0x0D, 0x42, 0x20, // g, delta 1; leaves 2 and piece 0
];
/// Membership: p below 1 is inside if f + g >= 1, all else by the hull (g <= 1).
const DOMAIN: [u8; 30] = [
    0x02, 0x01, 0x00, // two half-spaces, the first is the hull; no look-ahead
    0x00, 0x00, 0xFF, 0xFF, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, // 1 - g >= 0
    0x01, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0xFF, 0xFF, 0xFF, 0xFF, // f + g - 1 >= 0
    0x0F, 0x43, 0x3F, // p, delta 1; leaves: half-space 1, hull
];

/// Where the tree and the dense law begin in [`image`].
const TREE_AT: usize = HEADER_LEN + DOMAIN.len();
const DENSE_AT: usize = TREE_AT + TREE.len();

fn header() -> Header {
    Header {
        spec_hash: *b"0123456789abcdef",
        grid: Grid::new([-4, -3, 0, 5], [2, 3, 4, 5], [4, 3, 2, 2]).unwrap(),
        input_step_ppm: 50_000,
        levels: 4,
        stay: true,
        always_on: false,
        tick_ms: 100,
        period_ticks: 15,
        delay_ticks: 0,
        outer: Band {
            low_uhz: -300_000,
            high_uhz: 0,
        },
        inner: Band {
            low_uhz: -150_000,
            high_uhz: 0,
        },
        droop: Droop {
            deadband_uhz: 150_000,
            full_uhz: 500_000,
        },
        plant: PlantParameters::PAPER,
        hypotheses: Hypotheses {
            estimate_error: [2_000, 10_000, 20_000, 30_000],
            meter_lag_ms: [50, 70],
            actuation_delay_ms: [100, 500],
            participation_relative_ppm: 100_000,
            participation_absolute_ppm: 1_000,
            loss_kw: [-1, 2_200_000],
            loss_profile: LossProfile::NonDecreasing,
            direction: Direction::Bidirectional,
            own_clocks: true,
            tick_most_ms: 120,
            inertia_kw_s_per_hz: [2_040_000, 5_000_000],
            governor_gain_kw_per_hz: [-5_000_000, -4_000_000],
            damping_kw_per_hz: [800_000, 1_000_000],
            power_per_charger_w: 56_000,
            chargers: 25_000,
            table_version: 7,
            generator: 0x0100_2003,
        },
        laws: [None; LAWS],
    }
}

/// The bidirectional fleet's law.
const LAW: ResponseLaw = ResponseLaw {
    droop_gain_ppm_per_hz: 4_285_714,
    setpoint_uhz: -50_000,
    slope_gain_ppm_s_per_hz: 1_428_571,
    slope_threshold_uhz_per_s: 30_000,
    window_ticks: 5,
    slope_most_ppm: 642_857,
    release_ppm: 3_571,
    smallest_change_ppm: 50_000,
};

/// The law by hand.
const LAW_BYTES: [u8; 32] = [
    0x12, 0x65, 0x41, 0x00, // 4 285 714
    0xB0, 0x3C, 0xFF, 0xFF, // -50 000
    0x5B, 0xCC, 0x15, 0x00, // 1 428 571
    0x30, 0x75, 0x00, 0x00, // 30 000
    0x05, 0x00, 0x00, 0x00, // 5
    0x29, 0xCF, 0x09, 0x00, // 642 857
    0xF3, 0x0D, 0x00, 0x00, // 3 571
    0x50, 0xC3, 0x00, 0x00, // 50 000
];

/// An image that is a response.
fn response_image() -> Vec<u8> {
    let header = Header {
        always_on: true,
        ..header()
    };
    let mut image = write_header(&header).to_vec();
    image.extend(LAW_BYTES);
    image.extend([0; CRC_LEN]);
    seal(&mut image).unwrap();
    image
}

/// An image with the tree as C1, and a dense law of one cell as Hold.
fn image() -> Vec<u8> {
    let mut header = header();
    let dense: [u8; 17] = [
        1, 0, 2, 0, 0, 0, 1, 0, // first cell
        1, 0, 1, 0, 1, 0, 1, 0,    // one cell
        0x04, // level 3
    ];
    header.laws[Law::C1 as usize] = Some(LawEntry {
        domain_kind: DomainKind::Tree as u8,
        inputs_kind: InputsKind::Tree as u8,
        worst_visits: 4,
        domain_len: DOMAIN.len() as u32,
        inputs_len: TREE.len() as u32,
    });
    header.laws[Law::Hold as usize] = Some(LawEntry {
        domain_kind: DomainKind::InInputs as u8,
        inputs_kind: InputsKind::Dense as u8,
        worst_visits: 1,
        domain_len: 0,
        inputs_len: dense.len() as u32,
    });
    let mut image = write_header(&header).to_vec();
    image.extend(DOMAIN);
    image.extend(TREE);
    image.extend(dense);
    image.extend([0; CRC_LEN]);
    seal(&mut image).unwrap();
    image
}

fn error(image: &[u8]) -> TableError {
    TableView::parse(image).unwrap_err()
}

/// The image with some bytes replaced and sealed again, so that only the meaning is wrong.
fn patched(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut image = image();
    image[at..at + bytes.len()].copy_from_slice(bytes);
    seal(&mut image).unwrap();
    image
}

#[test]
fn header_bytes_are_as_documented() {
    let image = image();
    let golden: &[(usize, &[u8])] = &[
        (0, b"HFDT"),
        (4, &[0xFF, 0xFE]),
        (6, &[3, 0]),
        (8, &[69, 1, 0, 0]),
        (12, b"0123456789abcdef"),
        (28, &[0xFC, 0xFF, 0xFF, 0xFF, 0xFD, 0xFF, 0xFF, 0xFF]),
        (36, &[0, 0, 0, 0, 5, 0, 0, 0]),
        (44, &[2, 0, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 5, 0, 0, 0]),
        (60, &[4, 0, 3, 0, 2, 0, 2, 0]),
        (68, &[0x50, 0xC3, 0, 0]),
        (72, &[4, 5]),
        (74, &[100, 0, 15, 0, 0, 0]),
        // -300 000 is 0xFFFB6C20.
        (80, &[0x20, 0x6C, 0xFB, 0xFF, 0, 0, 0, 0]),
        (96, &[0xF0, 0x49, 0x02, 0, 0x20, 0xA1, 0x07, 0]),
        // -5 000 000 is 0xFFB3B4C0.
        (104, &[0xC0, 0xB4, 0xB3, 0xFF]),
        (136, &[0xD0, 0x07, 0, 0, 0x10, 0x27, 0, 0]),
        (144, &[0x20, 0x4E, 0, 0, 0x30, 0x75, 0, 0]),
        (152, &[50, 0, 70, 0, 100, 0, 0xF4, 1]),
        (160, &[0xA0, 0x86, 1, 0, 0xE8, 3, 0, 0]),
        // 2 200 000 is 0x2191C0.
        (168, &[0xFF, 0xFF, 0xFF, 0xFF, 0xC0, 0x91, 0x21, 0]),
        (176, &[2, 1, 120, 0]),
        // 2 040 000 is 0x1F20C0, 5 000 000 is 0x4C4B40.
        (180, &[0xC0, 0x20, 0x1F, 0, 0x40, 0x4B, 0x4C, 0]),
        // -4 000 000 is 0xFFC2F700.
        (188, &[0xC0, 0xB4, 0xB3, 0xFF, 0x00, 0xF7, 0xC2, 0xFF]),
        (196, &[0x00, 0x35, 0x0C, 0, 0x40, 0x42, 0x0F, 0]),
        (204, &[0xC0, 0xDA, 0, 0, 0xA8, 0x61, 0, 0]),
        (212, &[7, 0, 0, 0, 0x03, 0x20, 0x00, 0x01]),
        (220, &[1, 1, 4, 0, 30, 0, 0, 0, 18, 0, 0, 0]),
        (232, &[255, 255, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]),
        (244, &[0, 0, 1, 0, 0, 0, 0, 0, 17, 0, 0, 0]),
        (256, &DOMAIN),
        (286, &TREE),
    ];
    for (at, bytes) in golden {
        assert_eq!(&image[*at..*at + bytes.len()], *bytes, "at {at}");
    }
    assert_eq!(image.len(), 325);
    let table = TableView::parse(&image).unwrap();
    let mut expected = header();
    expected.laws = table.header().laws;
    assert_eq!(table.header(), expected);
    assert_eq!(
        write_header(&table.header())[field::SPEC_HASH.start..],
        image[field::SPEC_HASH.start..HEADER_LEN],
        "what was read is written again"
    );
}

#[test]
fn a_response_lies_between_header_and_crc() {
    let image = response_image();
    assert_eq!(image.len(), HEADER_LEN + RESPONSE_LEN + CRC_LEN);
    assert_eq!(image[field::FLAGS], [7]);
    assert_eq!(write_response(&LAW), LAW_BYTES);
    let table = TableView::parse(&image).unwrap();
    assert_eq!(table.response(), Some(LAW));
    assert!(table.header().always_on && table.prediction().is_none());
    assert_eq!(table.lookup(Law::C1, Cell([0; 4])), None);
    assert_eq!(TableView::parse(&self::image()).unwrap().response(), None);
    // Every bit counts, and no byte may be missing.
    for at in 0..image.len() {
        for bit in 0..8 {
            let mut wrong = image.clone();
            wrong[at] ^= 1 << bit;
            assert!(TableView::parse(&wrong).is_err(), "bit {bit} of byte {at}");
        }
        let mut shorter = image[..at].to_vec();
        let _ = seal(&mut shorter);
        assert!(TableView::parse(&shorter).is_err(), "cut at {at}");
    }
}

#[test]
fn a_response_out_of_range_is_named_by_its_offset() {
    use field::response;
    let wrong = |at: usize, bytes: &[u8]| {
        let mut image = response_image();
        image[at..at + bytes.len()].copy_from_slice(bytes);
        seal(&mut image).unwrap();
        error(&image)
    };
    let cases: &[(Field, u32)] = &[
        (response::DROOP_GAIN, 1_000_000_001),
        (response::WINDOW, 0),
        (response::WINDOW, 33),
        (response::WINDOW, 65_541),
        (response::SLOPE_MOST, 1_000_001),
        (response::RELEASE, 1_000_001),
        (response::SMALLEST_CHANGE, 0),
        (response::SMALLEST_CHANGE, 1_000_001),
    ];
    for (field, word) in cases {
        let at = HEADER_LEN + field.start;
        let offset = at as u16;
        let found = wrong(at, &word.to_le_bytes());
        assert_eq!(found, TableError::BadField { offset }, "{word}");
    }
    // A response predicts nothing, and has no laws beside it.
    let offset = field::DELAY.start as u16;
    let found = wrong(field::DELAY.start, &[1, 0]);
    assert_eq!(found, TableError::BadField { offset });
    let offset = field::DIRECTORY.start as u16;
    let found = wrong(field::DIRECTORY.start, &[1, 1]);
    assert_eq!(found, TableError::BadField { offset });
    // Without the flag the same bytes are no table.
    assert!(matches!(
        wrong(field::FLAGS.start, &[5]),
        TableError::BadBlock { .. }
    ));
    let mut bare = write_header(&Header {
        always_on: true,
        ..header()
    })
    .to_vec();
    bare.extend([0; CRC_LEN]);
    seal(&mut bare).unwrap();
    let offset = field::FLAGS.start as u16;
    assert_eq!(error(&bare), TableError::BadField { offset });
}

#[test]
fn a_response_answers_every_frequency_and_knows_no_event() {
    let image = response_image();
    let mut control = ControlLoop::new(&image);
    assert_eq!(control.phase_state().phase, Phase::Response);
    for f in [i32::MIN, -50_000, 0, i32::MAX] {
        let action = control.step(State([f, 0, 0, 0]));
        assert_eq!(action.phase, Phase::Response);
        assert_eq!(action.source, Source::Table);
    }
    control.end_event();
    assert_eq!(control.phase_state().phase, Phase::Response);
    // Something else is commanded: small changes are measured from there. 4.285714 · 100 mHz is 428
    // 571.
    let mut control = ControlLoop::new(&image);
    let given = Participation::from_ppm(400_000);
    assert_eq!(control.command(given), given);
    let kept = control.step(State([-150_000, 0, 0, 0]));
    assert_eq!(kept.participation.ppm(), 400_000);
    // A missed tick belongs to the window, a tick without a reading ends it.
    for f in 1..=5 {
        control.pass(-150_000 - 20_000 * f);
    }
    // 200 mHz/s over the full window, 170 of them count: 242 857.
    assert_eq!(control.response().unwrap().held_ppm(), 242_857);
    control.miss(2);
    assert_eq!(control.response().unwrap().held_ppm(), 235_715);
    assert!(!control.response().unwrap().is_full());
}

/// The image with commands that act a tick late: Φ the identity but f falls by g/2; W = 7 on l; G_1
/// = 256 g a level.
fn delayed() -> Vec<u8> {
    let mut words = [0i32; 24];
    for axis in 0..4 {
        words[5 * axis] = 1 << 24;
    }
    words[1] = -(1 << 23);
    words[18] = 7;
    words[21] = 256 << 8;
    let mut image = image();
    image[field::DELAY.start] = 1;
    let part = words.iter().flat_map(|word| word.to_le_bytes());
    image.splice(HEADER_LEN..HEADER_LEN, part);
    seal(&mut image).unwrap();
    image
}

#[test]
fn the_prediction_lies_between_header_and_blocks() {
    let image = delayed();
    assert_eq!(image[field::DELAY], [1, 0]);
    // Φ_ff = 1 and Φ_fg = -1/2 in 24 bits, W_l, G_1 on g in 8 bits.
    let (part, blocks) = image[HEADER_LEN..].split_at(prediction_len(1));
    assert_eq!(part[..8], [0, 0, 0, 1, 0, 0, 0x80, 0xFF]);
    assert_eq!(part[72..76], [7, 0, 0, 0]);
    assert_eq!(part[84..88], [0, 0, 1, 0]);
    assert_eq!(blocks[..DOMAIN.len()], DOMAIN);
    let table = TableView::parse(&image).unwrap();
    assert_eq!(table.header().delay_ticks, 1);
    assert_eq!(table.lookup(Law::C1, Cell([2, 0, 1, 0])), Some(2));
    let prediction = table.prediction().unwrap();
    let mut history = History::NONE;
    history.push(3);
    let ahead = prediction.predict(State([10, 4, 0, -1]), &history);
    assert_eq!(ahead, State([8, 772, 7, -1]));
    assert!(TableView::parse(&image[..]).is_ok());
    // Without the delay the same bytes are no table.
    let mut wrong = image.clone();
    wrong[field::DELAY.start] = 0;
    seal(&mut wrong).unwrap();
    assert!(TableView::parse(&wrong).is_err());
    assert!(
        TableView::parse(&self::image())
            .unwrap()
            .prediction()
            .is_none()
    );
}

#[test]
fn a_delayed_loop_watches_what_is_and_decides_on_what_will_be() {
    let image = delayed();
    let mut control = ControlLoop::new(&image);
    // I1 ends at -300 000: that f is measured, whatever is predicted.
    let calm = control.step(State([-300_000, 500_000, 0, 5]));
    assert_eq!(calm.phase, Phase::NoControl);
    // Predicted (-1, 0, 7, 5) has no law, so the droop answers, in whole levels: 0.3 Hz is 150 mHz
    // of 500, 6 levels, of which 3 exist.
    let outside = control.step(State([-300_001, -600_000, 0, 5]));
    assert_eq!(outside.source, Source::DroopOutside);
    assert_eq!(outside.participation.ppm(), 150_000);
    // The three levels under way add 768 to g: predicted (-3, 0, 0, 13) is cell (0, 1, 0, 1),
    // inside C1 by the hull, level 1.
    let ahead = control.step(State([-3 - 384, -768, -7, 13]));
    assert_eq!((ahead.phase, ahead.source), (Phase::C1, Source::Table));
    assert_eq!(ahead.participation.ppm(), 50_000);
    // For as long as the period runs nothing is looked at.
    for _ in 0..14 {
        assert_eq!(control.step(State([9_999_999; 4])).phase, Phase::C1);
    }
    // Held by others: what is under way is the same level, 256 on g.
    control.miss(3);
    let again = control.step(State([-3 - 128, -256, -7, 13]));
    assert_eq!((again.phase, again.source), (Phase::C1, Source::Table));
    control.reset();
    // Forgotten: without the 256, g lies below the grid.
    let forgotten = control.step(State([-300_001, -256, -7, 13]));
    assert_eq!(forgotten.source, Source::DroopOutside);
}

#[test]
fn a_caller_that_overrules_the_loop_is_what_is_under_way() {
    let image = delayed();
    let mut control = ControlLoop::new(&image);
    let outside = State([-300_001, -600_000, 0, 5]);
    let overruled = control.step_or(outside, |action| {
        assert_eq!(action.source, Source::DroopOutside);
        Participation::NONE
    });
    assert_eq!(overruled.participation, Participation::NONE);
    // Nothing is under way: predicted (-3, 0, 0, 13), inside C1. The droop's three levels would
    // have added 768 to g, which lies above the grid.
    let next = control.step(State([-3, 0, -7, 13]));
    assert_eq!((next.phase, next.source), (Phase::C1, Source::Table));
    // A tick at which the loop is not asked: 70 000 ppm is nearest to one level.
    let commanded = control.command(Participation::from_ppm(70_000));
    assert_eq!(commanded.ppm(), 50_000);
}

#[test]
fn tree_and_domain_answer_as_drawn() {
    let image = image();
    let table = TableView::parse(&image).unwrap();
    let c1 = |f, g, l, p| table.lookup(Law::C1, Cell([f, g, l, p]));
    assert_eq!(c1(0, 0, 0, 0), None, "f + g = 0 lies outside");
    assert_eq!(c1(1, 0, 0, 0), Some(1));
    assert_eq!(c1(2, 0, 1, 0), Some(2));
    assert_eq!(c1(3, 1, 0, 0), Some(2), "piece: f - 1");
    assert_eq!(
        c1(3, 2, 0, 0),
        Some(2),
        "the hull is not asked where p is 0"
    );
    assert_eq!(c1(3, 2, 0, 1), None, "the hull ends at g = 1");
    assert_eq!(c1(0, 0, 0, 1), Some(1));
    assert_eq!(c1(4, 0, 0, 0), None, "no cell of the grid");
    assert_eq!(
        table.lookup(Law::C2, Cell([1, 0, 0, 0])),
        None,
        "no such law"
    );
    assert_eq!(table.lookup(Law::Hold, Cell([1, 2, 0, 1])), Some(3));
    assert_eq!(table.lookup(Law::Hold, Cell([1, 2, 0, 0])), None);
    let law = table.law(Law::C1).unwrap();
    assert_eq!(
        law.visits(Cell([3, 1, 0, 0])),
        4,
        "two of the domain, two of the tree"
    );
    assert_eq!(law.worst_visits(), 4);
    assert_eq!((law.encoding().entries(), law.domain_entries()), (3, 4));
}

#[test]
fn every_flipped_byte_and_every_truncation_is_refused() {
    let image = image();
    for at in 0..image.len() {
        for bit in 0..8 {
            let mut wrong = image.clone();
            wrong[at] ^= 1 << bit;
            assert!(TableView::parse(&wrong).is_err(), "bit {bit} of byte {at}");
        }
        assert!(TableView::parse(&image[..at]).is_err(), "cut at {at}");
    }
    let mut longer = image.clone();
    longer.push(0);
    assert!(matches!(error(&longer), TableError::WrongLength { .. }));
}

#[test]
fn the_frame_names_what_was_found_and_what_is_supported() {
    let image = image();
    assert_eq!(
        error(&image[..100]),
        TableError::TooShort {
            found: 100,
            needed: (HEADER_LEN + CRC_LEN) as u32
        }
    );
    let with = |field: Field, bytes: &[u8]| {
        let mut image = image.clone();
        image[field].copy_from_slice(bytes);
        error(&image)
    };
    assert_eq!(
        with(field::MAGIC, b"ELF!"),
        TableError::BadMagic { found: *b"ELF!" }
    );
    assert_eq!(
        with(field::BYTE_ORDER, &[0xFE, 0xFF]),
        TableError::WrongEndianness
    );
    assert_eq!(
        with(field::BYTE_ORDER, &[1, 2]),
        TableError::BadByteOrderMark { found: 0x0201 }
    );
    let version = TableError::UnsupportedVersion {
        found: 7,
        supported: FORMAT_VERSION,
    };
    assert_eq!(with(field::VERSION, &[7, 0]), version);
    let length = TableError::WrongLength {
        found: 325,
        stated: 326,
    };
    assert_eq!(with(field::LENGTH, &[70, 1, 0, 0]), length);
    assert!(matches!(with(290..291, &[9]), TableError::BadCrc { .. }));
    let foreign = TableView::parse_for_spec(&image, [0; SPEC_HASH_LEN]).unwrap_err();
    assert_eq!(
        foreign,
        TableError::ForeignSpec {
            found: *b"0123456789abcdef",
            expected: [0; SPEC_HASH_LEN]
        }
    );
    assert!(TableView::parse_for_spec(&image, *b"0123456789abcdef").is_ok());
    assert_eq!(
        seal(&mut [0; 10]).unwrap_err(),
        WriteError::Length { found: 10 }
    );
}

#[test]
fn header_fields_out_of_range_are_named_by_their_offset() {
    let cases: &[(Field, &[u8])] = &[
        (field::LEVELS, &[0]),
        (field::LEVELS, &[33]),
        (field::INPUT_STEP, &[0xFF; 4]),
        // An unknown flag; a response that the image has no room for is seen at the directory.
        (field::FLAGS, &[8]),
        (field::TICK, &[0, 0]),
        // 201 ms, longer than any watchdog allows.
        (field::TICK, &[201, 0]),
        (field::PERIOD, &[0, 0]),
        // A prediction part that the image does not have, and more ticks than the device remembers.
        (field::DELAY, &[1, 0]),
        (field::DELAY, &[65, 0]),
        // High below low; I2 above I1.
        (field::OUTER, &[0, 0, 0, 0, 0, 0, 0, 0x80]),
        (field::INNER, &[0, 0, 0, 0, 1, 0, 0, 0]),
        (field::DROOP_FULL, &[0; 4]),
        (field::GOVERNOR_TIME, &[0; 4]),
        (field::TURBINE_TIME, &[0; 4]),
        (field::LAG_TIME, &[0; 4]),
        (field::INERTIA, &[0; 4]),
        // Each interval with its ends swapped, or nothing where there must be something.
        (field::METER_LAG, &[71, 0]),
        (field::ACTUATION_DELAY, &[0xF5, 1]),
        (field::PARTICIPATION_RELATIVE, &[0x40, 0x42, 0x0F, 0]),
        (field::PARTICIPATION_ABSOLUTE, &[0x40, 0x42, 0x0F, 0]),
        (field::LOSS, &[0xC1, 0x91, 0x21, 0]),
        (field::LOSS_PROFILE, &[3]),
        (field::DIRECTION, &[2]),
        // Shorter than the tick.
        (field::TICK_MOST, &[99, 0]),
        (field::INERTIA_BAND, &[0; 4]),
        (field::INERTIA_BAND, &[0x41, 0x4B, 0x4C, 0]),
        (field::GOVERNOR_GAIN_BAND, &[0x01, 0xF7, 0xC2, 0xFF]),
        (field::DAMPING_BAND, &[0x41, 0x42, 0x0F, 0]),
        (field::POWER_PER_CHARGER, &[0; 4]),
        (field::CHARGERS, &[0; 4]),
    ];
    for (field, bytes) in cases {
        let offset = field.start as u16;
        let found = error(&patched(field.start, bytes));
        assert_eq!(found, TableError::BadField { offset });
    }
    // An absent law that has visits.
    let c2 = field::DIRECTORY.start + DIRECTORY_ENTRY_LEN;
    let offset = c2 as u16;
    let found = error(&patched(c2 + field::entry::WORST_VISITS.start, &[1]));
    assert_eq!(found, TableError::BadField { offset });
    assert!(matches!(
        error(&patched(field::WIDTH.start, &[0; 4])),
        TableError::BadGrid(_)
    ));
}

#[test]
fn blocks_are_refused_for_their_own_reasons() {
    let of_c1 = |reason| TableError::BadBlock {
        law: Law::C1,
        reason,
    };
    let c1 = field::DIRECTORY.start;
    let cases: &[(&str, usize, &[u8], BlockError)] = &[
        (
            "longer than the image",
            c1 + entry::DOMAIN_LEN.start,
            &[0xFF, 0xFF],
            BlockError::OutOfImage,
        ),
        (
            "domain kind",
            c1 + entry::DOMAIN_KIND.start,
            &[9],
            BlockError::UnknownEncoding { found: 9 },
        ),
        (
            "inputs kind",
            c1 + entry::INPUTS_KIND.start,
            &[9],
            BlockError::UnknownEncoding { found: 9 },
        ),
        (
            "bytes without a domain",
            c1 + entry::DOMAIN_KIND.start,
            &[0],
            BlockError::BadShape,
        ),
        (
            "too many half-spaces",
            HEADER_LEN,
            &[57],
            BlockError::BadShape,
        ),
        (
            "hull larger than the list",
            HEADER_LEN + 1,
            &[3],
            BlockError::BadShape,
        ),
        (
            "too many look-aheads",
            HEADER_LEN + 2,
            &[5],
            BlockError::BadShape,
        ),
        (
            "half-space that overflows",
            HEADER_LEN + 15,
            &[0xFF, 0x7F, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0x7F],
            BlockError::Overflow,
        ),
        (
            "half-space that does not exist",
            HEADER_LEN + 28,
            &[0x44],
            BlockError::BadLevel,
        ),
        ("too many pieces", TREE_AT, &[32], BlockError::BadShape),
        (
            "piece that overflows",
            TREE_AT + 9,
            &[0xFF, 0xFF, 0xFF, 0x7F],
            BlockError::Overflow,
        ),
        (
            "level that does not exist",
            TREE_AT + 14,
            &[4],
            BlockError::BadLevel,
        ),
        (
            "piece that does not exist",
            TREE_AT + 17,
            &[33],
            BlockError::BadLevel,
        ),
        ("delta 0", TREE_AT + 13, &[0], BlockError::BadNode),
        (
            "left leaf past 63",
            TREE_AT + 16,
            &[0x80],
            BlockError::BadNode,
        ),
        (
            "fewer visits than needed",
            c1 + entry::WORST_VISITS.start,
            &[3],
            BlockError::TooManyVisits,
        ),
    ];
    for (what, at, bytes, reason) in cases {
        assert_eq!(error(&patched(*at, bytes)), of_c1(*reason), "{what}");
    }
    let of_hold = |reason| TableError::BadBlock {
        law: Law::Hold,
        reason,
    };
    assert_eq!(
        error(&patched(DENSE_AT + DENSE_HEADER_LEN, &[0x05])),
        of_hold(BlockError::BadLevel)
    );
    assert_eq!(
        error(&patched(DENSE_AT, &[4])),
        of_hold(BlockError::BadShape)
    );
    let hold = c1 + 2 * DIRECTORY_ENTRY_LEN;
    // A directory that leaves bytes over.
    assert_eq!(
        error(&patched(hold + entry::INPUTS_LEN.start, &[16])),
        of_hold(BlockError::BadShape),
        "a dense block cut short"
    );
}

/// One look-ahead: f rises by two cells a step for at most three steps, until it is in 6..=7; g
/// must not pass 2.
const LOOK_AHEAD: [u8; 76] = [
    0x00, 0x00, 0x01, // no half-space, no hull, one look-ahead
    0x04, 0x03, 0x00, 0x00, // four fractional bits, three steps
    0x06, 0x00, 0x07, 0x00, // ends well in f 6..=7
    0x01, 0x00, 0x09, 0x00, // f keeps to 1..=9
    0x10, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // f' = f + 2
    0x00, 0x00, 0x10, 0x00, 0x00, 0x00, 0x00, 0x00, // g' = g
    0x00, 0x00, 0x00, 0x00, 0x10, 0x00, 0x00, 0x00, // l' = l
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x10, 0x00, // p' = p
    0x20, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // near offsets of f, g
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, // of l, p
    0x10, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, // far offsets: g one more a step, l and p none
    0x3A, // the look-ahead decides everywhere
];

#[test]
fn a_look_ahead_answers_as_drawn() {
    let mut header = header();
    header.grid = Grid::new([0; 4], [1; 4], [10, 3, 1, 1]).unwrap();
    header.laws[0] = Some(LawEntry {
        domain_kind: DomainKind::Tree as u8,
        inputs_kind: InputsKind::Tree as u8,
        worst_visits: 5,
        domain_len: LOOK_AHEAD.len() as u32,
        inputs_len: 2,
    });
    let image = |part: &[u8], visits: u16| {
        let mut header = header;
        if let Some(entry) = &mut header.laws[0] {
            entry.worst_visits = visits;
        }
        let mut image = write_header(&header).to_vec();
        image.extend(part);
        // One leaf: level 3 everywhere.
        image.extend([0, 3]);
        image.extend([0; CRC_LEN]);
        seal(&mut image).unwrap();
        image
    };
    let good = image(&LOOK_AHEAD, 5);
    let table = TableView::parse(&good).unwrap();
    let at = |f, g| table.lookup(Law::C1, Cell([f, g, 0, 0]));
    assert_eq!([at(6, 2), at(7, 2)], [Some(3); 2], "there already");
    assert_eq!(at(5, 1), Some(3), "5 -> 7, g at most 2");
    assert_eq!(at(4, 2), None, "g at most 3");
    assert_eq!(at(2, 0), Some(3), "2 -> 4 -> 6");
    assert_eq!(at(2, 1), None);
    assert_eq!(at(8, 0), None, "8 -> 10");
    let law = table.law(Law::C1).unwrap();
    assert_eq!(
        law.visits(Cell([2, 0, 0, 0])),
        4,
        "one node, two steps, one node"
    );
    assert_eq!(law.worst_visits(), 5);
    assert_eq!(
        LookAhead::read(LOOK_AHEAD[3..75].first_chunk().unwrap())
            .unwrap()
            .write(),
        LOOK_AHEAD[3..75]
    );
    let of_c1 = |reason| TableError::BadBlock {
        law: Law::C1,
        reason,
    };
    assert_eq!(
        error(&image(&LOOK_AHEAD, 4)),
        of_c1(BlockError::TooManyVisits)
    );
    for (at, byte, reason) in [
        (3, 0x10, BlockError::BadShape),
        (4, 0x00, BlockError::BadShape),
        (13, 0x0A, BlockError::Overflow),
        (75, 0x3B, BlockError::BadLevel),
    ] {
        let mut part = LOOK_AHEAD;
        part[at] = byte;
        assert_eq!(error(&image(&part, 5)), of_c1(reason), "byte {at}");
    }
}

/// Bytes of an inputs part as the tree of a law whose domain is everything.
fn with_tree(tree: &[u8]) -> Vec<u8> {
    let mut header = header();
    let domain = [0, 0, 0, LEAF_INSIDE];
    header.laws[0] = Some(LawEntry {
        domain_kind: DomainKind::Tree as u8,
        inputs_kind: InputsKind::Tree as u8,
        worst_visits: u16::MAX,
        domain_len: domain.len() as u32,
        inputs_len: tree.len() as u32,
    });
    let mut image = write_header(&header).to_vec();
    image.extend(domain);
    image.extend(tree);
    image.extend([0; CRC_LEN]);
    seal(&mut image).unwrap();
    image
}

fn block_error(tree: &[u8]) -> BlockError {
    match error(&with_tree(tree)) {
        TableError::BadBlock { reason, .. } => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn trees_that_are_no_tree_are_refused() {
    // Left subtree of three bytes, right subtree of three.
    let good = [0, 0x10, 0x40, 0x0D, 0x41, 0x02, 0x0E, 0x40, 0x03];
    let image = with_tree(&good);
    let table = TableView::parse(&image).unwrap();
    let at = |f, g, l| table.lookup(Law::C1, Cell([f, g, l, 0]));
    assert_eq!([at(0, 0, 0), at(0, 1, 0)], [Some(1), Some(2)]);
    assert_eq!([at(2, 0, 0), at(2, 0, 1)], [Some(0), Some(3)]);
    let mut wrong = good;
    wrong[2] = 0x41;
    assert_eq!(
        block_error(&wrong),
        BlockError::BadNode,
        "skip past the left subtree"
    );
    assert_eq!(
        block_error(&good[..6]),
        BlockError::BadNode,
        "no right subtree"
    );
    assert_eq!(
        block_error(&[0, 0x0D, 0x40, 1, 9]),
        BlockError::BadShape,
        "bytes left over"
    );
    assert_eq!(
        block_error(&[0, 4]),
        BlockError::BadLevel,
        "a single leaf past the levels"
    );
    assert_eq!(block_error(&[]), BlockError::BadShape);
    assert_eq!(
        block_error(&[1, 0, 0]),
        BlockError::BadShape,
        "a piece cut short"
    );
    // 65 nodes in a chain, each with a left leaf; the last has two.
    let mut chain = vec![0];
    chain.extend([0x08, 0x00].repeat(64));
    chain.extend([0x0C, 0x40, 0x01]);
    assert_eq!(block_error(&chain), BlockError::TooManyVisits);
    let mut chain = vec![0];
    chain.extend([0x08, 0x00].repeat(63));
    chain.extend([0x0C, 0x40, 0x01]);
    let image = with_tree(&chain);
    let table = TableView::parse(&image).unwrap();
    assert_eq!(table.law(Law::C1).unwrap().encoding().worst_visits(), 64);
}

#[test]
fn a_tree_needs_a_domain() {
    let mut header = header();
    header.laws[0] = Some(LawEntry {
        domain_kind: DomainKind::InInputs as u8,
        inputs_kind: InputsKind::Tree as u8,
        worst_visits: 9,
        domain_len: 0,
        inputs_len: 2,
    });
    let mut image = write_header(&header).to_vec();
    image.extend([0, 0, 0, 0, 0, 0]);
    seal(&mut image).unwrap();
    let reason = BlockError::NoDomain;
    let law = Law::C1;
    assert_eq!(error(&image), TableError::BadBlock { law, reason });
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = TableView::parse(&bytes);
    }

    /// Blocks of arbitrary bytes under a valid frame: most are refused, and those that are not
    /// answer every lookup.
    #[test]
    fn arbitrary_blocks_never_panic(
        domain in proptest::collection::vec(any::<u8>(), 0..40),
        inputs in proptest::collection::vec(any::<u8>(), 0..60),
        kinds in (0u8..3, 0u8..3), cells in proptest::collection::vec(any::<[u16; 4]>(), 8),
    ) {
        let mut header = header();
        header.laws[1] = Some(LawEntry {
            domain_kind: kinds.0,
            inputs_kind: kinds.1,
            worst_visits: u16::MAX,
            domain_len: domain.len() as u32,
            inputs_len: inputs.len() as u32,
        });
        let mut image = write_header(&header).to_vec();
        image.extend(domain);
        image.extend(inputs);
        image.extend([0; CRC_LEN]);
        seal(&mut image).unwrap();
        if let Ok(table) = TableView::parse(&image) {
            look_everywhere(&table, &cells);
        }
    }

    /// Trees of mostly valid nodes: lookups end within the stated visits, at a level that exists.
    #[test]
    fn accepted_trees_are_total(
        nodes in proptest::collection::vec((0u8..4, 1u8..4, 0u8..4, 0u8..4, 0u8..4), 1..30),
        cells in proptest::collection::vec(any::<[u16; 4]>(), 8),
    ) {
        let mut tree = vec![0];
        for (axis, delta, form, left, right) in nodes {
            match form {
                0 => tree.extend([axis | 4 | delta << 3, 64 + left, right]),
                1 => tree.extend([axis | delta << 3, left]),
                2 => tree.extend([axis | 4 | delta << 3, right]),
                _ => tree.extend([axis | delta << 3, 64 + left * 3]),
            }
        }
        tree.extend([0x0C, 0x40, 0x01]);
        let image = with_tree(&tree);
        if let Ok(table) = TableView::parse(&image) {
            look_everywhere(&table, &cells);
        }
    }
}

fn look_everywhere(table: &TableView<'_>, others: &[[u16; 4]]) {
    let grid = table.header().grid;
    for index in 0..grid.cells() {
        let cell = grid.cell(index).unwrap();
        for law in Law::ALL {
            let level = table.lookup(law, cell);
            assert!(level.is_none_or(|level| level < table.header().levels));
            if let Some(view) = table.law(law) {
                assert!(view.visits(cell) <= view.worst_visits());
            }
        }
    }
    for cell in others {
        for law in Law::ALL {
            let outside = grid.index(Cell(*cell)).is_none();
            assert!(!outside || table.lookup(law, Cell(*cell)).is_none());
        }
    }
}
