//! [`Bus`]: the chip around a core, as the core and the run loop see it.

#[cfg(doc)]
use crate::cpu::NEVER;
use crate::cpu::{Probe, ResetCause};
use crate::external_io::{EventLog, OutsideInput};
use crate::pins::{CycleTime, PinId, PinLevel, PinState};

/// Requests of a bus access to the core, as a set of bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BusEffect(pub u32);

impl BusEffect {
    /// No request.
    pub const NONE: BusEffect = BusEffect(0);
    /// Deadlines, pending interrupts or interrupt enables may have changed: check them before the next
    /// instruction.
    pub const RECHECK: BusEffect = BusEffect(1);
    /// Take no interrupt before the next instruction has been executed.
    pub const HOLD_INTERRUPTS: BusEffect = BusEffect(2);

    /// Returns true if the set contains a bit of `other`.
    #[must_use]
    pub const fn contains(self, other: BusEffect) -> bool {
        self.0 & other.0 != 0
    }
}

/// What a read of a register returns.
///
/// The compiler would place the larger field first, and then the hot loop of the 8051 needs up to 8 % more
/// instructions of the host (`benches/instructions.sh`); so the order of the fields is fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct RegisterRead {
    /// The value that the instruction reads.
    pub value: u8,
    /// What the read changed in the machine besides the value.
    pub effect: BusEffect,
}

/// What a core sees of its chip, except for plain RAM, and what the run loop asks of it between two
/// instructions. `now` is the machine cycle of the access. A write takes effect at the edge that ends that
/// cycle. Every access first executes what is due at its own cycle.
pub trait Bus: Clone {
    /// A request of the chip to its core, carried out between two instructions.
    type Request;
    /// Reads a register as the program does, with side effects.
    fn read(&mut self, reg: u16, now: u64) -> RegisterRead;
    /// Reads a register for a read-modify-write instruction. A port returns its latch instead of its pins,
    /// where that makes a difference.
    fn read_latch(&mut self, reg: u16, now: u64) -> RegisterRead {
        self.read(reg, now)
    }
    /// Reads a register without side effects.
    fn peek(&self, reg: u16, now: u64) -> u8;
    /// Writes a register.
    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect;
    /// Writes only the bits in `mask`, as single-bit instructions do.
    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect;
    /// Executes what is due up to `now` and returns the next deadline, or [`NEVER`].
    fn fire(&mut self, now: u64) -> u64;
    /// Removes and returns the reset that the chip requests, if any.
    fn requested_reset(&mut self, now: u64) -> Option<ResetCause> {
        let _ = now;
        None
    }
    /// Removes and returns the oldest request to the core.
    fn next_request(&mut self, now: u64) -> Option<Self::Request> {
        let _ = now;
        None
    }
    /// Returns the cycle up to which a read of `reg` gives the same value without side effects if the program
    /// does nothing. The result is after `now`, or is `now` itself if nothing is guaranteed.
    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        let _ = reg;
        now
    }
    /// The vector number of the interrupt that would be taken at `now`, if any.
    fn pending_interrupt(&self, now: u64) -> Option<u8> {
        let _ = now;
        None
    }
    /// Acknowledges the interrupt that the core takes.
    fn acknowledge_interrupt(&mut self, vector: u8, now: u64) {
        let _ = (vector, now);
    }
    /// Returns true if the chip keeps the core from its next instruction: sleep, reset, start-up, or no
    /// supply.
    fn is_core_stopped(&self) -> bool;
    /// Returns true if an enabled source can still interrupt or reset the chip.
    fn can_wake(&self, interrupts_enabled: bool) -> bool;
    /// Returns true if something is still pending: a byte that is being sent, or a queued drive.
    fn is_busy(&self) -> bool;
    /// The pins that the chip and the outside can drive against each other, in the order of their numbers.
    fn pins(&self) -> &[PinState] {
        &[]
    }
    /// Level of a pin after everything that was executed so far; [`PinLevel::Float`] if the pin does not
    /// exist.
    fn level(&self, pin: PinId) -> PinLevel {
        self.pins().get(usize::from(pin)).map_or(PinLevel::Float, PinState::level)
    }
    /// Returns true if the chip and the outside drive a pin to opposite levels.
    fn has_contention(&self, pin: PinId) -> bool {
        self.pins().get(usize::from(pin)).is_some_and(PinState::has_contention)
    }
    /// Queues an input from outside for the time `at`, or applies it at the machine cycle `now` if that has
    /// passed. Inputs of the same time take effect in call order. Returns false if the chip does not model
    /// such inputs.
    fn queue_input(&mut self, at: CycleTime, now: u64, input: OutsideInput) -> bool;
    /// The byte whose stop bit is being sent, if the program already sees it as sent.
    fn byte_in_stop_bit(&self) -> Option<u8> {
        None
    }
    /// Enables or disables the log of edges, sent bytes and contentions from the cycle `now` on. Enabling it
    /// logs the present contentions; disabling it discards all events.
    fn set_event_log(&mut self, on: bool, now: u64) {
        let starts = on && !self.event_log().is_enabled();
        let pins = if starts { 0..self.pins().len() as PinId } else { 0..0 };
        let contended = pins.filter(|&pin| self.has_contention(pin)).collect();
        self.event_log().set_enabled(on, now, contended);
        self.on_event_log_set(on);
    }
    /// Is called after the log was enabled or disabled.
    fn on_event_log_set(&mut self, on: bool) {
        let _ = on;
    }
    /// The log of events.
    fn event_log(&mut self) -> &mut EventLog;
    /// Executes everything up to `now`, including what is normally computed only when it is read, so that
    /// equal machines have equal states.
    fn normalize(&mut self, now: u64) {
        let _ = now;
    }
}

/// Passes the logged events of a chip to the probe. Returns true if the probe requests a stop.
#[inline]
pub fn report_events<B: Bus, P: Probe>(bus: &mut B, probe: &mut P) -> bool {
    let mut stop_requested = false;
    if P::EVENTS {
        while let Some(event) = bus.event_log().pop() {
            stop_requested |= probe.on_event(event);
        }
    }
    stop_requested
}
