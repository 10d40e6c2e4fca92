//! A CCP module (DS33023 section 14; DS30292 and DS39582 section 8): what it does when the timers and its pin have done
//! something.

use crate::periph::Pic16Drive;

/// CCPxCON<3:0>. What the sheets call unused or reserved is off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CcpMode {
    /// 0000 to 0011.
    Off,
    /// 0100 to 0111.
    Capture(CaptureEdge),
    /// 1000 to 1011.
    Compare(MatchAction),
    /// 11xx.
    Pwm,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CaptureEdge {
    Falling,
    Rising,
    /// Every 4th rising one.
    Fourth,
    /// Every 16th rising one.
    Sixteenth,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MatchAction {
    Set,
    Clear,
    /// The flag only.
    Interrupt,
    /// Special event.
    Special,
}

/// The bits of CCPxCON that exist.
const CCPCON: u8 = 0x3F;

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct CcpModule {
    con: u8,
    /// CCPRxL.
    pub(super) low: u8,
    /// CCPRxH: in PWM mode the slave of CCPRxL.
    high: u8,
    /// In PWM mode the slave of CCPxCON<5:4>.
    two: u8,
    /// The output, where the mode has one.
    output: bool,
    /// Level of the pin.
    pin: bool,
    /// The prescaler of capture mode.
    edges: u8,
}

emu_core::state! { CcpModule { con, low, high, two, output, pin, edges } if |ccp, _now| ccp.edges <= 16 }

impl CcpModule {
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

    pub(super) fn con(&self) -> u8 {
        self.con
    }

    pub(super) fn high(&self) -> u8 {
        self.high
    }

    /// CCPRxH:CCPRxL.
    pub(super) fn ccpr(&self) -> u16 {
        u16::from_be_bytes([self.high, self.low])
    }

    /// The value of timer 1 that is compared with, if any is.
    pub(super) fn compare_value(&self) -> Option<u16> {
        matches!(self.mode(), CcpMode::Compare(_)).then(|| self.ccpr())
    }

    /// The next count of timer 1 from `value` resets it.
    pub(super) fn resets_timer1(&self, value: u16) -> bool {
        self.mode() == CcpMode::Compare(MatchAction::Special) && self.ccpr() == value
    }

    /// What it does to its line.
    pub(super) fn drive(&self) -> Pic16Drive {
        match self.mode() {
            CcpMode::Pwm | CcpMode::Compare(MatchAction::Set | MatchAction::Clear) => Pic16Drive::from_bit(self.output),
            _ => Pic16Drive::Port,
        }
    }

    /// The edge detector of capture mode: its input, by polarity, and its output, a rise of which captures. The prescaler
    /// ripples, so that it gives a rise when it comes round to 0.
    fn detector(&self, edge: CaptureEdge) -> (bool, bool) {
        let input = self.pin != (edge == CaptureEdge::Falling);
        match edge {
            CaptureEdge::Falling | CaptureEdge::Rising => (input, input),
            CaptureEdge::Fourth => (input, self.edges & 2 == 0),
            CaptureEdge::Sixteenth => (input, self.edges & 8 == 0),
        }
    }

    /// The pin or the mode has changed; before, the detector gave `was`. True if that captures.
    fn detect(&mut self, was: (bool, bool), edge: CaptureEdge) -> bool {
        if self.detector(edge).0 && !was.0 {
            self.edges = (self.edges + 1) % 16;
        }
        self.detector(edge).1 && !was.1
    }

    /// The level of the pin. True if that captures timer 1.
    pub(super) fn line(&mut self, high: bool) -> bool {
        let CcpMode::Capture(edge) = self.mode() else {
            self.pin = high;
            return false;
        };
        let was = self.detector(edge);
        self.pin = high;
        self.detect(was, edge)
    }

    /// A write to CCPxCON. True if that captures timer 1: from one capture mode to another it may (DS30292 section 8.1.3),
    /// from any other mode not.
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

    /// A write to CCPRxH, which PWM mode makes read-only.
    pub(super) fn write_high(&mut self, high: u8) {
        if self.mode() != CcpMode::Pwm {
            self.high = high;
        }
    }

    /// Takes timer 1.
    pub(super) fn capture(&mut self, value: u16) {
        [self.high, self.low] = value.to_be_bytes();
    }

    /// Timer 1 has become what it is compared with. True if it is the special event.
    pub(super) fn apply_match(&mut self) -> bool {
        match self.mode() {
            CcpMode::Compare(MatchAction::Set) => self.output = true,
            CcpMode::Compare(MatchAction::Clear) => self.output = false,
            _ => {}
        }
        self.mode() == CcpMode::Compare(MatchAction::Special)
    }

    /// The duty that is at work, in quarters of a count of timer 2, where a PWM output waits for it.
    pub(super) fn duty_count(&self) -> Option<u16> {
        (self.mode() == CcpMode::Pwm && self.output).then(|| u16::from(self.high) << 2 | u16::from(self.two))
    }

    /// A PWM output ends its pulse.
    pub(super) fn fall(&mut self) {
        self.output = false;
    }

    /// A period of timer 2 has ended: in PWM mode the duty is taken over, and a pulse begins unless it is 0.
    pub(super) fn start_period(&mut self) {
        if self.mode() == CcpMode::Pwm {
            (self.high, self.two) = (self.low, self.con >> 4 & 3);
            self.output = self.high | self.two != 0;
        }
    }

    /// A reset turns the module off, and leaves CCPRx; what it holds at power-on is unknown, and taken as 0.
    pub(super) fn reset(&mut self, power_on: bool) {
        let (low, high) = if power_on { (0, 0) } else { (self.low, self.high) };
        *self = CcpModule { low, high, pin: self.pin, ..CcpModule::default() };
    }
}
