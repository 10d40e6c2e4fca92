//! A CCP module (DS33023 section 14; DS30292 and DS39582 section 8): its reactions to the timers and to its
//! pin.

use crate::periph::Pic16Drive;

/// Mode by CCPxCON<3:0>. Values that the data sheets call unused or reserved are off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CcpMode {
    /// 0000 to 0011: the module is off.
    Off,
    /// 0100 to 0111: capture.
    Capture(CaptureEdge),
    /// 1000 to 1011: compare.
    Compare(MatchAction),
    /// 11xx: PWM.
    Pwm,
}

/// Edges of the pin that capture timer 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CaptureEdge {
    Falling,
    Rising,
    /// Every fourth rising edge.
    Fourth,
    /// Every sixteenth rising edge.
    Sixteenth,
}

/// Action of a compare match.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MatchAction {
    Set,
    Clear,
    /// Sets only the flag.
    Interrupt,
    /// Triggers the special event.
    Special,
}

/// Mask of the existing bits of CCPxCON.
const CCPCON: u8 = 0x3F;

/// A CCP module.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct CcpModule {
    con: u8,
    /// CCPRxL.
    pub(super) low: u8,
    /// CCPRxH; in PWM mode the buffered copy of CCPRxL.
    high: u8,
    /// In PWM mode the buffered copy of CCPxCON<5:4>.
    two: u8,
    /// Level of the output, in modes that have one.
    output: bool,
    /// Level of the pin.
    pin: bool,
    /// Prescaler of capture mode.
    edges: u8,
}

emu_core::state! { CcpModule { con, low, high, two, output, pin, edges } if |ccp, _now| ccp.edges <= 16 }

/// The state of the edge detector in capture mode.
#[derive(Debug, Clone, Copy)]
struct EdgeDetector {
    /// The input, by polarity.
    input: bool,
    /// The output behind the prescaler, whose rise captures.
    output: bool,
}

impl CcpModule {
    /// Returns the mode.
    pub(super) fn mode(&self) -> CcpMode {
        match self.con & 0xF {
            0..=3 => CcpMode::Off,
            4 => CcpMode::Capture(CaptureEdge::Falling),
            5 => CcpMode::Capture(CaptureEdge::Rising),
            6 => CcpMode::Capture(CaptureEdge::Fourth),
            7 => CcpMode::Capture(CaptureEdge::Sixteenth),
            8 => CcpMode::Compare(MatchAction::Set),
            9 => CcpMode::Compare(MatchAction::Clear),
            10 => CcpMode::Compare(MatchAction::Interrupt),
            11 => CcpMode::Compare(MatchAction::Special),
            _ => CcpMode::Pwm,
        }
    }

    /// Returns CCPxCON.
    pub(super) fn con(&self) -> u8 {
        self.con
    }

    /// Returns CCPRxH.
    pub(super) fn high(&self) -> u8 {
        self.high
    }

    /// Returns CCPRxH:CCPRxL.
    pub(super) fn ccpr(&self) -> u16 {
        u16::from_be_bytes([self.high, self.low])
    }

    /// Returns the value that is compared with timer 1, in compare mode.
    pub(super) fn compare_value(&self) -> Option<u16> {
        matches!(self.mode(), CcpMode::Compare(_)).then(|| self.ccpr())
    }

    /// Reports whether the next count of timer 1 from `value` resets it.
    pub(super) fn resets_timer1(&self, value: u16) -> bool {
        self.mode() == CcpMode::Compare(MatchAction::Special) && self.ccpr() == value
    }

    /// Returns the override of its line.
    pub(super) fn drive(&self) -> Pic16Drive {
        match self.mode() {
            CcpMode::Pwm | CcpMode::Compare(MatchAction::Set | MatchAction::Clear) => Pic16Drive::from_bit(self.output),
            _ => Pic16Drive::Port,
        }
    }

    /// Returns the state of the edge detector in capture mode: its input, by polarity, and its output, whose
    /// rise captures. The prescaler is a ripple counter, so its output rises when it wraps to 0.
    fn detector(&self, edge: CaptureEdge) -> EdgeDetector {
        let input = self.pin != (edge == CaptureEdge::Falling);
        match edge {
            CaptureEdge::Falling | CaptureEdge::Rising => EdgeDetector { input, output: input },
            CaptureEdge::Fourth => EdgeDetector { input, output: self.edges & 2 == 0 },
            CaptureEdge::Sixteenth => EdgeDetector { input, output: self.edges & 8 == 0 },
        }
    }

    /// Updates the detector after a change of the pin or the mode; `was` is its state before. Returns true if
    /// it captures.
    fn detect(&mut self, was: EdgeDetector, edge: CaptureEdge) -> bool {
        if self.detector(edge).input && !was.input {
            self.edges = (self.edges + 1) % 16;
        }
        self.detector(edge).output && !was.output
    }

    /// Sets the level of the pin. Returns true if it captures timer 1.
    pub(super) fn line(&mut self, high: bool) -> bool {
        let CcpMode::Capture(edge) = self.mode() else {
            self.pin = high;
            return false;
        };
        let was = self.detector(edge);
        self.pin = high;
        self.detect(was, edge)
    }

    /// Writes CCPxCON. Returns true if it captures timer 1: a change from one capture mode to another can do
    /// so (DS30292 section 8.1.3), a change from another mode cannot.
    pub(super) fn write_con(&mut self, con: u8) -> bool {
        let old = self.mode();
        let was = if let CcpMode::Capture(edge) = old { Some(self.detector(edge)) } else { None };
        self.con = con & CCPCON;
        let new = self.mode();
        if let CcpMode::Capture(edge) = new {
            return was.is_some_and(|was| self.detect(was, edge));
        }
        self.edges = 0;
        if new != old {
            self.output = new == CcpMode::Compare(MatchAction::Clear);
        }
        false
    }

    /// Writes CCPRxH, which is read-only in PWM mode.
    pub(super) fn write_high(&mut self, high: u8) {
        if self.mode() != CcpMode::Pwm {
            self.high = high;
        }
    }

    /// Captures the value of timer 1.
    pub(super) fn capture(&mut self, value: u16) {
        [self.high, self.low] = value.to_be_bytes();
    }

    /// Handles a compare match with timer 1. Returns true for the special event.
    pub(super) fn apply_match(&mut self) -> bool {
        match self.mode() {
            CcpMode::Compare(MatchAction::Set) => self.output = true,
            CcpMode::Compare(MatchAction::Clear) => self.output = false,
            _ => {}
        }
        self.mode() == CcpMode::Compare(MatchAction::Special)
    }

    /// Returns the current duty in quarters of a count of timer 2, if a PWM output is high until then.
    pub(super) fn duty_count(&self) -> Option<u16> {
        (self.mode() == CcpMode::Pwm && self.output).then(|| u16::from(self.high) << 2 | u16::from(self.two))
    }

    /// Ends the pulse of a PWM output.
    pub(super) fn fall(&mut self) {
        self.output = false;
    }

    /// Handles the end of a timer 2 period: in PWM mode the new duty takes effect, and a pulse starts unless
    /// the duty is 0.
    pub(super) fn start_period(&mut self) {
        if self.mode() == CcpMode::Pwm {
            (self.high, self.two) = (self.low, self.con >> 4 & 3);
            self.output = self.high | self.two != 0;
        }
    }

    /// Resets the module to off. CCPRx keeps its value; after power-on it is unknown, and 0 here.
    pub(super) fn reset(&mut self, power_on: bool) {
        let (low, high) = if power_on { (0, 0) } else { (self.low, self.high) };
        *self = CcpModule { low, high, pin: self.pin, ..CcpModule::default() };
    }
}
