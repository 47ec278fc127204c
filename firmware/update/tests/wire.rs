//! A container over a line: in parts, again, out of turn, forged; the flash is touched by a whole
//! and signed one alone.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::flash::Flash;
use common::{FLASH_LEN, container, device, layout, trusted};
use update::key::PublicKey;
use update::slots::Slots;
use update::wire::{
    Inbox, PART_MAX, Reason, SAID_MAX, Said, State, Step, read_said, read_step, write_said,
    write_step,
};

type Charger<'f> = Slots<&'f mut Flash, PublicKey>;

fn start(flash: &mut Flash) -> Charger<'_> {
    Slots::start(flash, layout(), device(trusted()))
}

/// A step over the line and its answer back, through the bytes.
fn ask(inbox: &mut Inbox<'_>, charger: &mut Charger<'_>, step: Step<'_>) -> Said {
    let mut buffer = [0; PART_MAX + 16];
    let bytes = write_step(&step, &mut buffer);
    let step = read_step(bytes).unwrap();
    let said = inbox.step(charger, &step, true);
    let mut buffer = [0; SAID_MAX];
    let length = write_said(&said, &mut buffer).unwrap();
    let read = read_said(&buffer[..length]).unwrap();
    assert_eq!(read, said);
    read
}

/// Sends all parts; the last answer.
fn send(inbox: &mut Inbox<'_>, charger: &mut Charger<'_>, container: &[u8]) -> Said {
    let len = container.len() as u32;
    let mut said = ask(inbox, charger, Step::Begin { len });
    for (n, bytes) in container.chunks(PART_MAX).enumerate() {
        let at = (n * PART_MAX) as u32;
        said = ask(inbox, charger, Step::Part { at, bytes });
        // The answer was lost.
        assert_eq!(ask(inbox, charger, Step::Part { at, bytes }), said);
    }
    said
}

const INSTALL: Step<'_> = Step::Install { now_s: None };

#[test]
fn a_signed_one_is_in_force_from_the_next_start_on() {
    let mut flash = Flash::new(FLASH_LEN, 1);
    let mut buffer = [0; 512];
    let mut inbox = Inbox::new(&mut buffer);
    let mut charger = start(&mut flash);
    let whole = container(5);
    let all = Said::Taken(whole.len() as u32);
    assert_eq!(send(&mut inbox, &mut charger, &whole), all);
    let before = charger.flash().steps;
    let later = inbox.step(&mut charger, &INSTALL, false);
    assert_eq!(later, Said::Refused(Reason::NOT_NOW));
    assert_eq!(charger.flash().steps, before);
    let installed = Said::Installed { version: 5 };
    assert_eq!(ask(&mut inbox, &mut charger, INSTALL), installed);
    let steps = charger.flash().steps;
    assert_eq!(ask(&mut inbox, &mut charger, INSTALL), installed);
    assert_eq!(charger.flash().steps, steps);
    let expected = State {
        running: None,
        slot: 0,
        confirmed: false,
        waiting: Some(5),
        taken: whole.len() as u32,
        room: 512,
    };
    assert_eq!(
        ask(&mut inbox, &mut charger, Step::State),
        Said::State(expected)
    );
    assert_eq!(start(&mut flash).running().unwrap().version, 5);
}

#[test]
fn what_is_not_whole_or_not_signed_never_reaches_the_flash() {
    let mut flash = Flash::new(FLASH_LEN, 1);
    let mut buffer = [0; 512];
    let mut inbox = Inbox::new(&mut buffer);
    let mut charger = start(&mut flash);
    let whole = container(5);
    let refused = |said: Said| match said {
        Said::Refused(reason) => reason.number,
        other => panic!("{other:?}"),
    };
    let step =
        |inbox: &mut Inbox<'_>, charger: &mut Charger<'_>, step| refused(ask(inbox, charger, step));
    assert_eq!(step(&mut inbox, &mut charger, INSTALL), 18);
    assert_eq!(step(&mut inbox, &mut charger, Step::Begin { len: 95 }), 1);
    assert_eq!(step(&mut inbox, &mut charger, Step::Begin { len: 513 }), 16);
    let part = Step::Part { at: 0, bytes: &[1] };
    assert_eq!(step(&mut inbox, &mut charger, part), 18);
    for bit in [0, 100, 8 * whole.len() - 1] {
        let mut forged = whole.clone();
        forged[bit / 8] ^= 1 << (bit % 8);
        send(&mut inbox, &mut charger, &forged);
        assert!([3, 6].contains(&step(&mut inbox, &mut charger, INSTALL)));
    }
    // One byte is missing, one is sent twice at the wrong place, and one leaves the container.
    let len = whole.len() as u32;
    ask(&mut inbox, &mut charger, Step::Begin { len });
    for at in [1, u32::MAX] {
        let part = Step::Part { at, bytes: &[1] };
        assert_eq!(step(&mut inbox, &mut charger, part), 18);
    }
    for (n, bytes) in whole[..whole.len() - 1].chunks(PART_MAX).enumerate() {
        let at = (n * PART_MAX) as u32;
        ask(&mut inbox, &mut charger, Step::Part { at, bytes });
    }
    let part = Step::Part {
        at: len - 1,
        bytes: &[1, 2],
    };
    assert_eq!(step(&mut inbox, &mut charger, part), 18);
    assert_eq!(step(&mut inbox, &mut charger, INSTALL), 18);
    assert_eq!(charger.flash().steps, 0);
    assert_eq!(charger.running(), None);
}
