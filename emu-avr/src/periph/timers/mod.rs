//! The timer/counters (sections 15 to 18): counter, compare units and their pins, input capture, asynchronous
//! operation.
//!
//! Most clock edges only count, so the counter is computed in closed form (`counting_cycle`), and the flags
//! are computed when they are read. Special edges change a pin, update a buffered OCR, or are the first after
//! a write of TCNT; `count` executes them one at a time.

mod count;
mod counting_cycle;
mod deadlines;
mod device;
mod mode;
mod pins;
mod regs;
mod shape;
mod state;
mod tosc;

pub use shape::{
    CAPT16, COMPA8, COMPA16, COMPB8, COMPB16, COMPC16, ClockTap, ICF, OCFA, OCFB, OCFC, OVF8, OVF16, OVF16C, TOV,
    TimerRegister, TimerShape,
};

use emu_core::NEVER;
use emu_core::parts::prescaler::{Prescaler, TickSeries};

use super::{AvrDrive, AvrLine, AvrOutbox, AvrSignal};
use mode::{MatchAction, TimerMode, TopSource};
use pins::{CapturePin, SamplePipe};
use tosc::AsyncOscillator;

/// Output lines of the channels.
const OUTPUT_LINES: [AvrLine; 3] = [AvrLine::OcA, AvrLine::OcB, AvrLine::OcC];

/// An output compare channel.
#[derive(Debug, Clone, Copy)]
struct CompareChannel {
    /// OCR as it reads; on the asynchronous timer, the temporary register (18.9).
    written: u16,
    /// The buffer register of the PWM modes.
    buffer: u16,
    /// Value that is compared with the counter.
    compare: u16,
    /// Effect of a match.
    action: MatchAction,
    /// Level of the OC register, which can differ from the pin.
    level: bool,
    driven: AvrDrive,
}

impl CompareChannel {
    const NEW: CompareChannel = CompareChannel {
        written: 0,
        buffer: 0,
        compare: 0,
        action: MatchAction::None,
        level: false,
        driven: AvrDrive::Port,
    };
}

/// Clock source of the timer.
#[derive(Debug, Clone, Copy)]
enum TimerClock {
    Stopped,
    /// The divided I/O clock.
    Io(TickSeries),
    /// TOSC1, divided by `div` from the edge `base` on.
    Tosc {
        div: u64,
        base: u64,
    },
    /// Edges of the pin T.
    Pin {
        rising: bool,
    },
}

/// A timer/counter.
#[derive(Debug, Clone)]
pub struct AvrTimer {
    shape: TimerShape,
    tccra: u8,
    tccrb: u8,
    timsk: u8,
    tifr: u8,
    assr: u8,
    temp: u8,
    icr: u16,
    channels: [CompareChannel; 3],
    /// TCCRA and TCCRB as they are in effect; on the asynchronous timer this is later than their read value
    /// changes.
    effective_control: [u8; 2],
    mode: TimerMode,
    value: u16,
    down: bool,
    /// True after a write of TCNT: the next timer clock has no compare match (15.5.2).
    match_blocked: bool,
    clock: TimerClock,
    /// Number of edges of `clock` that are already counted in `value`.
    edges_counted: u64,
    prescaler: Prescaler,
    pin: SamplePipe,
    icp: CapturePin,
    /// Levels of the lines T and ICP, even if they are not sampled.
    line_levels: [bool; 2],
    asleep: Option<u64>,
    listened_interrupts: u8,
    tosc: AsyncOscillator,
    /// Edge of TOSC1 at which the divider of the asynchronous timer was cleared.
    cleared: u64,
    /// Busy bits as in ASSR; then the edges of TOSC1 at which the temporary registers are latched.
    busy: u8,
    due: [u64; 5],
    tcnt_next: u16,
    strobe: u8,
    /// Asynchronous timer: cycles at which the pending flags TOV, OCFA and OCFB are set.
    pending_flags: [u64; 3],
    /// Value that TCNT reads after sleep, up to this edge of TOSC1.
    stale_count: (u16, u64),
    /// Before this cycle the timer only counts; 0 if it must be computed again.
    next_event: u64,
    /// Before this cycle no flag is set; 0 if it must be computed again.
    next_flag: u64,
}

impl AvrTimer {
    /// Returns a timer after power-on, with a prescaler that starts from zero at cycle 0.
    #[must_use]
    pub fn new(shape: TimerShape) -> AvrTimer {
        AvrTimer {
            shape: TimerShape { channels: shape.channels.min(3), ..shape },
            tccra: 0,
            tccrb: 0,
            timsk: 0,
            tifr: 0,
            assr: 0,
            temp: 0,
            icr: 0,
            channels: [CompareChannel::NEW; 3],
            effective_control: [0; 2],
            mode: TimerMode::from_wgm(shape.wide, 0),
            value: 0,
            down: false,
            match_blocked: false,
            clock: TimerClock::Stopped,
            edges_counted: 0,
            prescaler: Prescaler::new(0),
            pin: SamplePipe::default(),
            icp: CapturePin::default(),
            line_levels: [false; 2],
            asleep: None,
            listened_interrupts: 0,
            tosc: AsyncOscillator::NEW,
            cleared: 0,
            busy: 0,
            due: [NEVER; 5],
            tcnt_next: 0,
            strobe: 0,
            pending_flags: [NEVER; 3],
            stale_count: (0, 0),
            next_event: 0,
            next_flag: 0,
        }
    }

    /// Returns the shape of the timer.
    #[must_use]
    pub const fn shape(&self) -> &TimerShape {
        &self.shape
    }

    /// Replaces the prescaler from the edge `t` on, because GTCCR was written (17.4.1, 18.11.9), or because
    /// the I/O clock and with it the prescaler was stopped. On TOSC the divider counts as cleared if
    /// `prescaler` was cleared at `t` or is held.
    pub fn prescaler(&mut self, prescaler: Prescaler, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.prescaler = prescaler;
        if prescaler.is_held() || prescaler.tap(1).origin == t {
            self.cleared = self.tosc.index(t);
        }
        self.select_clock(t);
    }

    /// Sets the interrupts (bit `n` is interrupt `n`) whose flags send [`AvrSignal::Flag`] when they are set,
    /// even if disabled.
    pub fn set_listened_interrupts(&mut self, irqs: u8, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.listened_interrupts = self.shape.flags_of(irqs);
    }

    /// Sets the frequency of the crystal at TOSC1 and TOSC2 to `hz` Hz; the default is 32,768 Hz, and 0 means
    /// no crystal.
    pub fn crystal_hz(&mut self, hz: u64, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.tosc.set_hz(hz, t);
    }

    /// Stops the oscillator of the asynchronous timer at `t` (power-down, standby), or lets it continue.
    pub fn set_oscillator_running(&mut self, runs: bool, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.tosc.set_stopped(!runs, t);
    }

    /// Returns TIFR as it reads in cycle `t`, if this needs no computation. It is the fast path for polling
    /// programs.
    #[inline(always)]
    #[must_use]
    pub fn flags_if_quiet(&self, t: u64) -> Option<u8> {
        (t < self.quiet_until()).then_some(self.tifr)
    }

    /// Reports whether the timer runs on TOSC (AS2); then it continues in sleep.
    #[must_use]
    pub const fn is_asynchronous(&self) -> bool {
        self.assr & regs::AS2 != 0
    }

    /// Reports whether the timer can run on a crystal, but currently counts a clock of the chip.
    #[must_use]
    pub const fn runs_from_crystal(&self) -> bool {
        self.shape.asynchronous && !self.is_asynchronous() && self.effective_control[1] & 7 != 0
    }

    /// Reports whether ICR is TOP in the current mode; by the data sheet ICR can be written only then
    /// (16.11.7).
    #[must_use]
    pub fn icr_is_top(&self) -> bool {
        self.mode.top == TopSource::Icr
    }

    /// Executes what is due before a change at `t`, and discards the precomputed event times.
    fn on_setup_changed(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance_to(t, out);
        (self.next_event, self.next_flag) = (0, 0);
    }

    /// Returns the cycle before which no flag changes.
    #[inline(always)]
    fn quiet_until(&self) -> u64 {
        self.next_event.min(self.next_flag)
    }

    /// Returns a copy of the timer as it is at `t`.
    fn advanced_to(&self, t: u64) -> AvrTimer {
        let mut timer = self.clone();
        timer.advance_to(t, &mut Vec::new());
        timer
    }

    /// Sends the overrides of the output pins that have changed.
    fn drive_outputs(&mut self, t: u64, out: &mut AvrOutbox) {
        for (channel, line) in self.channels.iter_mut().zip(OUTPUT_LINES) {
            let drive = match channel.action {
                MatchAction::None => AvrDrive::Port,
                _ => AvrDrive::Value(channel.level),
            };
            if drive != channel.driven {
                channel.driven = drive;
                out.push(AvrSignal::Drive { t, line, drive });
            }
        }
    }

    /// Restarts the I/O clock at `t`.
    fn restart_after_sleep(&mut self, t: u64) {
        if let Some(since) = self.asleep.take() {
            for pipe in [&mut self.pin, &mut self.icp.pipe] {
                pipe.shift(t.saturating_sub(since));
            }
            self.pin.change(self.line_levels[0], t);
            self.icp.pipe.change(self.line_levels[1], t);
            let edge = self.tosc.index(t);
            self.due = [edge.saturating_add(2); 5];
            self.stale_count.1 = if self.is_asynchronous() { edge.saturating_add(1) } else { 0 };
        }
    }
}
