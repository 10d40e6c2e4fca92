//! External interrupts INTn and pin change interrupts PCINTn (section 13).
//!
//! A pin goes through three flip-flops in a row, the first of them the synchroniser that PINx has too. Of an INT pin the second
//! and the third are compared, of the pins of a group the first with what comes in (figure 13-1); either way what changes at the
//! edge `t` sets its flag at `t + 3`. Levels, and the edges that the data sheet calls asynchronous, do without a clock.
//!
//! While the I/O clock stands, [`requests`](super::Device::requests) says what asks to wake: levels, edges without a clock or by
//! [`Kind::edges_wake`], and changes of pins that count. It is to be asked again at the end of the start-up time, after [`wake`](super::Device::wake):
//! a level that is gone by then, or a pin that is back, leaves no interrupt (13.1). The flag of a pin that is not back comes
//! within the four cycles for which the core is halted then (10.2).

mod device;
mod kind;

pub use self::kind::{Kind, Reg};
use emu_core::NEVER;
use emu_core::state;

use super::{Outbox, Signal};

/// Cycles from a change of a pin to its flag.
const DETECT: u64 = 3;

/// Groups of pins, as bits, for which `test` holds.
fn groups_with(test: impl Fn(usize) -> bool) -> u8 {
    (0..4).fold(0, |bits, group| bits | u8::from(test(group)) << group)
}

/// Bits 0 to 3 at the even places.
fn spread(bits: u8) -> u8 {
    (0..4).fold(0, |spread, n| spread | (bits >> n & 1) << (2 * n))
}

/// The bits at even places as bits 0 to 3.
fn gather(bits: u8) -> u8 {
    (0..4).fold(0, |gathered, n| gathered | (bits >> (2 * n) & 1) << n)
}

/// All pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Pins {
    /// INT0 to INT7.
    int: u8,
    /// PCINT0 to PCINT31.
    pc: [u8; 4],
}

state! { Pins { int, pc } }

/// What has changed in one cycle, on its way to the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Change {
    /// When it comes to the flags.
    at: u64,
    rose: u8,
    fell: u8,
    groups: u8,
}

state! { Change { at, rose, fell, groups } }

/// The external interrupts. [`Line::Int`](super::Line::Int) and [`Line::Pc`](super::Line::Pc) are their lines; what a chip does
/// not have is ignored. All pins are low at first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct External {
    kind: Kind,
    /// ISCn1, a bit for each input.
    isc1: u8,
    /// ISCn0.
    isc0: u8,
    eimsk: u8,
    eifr: u8,
    pcicr: u8,
    pcifr: u8,
    pcmsk: [u8; 4],
    pins: Pins,
    /// The first flip-flops.
    seen: Pins,
    /// The edge at which `pins` last became another; the first flip-flops take that at the next edge.
    changed: u64,
    /// Changes behind the first flip-flops, the oldest first.
    ways: [Option<Change>; 3],
    /// The edge at which flags were set last, and which: INTF, PCIF.
    flagged: (u64, u8, u8),
    listened: bool,
    /// When the I/O clock was stopped.
    stopped: Option<u64>,
}

state! {
    External {
        isc1, isc0, eimsk, eifr, pcicr, pcifr, pcmsk, pins, seen, changed, ways, flagged, listened, stopped,
    } stays { kind } if |of, _now| of.changed != NEVER && of.stopped != Some(NEVER)
}

impl External {
    /// The external interrupts after power-on.
    #[must_use]
    pub fn new(kind: Kind) -> External {
        External {
            kind,
            isc1: 0,
            isc0: 0,
            eimsk: 0,
            eifr: 0,
            pcicr: 0,
            pcifr: 0,
            pcmsk: [0; 4],
            pins: Pins::default(),
            seen: Pins::default(),
            changed: 0,
            ways: [None; 3],
            flagged: (0, 0, 0),
            listened: false,
            stopped: None,
        }
    }

    /// Whether INTF0 gives [`Signal::Flag`] when it is set, enabled or not (the converter's trigger source 2).
    pub fn listen(&mut self, on: bool, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        self.listened = on;
    }

    /// A change of the pin of PCINT `n` gives an interrupt: PCIE of its group and its bit of PCMSK are set.
    #[must_use]
    pub fn pin_change_on(&self, n: u8) -> bool {
        let group = usize::from(n / 8) % 4;
        self.pcicr >> group & 1 == 1 && self.pcmsk[group] >> (n % 8) & 1 == 1
    }

    /// Of the interrupt `irq`, edges wake that the data sheet ties to a clock ([`Kind::edges_wake`]).
    #[must_use]
    pub fn wakes_by_edge(&self, irq: u8) -> bool {
        let clocked = self.kind.inputs() & !self.low() & !self.kind.asynchronous;
        self.kind.edges_wake && clocked.checked_shr(irq.into()).unwrap_or(0) & 1 == 1
    }

    /// INTF0, after everything that was run.
    #[must_use]
    pub const fn flag(&self) -> bool {
        self.eifr & 1 != 0
    }

    /// Inputs that ask as long as they are low (ISCn = 0).
    const fn low(&self) -> u8 {
        self.kind.inputs() & !(self.isc1 | self.isc0 | self.kind.edge_only)
    }

    /// Inputs that look for one sort of edge, which ISCn0 says.
    const fn one_edge(&self) -> u8 {
        self.isc1 | self.kind.edge_only
    }

    /// Inputs that look for any change. ISCn = 1 is reserved where edges need no clock, and does nothing there.
    const fn any_edge(&self) -> u8 {
        !self.isc1 & self.isc0 & !self.kind.asynchronous
    }

    /// Inputs that are as they are after the edge that ISCn0 says.
    const fn active(&self) -> u8 {
        !(self.pins.int ^ self.isc0)
    }

    /// Inputs, of those whose edges need a clock, for which a change sets the flag.
    const fn found(&self, change: &Change) -> u8 {
        let rising = self.any_edge() | self.one_edge() & self.isc0;
        let falling = self.any_edge() | self.one_edge() & !self.isc0;
        (change.rose & rising | change.fell & falling) & !self.kind.asynchronous
    }

    /// Groups with a pin that counts and is not as the first flip-flop has it.
    fn groups_changed(&self) -> u8 {
        groups_with(|group| (self.pins.pc[group] ^ self.seen.pc[group]) & self.pcmsk[group] != 0)
    }

    /// What the first flip-flops take at their next edge, if there is something that they do not have.
    fn fresh(&self) -> Option<Change> {
        (self.pins != self.seen).then(|| Change {
            at: self.changed.saturating_add(DETECT),
            rose: self.pins.int & !self.seen.int,
            fell: self.seen.int & !self.pins.int,
            groups: self.groups_changed(),
        })
    }

    /// Everything on its way, the oldest first. Nothing moves while the clock stands.
    fn coming(&self) -> impl Iterator<Item = Change> {
        let clocked = self.stopped.is_none();
        self.ways.into_iter().flatten().chain(self.fresh()).filter(move |_| clocked)
    }

    /// Does everything that is due at or before `t`.
    fn advance(&mut self, t: u64, out: &mut Outbox) {
        if self.stopped.is_some() {
            return;
        }
        if let Some(change) = self.fresh().filter(|_| self.changed < t) {
            self.seen = self.pins;
            // Of a cycle there is one change at most, and the one three cycles ago has come out.
            let place = self.ways.iter().position(Option::is_none).unwrap_or(2);
            self.ways[place] = Some(change);
        }
        while let [Some(change), second, third] = self.ways {
            if change.at > t {
                break;
            }
            self.ways = [second, third, None];
            self.set(self.found(&change), change.groups, change.at, out);
        }
    }

    /// Sets flags at the edge `t`.
    fn set(&mut self, ints: u8, groups: u8, t: u64, out: &mut Outbox) {
        if self.listened && ints & !self.eifr & 1 != 0 {
            out.push(Signal::Flag { t, irq: 0 });
        }
        self.eifr |= ints;
        self.pcifr |= groups;
        if self.flagged.0 != t {
            self.flagged = (t, 0, 0);
        }
        self.flagged.1 |= ints;
        self.flagged.2 |= groups;
    }

    /// Does something to pins or ISC at `t`, and sets the flags of inputs without a clock whose edge that makes.
    fn trigger(&mut self, t: u64, out: &mut Outbox, change: impl FnOnce(&mut External)) {
        let before = self.active();
        change(self);
        let edges = self.active() & !before & self.one_edge() & self.kind.asynchronous;
        self.set(edges, 0, t, out);
        if self.stopped.is_some() && self.kind.edges_wake {
            self.catch_edges(t, out);
        }
        self.eifr &= !self.low();
    }

    /// Edges of INT that are on their way set their flags at once: the clock stands, and they wake nevertheless.
    fn catch_edges(&mut self, t: u64, out: &mut Outbox) {
        let fresh = self.fresh();
        let found = self.ways.iter().flatten().chain(&fresh).fold(0, |ints, change| ints | self.found(change));
        for change in self.ways.iter_mut().flatten() {
            (change.rose, change.fell) = (0, 0);
        }
        self.seen.int = self.pins.int;
        self.set(found, 0, t, out);
    }

    /// Writes ISC of the inputs `mask`, whose bits 0 to 3 begin at the input `first`.
    fn write_isc(&mut self, value: u8, mask: u8, first: u8, t: u64, out: &mut Outbox) {
        let inputs = self.kind.inputs();
        let merge = |old: u8, shift: u8, there: u8| {
            let bits = gather(mask >> shift) << first & there;
            old & !bits | gather(value >> shift) << first & bits
        };
        self.trigger(t, out, |external| {
            external.isc1 = merge(external.isc1, 1, inputs & !external.kind.edge_only);
            external.isc0 = merge(external.isc0, 0, inputs);
        });
    }

    fn shown(&self, reg: Reg) -> u8 {
        let isc = |first: u8| spread(self.isc0 >> first) | spread(self.isc1 >> first) << 1;
        match reg {
            Reg::EICRA => isc(0),
            Reg::EICRB => isc(4),
            Reg::EIMSK => self.eimsk,
            Reg::EIFR => self.eifr,
            Reg::PCICR => self.pcicr,
            Reg::PCIFR => self.pcifr,
            Reg::PCMSK0 => self.pcmsk[0],
            Reg::PCMSK1 => self.pcmsk[1],
            Reg::PCMSK2 => self.pcmsk[2],
            Reg::PCMSK3 => self.pcmsk[3],
        }
    }
}
