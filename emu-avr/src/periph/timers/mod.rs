//! The timer/counters (sections 15 to 18): counter, compare units and their pins, input capture, asynchronous operation.
//!
//! Between two special edges of its clock (one that moves a pin, updates a buffered OCR, or is the first after a write of TCNT)
//! a counter is a closed form, [`orbit`]. Special edges are done one at a time by [`count`], the flags of the others are worked
//! out when they are looked at.

mod count;
mod device;
mod mode;
mod orbit;
mod pins;
mod plan;
mod regs;
mod shape;
mod state;
mod tosc;

pub use shape::{
    CAPT16, COMPA8, COMPA16, COMPB8, COMPB16, COMPC16, ICF, OCFA, OCFB, OCFC, OVF8, OVF16, OVF16C, Reg, Shape, TOV, Tap,
};

use emu_core::NEVER;
use emu_core::parts::prescaler::{Prescaler, Ticks};

use super::{Drive, Line, Outbox, Signal};
use mode::{Action, Mode, Top};
use pins::{Icp, Pipe};
use tosc::Tosc;

/// The pins of the channels.
const OC: [Line; 3] = [Line::OcA, Line::OcB, Line::OcC];

/// An output compare channel.
#[derive(Debug, Clone, Copy)]
struct Channel {
    /// OCR as it reads: of the asynchronous timer its temporary register (18.9).
    written: u16,
    /// The buffer register of the PWM modes.
    buffer: u16,
    /// What is compared with the counter.
    compare: u16,
    /// What a match does.
    action: Action,
    /// The OC register, which is not the pin.
    level: bool,
    shown: Drive,
}

impl Channel {
    const NEW: Channel =
        Channel { written: 0, buffer: 0, compare: 0, action: Action::None, level: false, shown: Drive::Port };
}

/// What the timer counts.
#[derive(Debug, Clone, Copy)]
enum Clock {
    Stopped,
    /// The I/O clock, divided.
    Io(Ticks),
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
pub struct Timer {
    shape: Shape,
    tccra: u8,
    tccrb: u8,
    timsk: u8,
    tifr: u8,
    assr: u8,
    temp: u8,
    icr: u16,
    channels: [Channel; 3],
    /// TCCRA and TCCRB as they act: of the asynchronous timer later than they read.
    acting: [u8; 2],
    mode: Mode,
    value: u16,
    down: bool,
    /// TCNT was written: the next timer clock sees no compare match (15.5.2).
    blocked: bool,
    clock: Clock,
    /// Edges of `clock` that are counted in `value`.
    done: u64,
    prescaler: Prescaler,
    pin: Pipe,
    icp: Icp,
    /// The lines T and ICP as they are, whether they are sampled or not.
    raw: [bool; 2],
    asleep: Option<u64>,
    listened: u8,
    tosc: Tosc,
    /// The edge of TOSC1 at which the divider of the asynchronous timer was cleared.
    cleared: u64,
    /// Busy bits as in ASSR, and the edges of TOSC1 at which the temporary registers are latched.
    busy: u8,
    due: [u64; 5],
    tcnt_next: u16,
    strobe: u8,
    /// Asynchronous timer: flags TOV, OCFA, OCFB that are on their way, and when they come.
    late: [u64; 3],
    /// TCNT as it reads up to this edge of TOSC1 after sleep.
    stale: (u16, u64),
    /// Before this cycle nothing happens but counting; 0 where that has to be found out.
    quiet: u64,
    /// Before this cycle no flag is set; the same.
    calm: u64,
}

impl Timer {
    /// A timer after power-on, its prescaler starting from zero at cycle 0.
    #[must_use]
    pub fn new(shape: Shape) -> Timer {
        Timer {
            shape: Shape { channels: shape.channels.min(3), ..shape },
            tccra: 0,
            tccrb: 0,
            timsk: 0,
            tifr: 0,
            assr: 0,
            temp: 0,
            icr: 0,
            channels: [Channel::NEW; 3],
            acting: [0; 2],
            mode: Mode::of(shape.wide, 0),
            value: 0,
            down: false,
            blocked: false,
            clock: Clock::Stopped,
            done: 0,
            prescaler: Prescaler::new(0),
            pin: Pipe::default(),
            icp: Icp::default(),
            raw: [false; 2],
            asleep: None,
            listened: 0,
            tosc: Tosc::NEW,
            cleared: 0,
            busy: 0,
            due: [NEVER; 5],
            tcnt_next: 0,
            strobe: 0,
            late: [NEVER; 3],
            stale: (0, 0),
            quiet: 0,
            calm: 0,
        }
    }

    /// The sort of the timer.
    #[must_use]
    pub const fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The divider before the timer is `prescaler` from the edge `t` on: GTCCR was written (17.4.1, 18.11.9), or the I/O clock
    /// has stood and the divider with it. On TOSC, it counts as cleared if it was cleared at `t` or is held.
    pub fn prescaler(&mut self, prescaler: Prescaler, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.prescaler = prescaler;
        if prescaler.held() || prescaler.tap(1).origin == t {
            self.cleared = self.tosc.index(t);
        }
        self.select(t);
    }

    /// Interrupts (bit `n` is the interrupt `n`) whose flags give [`Signal::Flag`] when they are set, enabled or not.
    pub fn listen(&mut self, irqs: u8, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.listened = self.shape.flags_of(irqs);
    }

    /// The crystal at TOSC1 and TOSC2 has `hz`; at first it is 32,768 Hz. 0 is none.
    pub fn crystal_hz(&mut self, hz: u64, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.tosc.set_hz(hz, t);
    }

    /// The oscillator of the asynchronous timer stops at `t` (power-down, standby) or goes on where it stood.
    pub fn oscillator(&mut self, runs: bool, t: u64, out: &mut Outbox) {
        self.change(t, out);
        self.tosc.set_stopped(!runs, t);
    }

    /// TIFR as it reads in cycle `t`, where that needs no reckoning: what a polling program asks again and again.
    #[inline(always)]
    #[must_use]
    pub fn calm_flags(&self, t: u64) -> Option<u8> {
        (t < self.still()).then_some(self.tifr)
    }

    /// The timer runs on TOSC (AS2): it goes on in sleep.
    #[must_use]
    pub const fn asynchronous(&self) -> bool {
        self.assr & regs::AS2 != 0
    }

    /// It can hang on a crystal but counts a clock of the chip's.
    #[must_use]
    pub const fn counts_for_itself(&self) -> bool {
        self.shape.asynchronous && !self.asynchronous() && self.acting[1] & 7 != 0
    }

    /// ICR is TOP in the mode of now: only then, says the sheet, can ICR be written (16.11.7).
    #[must_use]
    pub fn icr_is_top(&self) -> bool {
        self.mode.top == Top::Icr
    }

    /// Does what is due, before something is changed at `t`.
    fn change(&mut self, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        (self.quiet, self.calm) = (0, 0);
    }

    /// Before this cycle the flags stay as they are.
    #[inline(always)]
    fn still(&self) -> u64 {
        self.quiet.min(self.calm)
    }

    /// The timer as it is at `t`, for a look at it.
    fn at(&self, t: u64) -> Timer {
        let mut timer = self.clone();
        timer.advance(t, &mut Vec::new());
        timer
    }

    /// What goes out to the pins has changed, perhaps.
    fn show(&mut self, t: u64, out: &mut Outbox) {
        for (channel, line) in self.channels.iter_mut().zip(OC) {
            let drive = match channel.action {
                Action::None => Drive::Port,
                _ => Drive::Value(channel.level),
            };
            if drive != channel.shown {
                channel.shown = drive;
                out.push(Signal::Drive { t, line, drive });
            }
        }
    }

    /// Lets the I/O clock run again at `t`.
    fn resume(&mut self, t: u64) {
        if let Some(since) = self.asleep.take() {
            for pipe in [&mut self.pin, &mut self.icp.pipe] {
                pipe.shift(t.saturating_sub(since));
            }
            self.pin.change(self.raw[0], t);
            self.icp.pipe.change(self.raw[1], t);
            let edge = self.tosc.index(t);
            self.due = [edge.saturating_add(2); 5];
            self.stale.1 = if self.asynchronous() { edge.saturating_add(1) } else { 0 };
        }
    }
}
