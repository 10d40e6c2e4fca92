//! A probe at the pins of the serial line and of the PWM output.

use emu_core::cpu::Probe;
use emu_core::pins::{Event, Level, PinId, Time};

use crate::peripherals::Peripherals;
use crate::pulse::Meter;
use crate::wire::Listener;

/// What listens at the pins.
#[derive(Debug, Clone)]
pub(crate) struct Tap {
    pub serial: Option<(PinId, Listener)>,
    pub pwm: Option<(PinId, Meter)>,
    clocks: u64,
}

impl Tap {
    /// A probe for a program; nothing where there is nothing to listen to.
    pub(crate) fn new(of: &Peripherals) -> Option<Tap> {
        let serial = of.transmit.map(|pin| (pin, Listener::new(of.bit, 2 * of.clocks)));
        let pwm = of.pwm.map(|(pin, wanted)| (pin, Meter::new(wanted)));
        (serial.is_some() || pwm.is_some()).then_some(Tap { serial, pwm, clocks: of.clocks })
    }
}

impl Probe for Tap {
    const EVENTS: bool = true;

    fn event(&mut self, event: Event) -> bool {
        if let Event::Edge { at: Time { cycle, phase }, pin, level } = event {
            let (clock, high) = (cycle * self.clocks + u64::from(phase), level == Level::High);
            match (&mut self.serial, &mut self.pwm) {
                (Some((line, listener)), _) if *line == pin => listener.edge(clock, high),
                (_, Some((output, meter))) if *output == pin => meter.edge(clock, high),
                _ => {}
            }
        }
        false
    }
}
