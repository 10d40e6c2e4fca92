//! A probe that observes the pins of the serial line, of the PWM output and of the buses.

use emu_core::cpu::Probe;
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use crate::chip::bus_devices::BusDevices;
use crate::chip::peripherals::CheckedPeripherals;
use crate::chip::pwm_meter::PwmMeter;
use crate::chip::serial_line::SerialListener;

/// The probe: a listener per observed pin.
#[derive(Debug, Clone)]
pub(crate) struct PinListener {
    /// The transmitter's pin with its receiver.
    pub serial: Option<(PinId, SerialListener)>,
    /// The pins of the PWM outputs with their meters.
    pub pwm: Vec<(PinId, PwmMeter)>,
    /// The devices on the buses.
    pub buses: Option<BusDevices>,
    clocks: u64,
}

impl PinListener {
    /// The probe for a program; `None` if there is nothing to observe.
    pub(crate) fn new(of: &CheckedPeripherals) -> Option<PinListener> {
        let serial = of.transmit.map(|pin| (pin, SerialListener::new(of.bit_time, 2 * of.clocks_per_cycle)));
        let pwm: Vec<_> = of.pwm.iter().map(|&(pin, wanted)| (pin, PwmMeter::new(wanted))).collect();
        let buses = BusDevices::new(of.buses);
        (serial.is_some() || !pwm.is_empty() || buses.is_some()).then_some(PinListener {
            serial,
            pwm,
            buses,
            clocks: of.clocks_per_cycle,
        })
    }
}

impl Probe for PinListener {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Edge { at: CycleTime { cycle, phase }, pin, level } = event {
            let (clock, high) = (cycle * self.clocks + u64::from(phase), level == PinLevel::High);
            if let Some((_, listener)) = self.serial.as_mut().filter(|(line, _)| *line == pin) {
                listener.note_edge(clock, high);
            }
            for (_, meter) in self.pwm.iter_mut().filter(|(output, _)| *output == pin) {
                meter.note_edge(clock, high);
            }
            if let Some(buses) = &mut self.buses {
                buses.note_edge(pin, high);
                return buses.drive.is_some();
            }
        }
        false
    }
}
