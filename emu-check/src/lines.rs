//! Peripherals of chip and evaluator side by side: bytes both ways, analog inputs, the PWM output, cells of the EEPROM.

use std::collections::VecDeque;

use emu_core::pins::{Level, Time};
use ladder_eval::Evaluator;

use crate::family::Target;
use crate::lockstep::Mismatch;
use crate::places::Places;
use crate::report::What;
use crate::rig::Rig;
use crate::stimulus::Step;
use crate::wire::{Arrival, BITS, Frame, arrival};

/// A byte that the evaluator has sent, and the clocks between which its scan ran on the chip.
#[derive(Debug, Clone, Copy)]
struct Awaited {
    byte: u8,
    from: u64,
    to: u64,
    /// That scan, from 1.
    scan: u64,
}

/// What is on its way. All times are clocks since power-up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lines {
    awaited: VecDeque<Awaited>,
    /// A byte that arrives, and the scan (from 1) before which it has.
    incoming: Option<(u64, u8)>,
    /// When the last byte that was sent is over.
    over: u64,
    /// Clocks of the longest scan, with the wait for its match.
    busy: u64,
    /// Scans by which bytes arrive later than they could.
    pub delay: u64,
    /// Bytes that the chip has sent, each with the scan that did.
    pub heard: VecDeque<(u64, u8)>,
}

impl Lines {
    /// Nothing is on its way. `busy`: machine cycles of the longest scan, by the compiler's reckoning.
    pub(crate) fn new(places: &Places, busy: u64) -> Lines {
        let busy = (busy + places.pace.poll + places.pace.tick).saturating_mul(places.pace.clocks);
        Lines { busy, ..Lines::default() }
    }

    /// A byte can begin on its way to the receiver.
    pub(crate) fn free(&self, eval: &Evaluator) -> bool {
        self.incoming.is_none() && !eval.waiting()
    }

    /// At the end of a scan: puts voltages for the next on analog inputs, and begins a byte to the receiver where none is under way
    /// and none waits.
    pub(crate) fn prepare<C: Target>(&mut self, rig: &mut Rig<'_, C>, eval: &Evaluator, step: &Step) {
        let peripherals = &rig.places.peripherals;
        for (&(_, pin), &value) in peripherals.analog.iter().zip(&step.analog) {
            peripherals.put(&mut rig.cpu, pin, value);
        }
        let Some(byte) = step.byte.filter(|_| self.free(eval)) else { return };
        if peripherals.receive.is_none() {
            return;
        }
        let now = peripherals.clock(Time::at(rig.cpu.cycle() + 1));
        let next = rig.started() + 1 + self.delay;
        let starts = |scan: u64| rig.starts(scan).saturating_mul(peripherals.clocks);
        if let Some(Arrival { start, scan }) = arrival(peripherals.bit, now, next, self.busy, starts) {
            peripherals.send(&mut rig.cpu, start, byte);
            self.incoming = Some((scan, byte));
        }
    }

    /// At the start of a scan: what has arrived is there for the evaluator, and the PWM output is as it should be. Gives the values compared.
    pub(crate) fn arrive<C: Target>(&mut self, rig: &mut Rig<'_, C>, eval: &mut Evaluator) -> Result<u64, Mismatch> {
        if let Some((_, byte)) = self.incoming.filter(|(scan, _)| *scan <= rig.started()) {
            eval.receive(byte);
            self.incoming = None;
        }
        Ok(pulses(rig)? + cells(rig, eval)?)
    }

    /// The evaluator has run the scan that begins on the chip.
    pub(crate) fn evaluated<C: Target>(&mut self, rig: &mut Rig<'_, C>, eval: &Evaluator) {
        let now = rig.clock();
        if let Some(byte) = eval.sent() {
            self.awaited.push_back(Awaited { byte, from: now, to: u64::MAX, scan: rig.started() });
        }
        let busy = self.busy;
        if let Some((_, meter)) = rig.tap.as_mut().and_then(|tap| tap.pwm.as_mut())
            && meter.duty() != eval.pwm()
        {
            meter.set(now + busy, eval.pwm());
        }
    }

    /// At the end of a scan: the bytes that were on the line. Gives the values compared.
    pub(crate) fn sent<C: Target>(&mut self, rig: &mut Rig<'_, C>) -> Result<u64, Mismatch> {
        let (now, cycle) = (rig.clock(), rig.cpu.cycle());
        let bit = rig.places.peripherals.bit;
        let Some((pin, listener)) = rig.tap.as_mut().and_then(|tap| tap.serial.as_mut()) else { return Ok(0) };
        if let Some(last) = self.awaited.back_mut().filter(|last| last.to == u64::MAX) {
            last.to = now;
        }
        listener.pass(now);
        let differs = |expected: String, found: String| Err(Mismatch::words(What::Serial, cycle, expected, found));
        let mut compared = 1;
        while let Some(frame) = listener.take() {
            let Some(awaited) = self.awaited.pop_front() else {
                return differs("nothing sent".to_owned(), text(&frame));
            };
            // A transmitter begins with its next bit, and where a byte is still on the line behind that.
            let latest = awaited.to.max(self.over).saturating_add(bit.halves(3));
            if frame.byte != awaited.byte || frame.fault.is_some() {
                return differs(named(awaited.byte), text(&frame));
            }
            if frame.start < awaited.from || frame.start > latest {
                let expected = format!("{} begun in clock {} to {latest}", named(awaited.byte), awaited.from);
                return differs(expected, format!("begun in clock {}", frame.start));
            }
            self.over = frame.start + bit.times(BITS);
            self.heard.push_back((awaited.scan, frame.byte));
            compared += 1;
        }
        let pin = *pin;
        if let Some(began) = listener.began().filter(|_| self.awaited.is_empty()) {
            return differs("nothing sent".to_owned(), format!("a byte that begins in clock {began}"));
        }
        let late = |awaited: &Awaited| now > awaited.to.max(self.over).saturating_add(bit.times(BITS + 2));
        if let Some(awaited) = self.awaited.front().filter(|awaited| late(awaited)) {
            return differs(named(awaited.byte), "nothing sent".to_owned());
        }
        if self.awaited.is_empty() && listener.began().is_none() && rig.cpu.level(pin) != Level::High {
            return differs("the line at rest, high".to_owned(), "low or floating".to_owned());
        }
        Ok(compared)
    }
}

fn named(byte: u8) -> String {
    let shown = if byte.is_ascii_graphic() { format!(" `{}`", char::from(byte)) } else { String::new() };
    format!("byte 0x{byte:02X}{shown} sent")
}

fn text(frame: &Frame) -> String {
    let fault = frame.fault.as_ref().map_or_else(String::new, |fault| format!(", {fault}"));
    format!("{} from clock {} on{fault}", named(frame.byte), frame.start)
}

/// The PWM output by its meter.
fn pulses<C: Target>(rig: &Rig<'_, C>) -> Result<u64, Mismatch> {
    let Some((_, meter)) = rig.tap.as_ref().and_then(|tap| tap.pwm.as_ref()) else { return Ok(0) };
    meter.judge(rig.clock()).map_err(|(expected, found)| Mismatch::words(What::Pwm, rig.cpu.cycle(), expected, found))
}

/// The cells of the EEPROM, once the evaluator's last write has had its time.
fn cells<C: Target>(rig: &Rig<'_, C>, eval: &Evaluator) -> Result<u64, Mismatch> {
    // It is counted down as the scan begins.
    if eval.eeprom_busy() > 1 {
        return Ok(0);
    }
    for (addr, &expected) in (0..).zip(eval.eeprom()) {
        let found = rig.cpu.peek("eeprom", addr);
        if found != Some(expected) {
            let found = found.map_or_else(|| "no cell".to_owned(), |found| format!("0x{found:02X}"));
            let expected = format!("0x{expected:02X} in cell {addr} of the EEPROM");
            return Err(Mismatch::words(What::Eeprom, rig.cpu.cycle(), expected, found));
        }
    }
    Ok(eval.eeprom().len() as u64)
}
