//! The timer/counters (sections 15 to 18): counter, compare units and their pins, input capture, asynchronous operation.
//!
//! Between two special edges of its clock (one that moves a pin, updates a buffered OCR, or is the first after a write of TCNT)
//! a counter is a closed form, [`counting_cycle`]. Special edges are done one at a time by [`count`], the flags of the others are worked
//! out when they are looked at.

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

/// The pins of the channels.
const OUTPUT_LINES: [AvrLine; 3] = [AvrLine::OcA, AvrLine::OcB, AvrLine::OcC];

/// An output compare channel.
#[derive(Debug, Clone, Copy)]
struct CompareChannel {
    /// OCR as it reads: of the asynchronous timer its temporary register (18.9).
    written: u16,
    /// The buffer register of the PWM modes.
    buffer: u16,
    /// What is compared with the counter.
    compare: u16,
    /// What a match does.
    action: MatchAction,
    /// The OC register, which is not the pin.
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

/// What the timer counts.
#[derive(Debug, Clone, Copy)]
enum TimerClock {
    Stopped,
    /// The I/O clock, divided.
    Io(TickSeries),
    /// TOSC1, divided by `div` since the edge `base`.
    Tosc {
        div: u64,
        base: u64,
    },
    /// Edges of T.
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
    /// TCCRA and TCCRB as they act: of the asynchronous timer later than they read.
    effective_control: [u8; 2],
    mode: TimerMode,
    value: u16,
    down: bool,
    /// TCNT was written: the next timer clock sees no compare match (15.5.2).
    match_blocked: bool,
    clock: TimerClock,
    /// Edges of `clock` that are counted in `value`.
    edges_counted: u64,
    prescaler: Prescaler,
    pin: SamplePipe,
    icp: CapturePin,
    /// The lines T and ICP as they are, whether they are sampled or not.
    line_levels: [bool; 2],
    asleep: Option<u64>,
    listened_interrupts: u8,
    tosc: AsyncOscillator,
    /// The edge of TOSC1 at which the divider of the asynchronous timer was cleared.
    cleared: u64,
    /// Busy bits as in ASSR, and the edges of TOSC1 at which the temporary registers are latched.
    busy: u8,
    due: [u64; 5],
    tcnt_next: u16,
    strobe: u8,
    /// Asynchronous timer: flags TOV, OCFA, OCFB that are on their way, and when they come.
    pending_flags: [u64; 3],
    /// TCNT as it reads up to this edge of TOSC1 after sleep.
    stale_count: (u16, u64),
    /// Before this cycle nothing happens but counting; 0 where that has to be found out.
    next_event: u64,
    /// Before this cycle no flag is set; the same.
    next_flag: u64,
}

impl AvrTimer {
    /// A timer after power-on, its prescaler starting from zero at cycle 0.
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

    /// The sort of the timer.
    #[must_use]
    pub const fn shape(&self) -> &TimerShape {
        &self.shape
    }

    /// The divider before the timer is `prescaler` from the edge `t` on: GTCCR was written (17.4.1, 18.11.9), or the I/O clock
    /// has stood and the divider with it. On TOSC, it counts as cleared if it was cleared at `t` or is held.
    pub fn prescaler(&mut self, prescaler: Prescaler, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.prescaler = prescaler;
        if prescaler.is_held() || prescaler.tap(1).origin == t {
            self.cleared = self.tosc.index(t);
        }
        self.select_clock(t);
    }

    /// Interrupts (bit `n` is the interrupt `n`) whose flags give [`AvrSignal::Flag`] when they are set, enabled or not.
    pub fn set_listened_interrupts(&mut self, irqs: u8, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.listened_interrupts = self.shape.flags_of(irqs);
    }

    /// The crystal at TOSC1 and TOSC2 has `hz`; at first it is 32,768 Hz. 0 is none.
    pub fn crystal_hz(&mut self, hz: u64, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.tosc.set_hz(hz, t);
    }

    /// The oscillator of the asynchronous timer stops at `t` (power-down, standby) or goes on where it stood.
    pub fn set_oscillator_running(&mut self, runs: bool, t: u64, out: &mut AvrOutbox) {
        self.on_setup_changed(t, out);
        self.tosc.set_stopped(!runs, t);
    }

    /// TIFR as it reads in cycle `t`, where that needs no reckoning: what a polling program asks again and again.
    #[inline(always)]
    #[must_use]
    pub fn flags_if_quiet(&self, t: u64) -> Option<u8> {
        (t < self.quiet_until()).then_some(self.tifr)
    }

    /// The timer runs on TOSC (AS2): it goes on in sleep.
    #[must_use]
    pub const fn is_asynchronous(&self) -> bool {
        self.assr & regs::AS2 != 0
    }

    /// It can hang on a crystal but counts a clock of the chip's.
    #[must_use]
    pub const fn runs_from_crystal(&self) -> bool {
        self.shape.asynchronous && !self.is_asynchronous() && self.effective_control[1] & 7 != 0
    }

    /// ICR is TOP in the mode of now: only then, says the sheet, can ICR be written (16.11.7).
    #[must_use]
    pub fn icr_is_top(&self) -> bool {
        self.mode.top == TopSource::Icr
    }

    /// Does what is due, before something is changed at `t`.
    fn on_setup_changed(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance_to(t, out);
        (self.next_event, self.next_flag) = (0, 0);
    }

    /// Before this cycle the flags stay as they are.
    #[inline(always)]
    fn quiet_until(&self) -> u64 {
        self.next_event.min(self.next_flag)
    }

    /// The timer as it is at `t`, for a look at it.
    fn advanced_to(&self, t: u64) -> AvrTimer {
        let mut timer = self.clone();
        timer.advance_to(t, &mut Vec::new());
        timer
    }

    /// What goes out to the pins has changed, perhaps.
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

    /// Lets the I/O clock run again at `t`.
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
