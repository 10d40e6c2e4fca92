//! External interrupts INTn and pin change interrupts PCINTn (section 13).
//!
//! A pin passes three flip-flops in series; the first is the synchronizer that PINx has too. For an INT pin
//! the second and third are compared; for the pins of a group, the first is compared with its input (figure
//! 13-1). In both cases a change at the edge `t` sets its flag at `t + 3`. Levels, and the edges that the
//! data sheet calls asynchronous, need no clock.
//!
//! While the I/O clock is stopped, [`interrupt_requests`](super::Device::interrupt_requests) returns what
//! requests a wake-up: levels, edges without a clock or by [`ExternalKind::edges_wake`], and changes of
//! enabled pins. The chip asks again at the end of the start-up time, after
//! [`restart_clock`](super::Device::restart_clock): a level that has gone by then, or a pin that is back
//! at its old level, causes no interrupt (13.1). The flag of a pin that is not back is set within the four
//! cycles for which the core is then halted (10.2).

mod device;
mod kind;

pub use self::kind::{ExternalKind, ExternalRegister, ExternalSense};
use emu_core::NEVER;
use emu_core::state;

use super::{AvrOutbox, AvrSignal};

/// Cycles from a change of a pin to the change of its flag.
const DETECT_CYCLES: u64 = 3;

/// Mask of the pin groups for which `test` holds.
fn groups_matching(test: impl Fn(usize) -> bool) -> u8 {
    (0..4).fold(0, |bits, group| bits | u8::from(test(group)) << group)
}

/// Moves bits 0 to 3 to the even positions.
fn spread_bits(bits: u8) -> u8 {
    (0..4).fold(0, |spread, n| spread | (bits >> n & 1) << (2 * n))
}

/// Moves the bits at even positions to bits 0 to 3.
fn gather_bits(bits: u8) -> u8 {
    (0..4).fold(0, |gathered, n| gathered | (bits >> (2 * n) & 1) << n)
}

/// Levels of all pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct ExternalPins {
    /// Levels of INT0 to INT7.
    int: u8,
    /// Levels of PCINT0 to PCINT31.
    pc: [u8; 4],
}

state! { ExternalPins { int, pc } }

/// The pin changes of one cycle that have not reached the flags yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct ExternalChange {
    /// Cycle at which they reach the flags.
    at: u64,
    rose: u8,
    fell: u8,
    groups: u8,
}

state! { ExternalChange { at, rose, fell, groups } }

/// The external interrupts. Their lines are [`AvrLine::Int`](super::AvrLine::Int) and
/// [`AvrLine::Pc`](super::AvrLine::Pc); lines that the chip does not have are ignored. All pins are low
/// initially.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalInterrupts {
    kind: ExternalKind,
    /// ISCn1, one bit for each input.
    isc1: u8,
    /// ISCn0, one bit for each input.
    isc0: u8,
    eimsk: u8,
    eifr: u8,
    pcicr: u8,
    pcifr: u8,
    pcmsk: [u8; 4],
    pins: ExternalPins,
    /// Levels in the first flip-flops.
    sampled_pins: ExternalPins,
    /// Edge at which `pins` last changed; the first flip-flops sample that at the next edge.
    changed: u64,
    /// Changes that have passed the first flip-flops, the oldest first.
    pending_changes: [Option<ExternalChange>; 3],
    /// Edge at which flags were last set, and which: INTF, PCIF.
    last_flagged: (u64, u8, u8),
    has_flag_listener: bool,
    /// Cycle at which the I/O clock was stopped; None while it runs.
    stopped: Option<u64>,
}

state! {
    ExternalInterrupts {
        isc1, isc0, eimsk, eifr, pcicr, pcifr, pcmsk, pins, sampled_pins, changed, pending_changes, last_flagged, has_flag_listener, stopped,
    } stays { kind } if |of, _now| of.changed != NEVER && of.stopped != Some(NEVER)
}

impl ExternalInterrupts {
    /// Returns the external interrupts after power-on.
    #[must_use]
    pub fn new(kind: ExternalKind) -> ExternalInterrupts {
        ExternalInterrupts {
            kind,
            isc1: 0,
            isc0: 0,
            eimsk: 0,
            eifr: 0,
            pcicr: 0,
            pcifr: 0,
            pcmsk: [0; 4],
            pins: ExternalPins::default(),
            sampled_pins: ExternalPins::default(),
            changed: 0,
            pending_changes: [None; 3],
            last_flagged: (0, 0, 0),
            has_flag_listener: false,
            stopped: None,
        }
    }

    /// Sets whether INTF0 sends [`AvrSignal::Flag`] when it is set, even if disabled. It is trigger source 2
    /// of the converter.
    pub fn set_flag_listener(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        self.has_flag_listener = on;
    }

    /// Reports whether a change of the pin PCINT`n` causes an interrupt: PCIE of its group and its bit of
    /// PCMSK are set.
    #[must_use]
    pub fn pin_change_on(&self, n: u8) -> bool {
        let group = usize::from(n / 8) % 4;
        self.pcicr >> group & 1 == 1 && self.pcmsk[group] >> (n % 8) & 1 == 1
    }

    /// Reports whether edges of the interrupt `irq` wake the core although the data sheet requires a clock
    /// for them ([`ExternalKind::edges_wake`]).
    #[must_use]
    pub fn wakes_by_edge(&self, irq: u8) -> bool {
        let clocked = self.kind.int_mask() & !self.low() & !self.kind.asynchronous;
        self.kind.edges_wake && !self.kind.wake_by_sheet && clocked.checked_shr(irq.into()).unwrap_or(0) & 1 == 1
    }

    /// Returns INTF0. Call `run_due` first.
    #[must_use]
    pub const fn flag(&self) -> bool {
        self.eifr & 1 != 0
    }

    /// Mask of the inputs that request an interrupt while they are low (ISCn = 0).
    const fn low(&self) -> u8 {
        self.kind.int_mask() & !(self.isc1 | self.isc0 | self.kind.edge_only)
    }

    /// Mask of the inputs that detect one edge, which ISCn0 selects.
    const fn one_edge(&self) -> u8 {
        self.isc1 | self.kind.edge_only
    }

    /// Mask of the inputs that detect any change. On inputs with asynchronous edges ISCn = 1 is reserved and
    /// has no effect.
    const fn any_edge(&self) -> u8 {
        !self.isc1 & self.isc0 & !self.kind.asynchronous
    }

    /// Mask of the inputs whose level is the one after the edge that ISCn0 selects.
    const fn active(&self) -> u8 {
        !(self.pins.int ^ self.isc0)
    }

    /// Mask of the inputs with clocked edges whose flag `change` sets.
    const fn found(&self, change: &ExternalChange) -> u8 {
        let rising = self.any_edge() | self.one_edge() & self.isc0;
        let falling = self.any_edge() | self.one_edge() & !self.isc0;
        (change.rose & rising | change.fell & falling) & !self.kind.asynchronous
    }

    /// Mask of the groups with an enabled pin that differs from its first flip-flop.
    fn groups_changed(&self) -> u8 {
        groups_matching(|group| (self.pins.pc[group] ^ self.sampled_pins.pc[group]) & self.pcmsk[group] != 0)
    }

    /// Returns the changes that the first flip-flops sample at their next edge, if any.
    fn new_change(&self) -> Option<ExternalChange> {
        (self.pins != self.sampled_pins).then(|| ExternalChange {
            at: self.changed.saturating_add(DETECT_CYCLES),
            rose: self.pins.int & !self.sampled_pins.int,
            fell: self.sampled_pins.int & !self.pins.int,
            groups: self.groups_changed(),
        })
    }

    /// Yields all pending changes, the oldest first; none while the clock is stopped.
    fn pending_changes(&self) -> impl Iterator<Item = ExternalChange> {
        let clocked = self.stopped.is_none();
        self.pending_changes.into_iter().flatten().chain(self.new_change()).filter(move |_| clocked)
    }

    /// Executes everything that is due at or before `t`.
    fn advance(&mut self, t: u64, out: &mut AvrOutbox) {
        if self.stopped.is_some() {
            return;
        }
        if let Some(change) = self.new_change().filter(|_| self.changed < t) {
            self.sampled_pins = self.pins;
            // Each cycle has at most one change, and a change from three cycles ago has reached the flags.
            let place = self.pending_changes.iter().position(Option::is_none).unwrap_or(2);
            self.pending_changes[place] = Some(change);
        }
        while let [Some(change), second, third] = self.pending_changes {
            if change.at > t {
                break;
            }
            self.pending_changes = [second, third, None];
            self.set(self.found(&change), change.groups, change.at, out);
        }
    }

    /// Sets flags at the edge `t`.
    fn set(&mut self, ints: u8, groups: u8, t: u64, out: &mut AvrOutbox) {
        if self.has_flag_listener && ints & !self.eifr & 1 != 0 {
            out.push(AvrSignal::Flag { t, irq: 0 });
        }
        self.eifr |= ints;
        self.pcifr |= groups;
        if self.last_flagged.0 != t {
            self.last_flagged = (t, 0, 0);
        }
        self.last_flagged.1 |= ints;
        self.last_flagged.2 |= groups;
    }

    /// Applies a change to pins or ISC at `t`, and sets the flags of inputs with asynchronous edges that the
    /// change triggers.
    fn change_and_detect(&mut self, t: u64, out: &mut AvrOutbox, change: impl FnOnce(&mut ExternalInterrupts)) {
        let before = self.active();
        change(self);
        let edges = self.active() & !before & self.one_edge() & self.kind.asynchronous;
        self.set(edges, 0, t, out);
        if self.stopped.is_some() && self.kind.edges_wake {
            self.catch_edges(t, out);
        }
        self.eifr &= !self.low();
    }

    /// Sets the flags of pending INT edges at once: the clock is stopped, and the edges wake the core
    /// nevertheless.
    fn catch_edges(&mut self, t: u64, out: &mut AvrOutbox) {
        let fresh = self.new_change();
        let found =
            self.pending_changes.iter().flatten().chain(&fresh).fold(0, |ints, change| ints | self.found(change));
        for change in self.pending_changes.iter_mut().flatten() {
            (change.rose, change.fell) = (0, 0);
        }
        self.sampled_pins.int = self.pins.int;
        self.set(found, 0, t, out);
    }

    /// Writes ISC of the inputs in `mask`; bits 0 and 1 belong to the input `first`.
    fn write_isc(&mut self, value: u8, mask: u8, first: u8, t: u64, out: &mut AvrOutbox) {
        let inputs = self.kind.int_mask();
        let merge = |old: u8, shift: u8, there: u8| {
            let bits = gather_bits(mask >> shift) << first & there;
            old & !bits | gather_bits(value >> shift) << first & bits
        };
        self.change_and_detect(t, out, |external| {
            external.isc1 = merge(external.isc1, 1, inputs & !external.kind.edge_only);
            external.isc0 = merge(external.isc0, 0, inputs);
        });
    }

    fn register_value(&self, reg: ExternalRegister) -> u8 {
        let isc = |first: u8| spread_bits(self.isc0 >> first) | spread_bits(self.isc1 >> first) << 1;
        match reg {
            ExternalRegister::EICRA => isc(0),
            ExternalRegister::EICRB => isc(4),
            ExternalRegister::EIMSK => self.eimsk,
            ExternalRegister::EIFR => self.eifr,
            ExternalRegister::PCICR => self.pcicr,
            ExternalRegister::PCIFR => self.pcifr,
            ExternalRegister::PCMSK0 => self.pcmsk[0],
            ExternalRegister::PCMSK1 => self.pcmsk[1],
            ExternalRegister::PCMSK2 => self.pcmsk[2],
            ExternalRegister::PCMSK3 => self.pcmsk[3],
        }
    }
}
