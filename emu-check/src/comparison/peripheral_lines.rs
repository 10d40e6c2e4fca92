//! Compares the peripherals of chip and evaluator: bytes in both directions, analog inputs, the PWM output,
//! EEPROM cells.

use std::collections::VecDeque;

use emu_core::pins::{CycleTime, PinLevel};
use ladder_eval::Evaluator;

use crate::chip::families::CheckedChip;
use crate::chip::program_places::ProgramPlaces;
use crate::chip::runner::ChipRunner;
use crate::chip::serial_line::{BYTE_BITS, ByteArrival, SerialFrame, plan_arrival};
use crate::comparison::lockstep::Mismatch;
use crate::report::check_report::DifferenceKind;
use crate::stimulus::generator::ScanStimulus;

/// A byte that the evaluator has sent, with the clocks between which its scan ran on the chip.
#[derive(Debug, Clone, Copy)]
struct AwaitedByte {
    byte: u8,
    earliest: u64,
    latest: u64,
    /// The number of that scan, from 1.
    scan: u64,
}

/// The data in flight between chip and checker. All times are clocks since power-up.
#[derive(Debug, Clone, Default)]
pub(crate) struct PeripheralLines {
    awaited: VecDeque<AwaitedByte>,
    /// A byte on its way to the chip: the scan (from 1) before which it is complete, and the byte.
    incoming: Option<(u64, u8)>,
    /// The end of the last byte that was sent.
    line_free_at: u64,
    /// Clocks of the longest scan, including the wait for its timer match.
    longest_scan_clocks: u64,
    /// Number of scans by which bytes to the chip are delayed beyond the earliest possible scan.
    pub delay_scans: u64,
    /// Bytes that the chip has sent, each with the scan that sent it.
    pub sent_bytes: VecDeque<(u64, u8)>,
}

impl PeripheralLines {
    /// Initial state: no data in flight. `worst_scan_cycles` is the length of the longest scan in machine
    /// cycles, as computed by the compiler.
    pub(crate) fn new(places: &ProgramPlaces, worst_scan_cycles: u64) -> PeripheralLines {
        let longest_scan_clocks = (worst_scan_cycles + places.pace.poll_cycles + places.pace.tick_cycles)
            .saturating_mul(places.pace.clocks_per_cycle);
        PeripheralLines { longest_scan_clocks, ..PeripheralLines::default() }
    }

    /// Returns true if a byte to the receiver can begin: none is in flight and none waits to be read.
    pub(crate) fn can_begin_byte(&self, eval: &Evaluator) -> bool {
        self.incoming.is_none() && !eval.has_received_byte()
    }

    /// At the end of a scan: applies the voltages for the next scan to the analog inputs, and starts a byte
    /// to the receiver if none is in flight and none waits to be read.
    pub(crate) fn prepare_scan<C: CheckedChip>(
        &mut self,
        runner: &mut ChipRunner<'_, C>,
        eval: &Evaluator,
        stimulus: &ScanStimulus,
    ) {
        let peripherals = &runner.places.peripherals;
        for (&(_, pin, reference), &value) in peripherals.analog.iter().zip(&stimulus.analog) {
            peripherals.drive_analog(&mut runner.cpu, (pin, reference), value);
        }
        let Some(byte) = stimulus.byte.filter(|_| self.can_begin_byte(eval)) else { return };
        if peripherals.receive.is_none() {
            return;
        }
        let now = peripherals.to_clock(CycleTime::at(runner.cpu.cycle() + 1));
        let next = runner.scans_started() + 1 + self.delay_scans;
        let starts = |scan: u64| runner.scan_start_cycle(scan).saturating_mul(peripherals.clocks_per_cycle);
        if let Some(ByteArrival { start, scan }) =
            plan_arrival(peripherals.bit_time, now, next, self.longest_scan_clocks, starts)
        {
            peripherals.queue_byte(&mut runner.cpu, start, byte);
            self.incoming = Some((scan, byte));
        }
    }

    /// At the start of a scan: gives the evaluator the byte that has arrived, then compares the PWM outputs
    /// and the EEPROM. Returns the number of values compared.
    pub(crate) fn begin_scan<C: CheckedChip>(
        &mut self,
        runner: &mut ChipRunner<'_, C>,
        eval: &mut Evaluator,
    ) -> Result<u64, Mismatch> {
        if let Some((_, byte)) = self.incoming.filter(|(scan, _)| *scan <= runner.scans_started()) {
            eval.receive(byte);
            self.incoming = None;
        }
        Ok(compare_pwm(runner)? + compare_eeprom(runner, eval)?)
    }

    /// At the start of a scan: chooses the byte that devices on the buses answer in it.
    pub(crate) fn choose_answer<C: CheckedChip>(&self, runner: &mut ChipRunner<'_, C>, eval: &mut Evaluator) {
        if let Some(devices) = runner.listener.as_mut().and_then(|listener| listener.buses.as_mut()) {
            devices.choose_answer(eval);
        }
    }

    /// At the start of a scan on the chip, after the evaluator has executed it: records what the evaluator
    /// sent and set.
    pub(crate) fn note_evaluated_scan<C: CheckedChip>(&mut self, runner: &mut ChipRunner<'_, C>, eval: &Evaluator) {
        let now = runner.clock();
        for &byte in eval.sent_bytes() {
            self.awaited.push_back(AwaitedByte { byte, earliest: now, latest: u64::MAX, scan: runner.scans_started() });
        }
        let longest_scan_clocks = self.longest_scan_clocks;
        let meters = runner.listener.iter_mut().flat_map(|listener| &mut listener.pwm);
        for ((_, meter), duty) in meters.zip(eval.pwm_duties()) {
            if meter.duty() != *duty {
                meter.set_duty(now + longest_scan_clocks, *duty);
            }
        }
    }

    /// At the end of a scan: compares the bytes on the serial line. Returns the number of values compared.
    pub(crate) fn compare_sent<C: CheckedChip>(&mut self, runner: &mut ChipRunner<'_, C>) -> Result<u64, Mismatch> {
        let (now, cycle) = (runner.clock(), runner.cpu.cycle());
        let bit = runner.places.peripherals.bit_time;
        let Some((pin, listener)) = runner.listener.as_mut().and_then(|listener| listener.serial.as_mut()) else {
            return Ok(0);
        };
        for last in self.awaited.iter_mut().rev().take_while(|last| last.latest == u64::MAX) {
            last.latest = now;
        }
        listener.advance_to(now);
        let difference =
            |expected: String, found: String| Err(Mismatch::of_text(DifferenceKind::Serial, cycle, expected, found));
        let mut compared = 1;
        while let Some(frame) = listener.take_frame() {
            let Some(awaited) = self.awaited.pop_front() else {
                return difference("nothing sent".to_owned(), frame_text(&frame));
            };
            // A transmitter starts a byte at its next bit time, or after the byte that is still on the line.
            let latest = awaited.latest.max(self.line_free_at).saturating_add(bit.half_bit_clocks(3));
            if frame.byte != awaited.byte || frame.fault.is_some() {
                return difference(byte_name(awaited.byte), frame_text(&frame));
            }
            if frame.start < awaited.earliest || frame.start > latest {
                let expected = format!("{} begun in clock {} to {latest}", byte_name(awaited.byte), awaited.earliest);
                return difference(expected, format!("begun in clock {}", frame.start));
            }
            self.line_free_at = frame.start + bit.bit_clocks(BYTE_BITS);
            self.sent_bytes.push_back((awaited.scan, frame.byte));
            compared += 1;
        }
        let pin = *pin;
        if let Some(began) = listener.current_start().filter(|_| self.awaited.is_empty()) {
            return difference("nothing sent".to_owned(), format!("a byte that begins in clock {began}"));
        }
        let late = |awaited: &AwaitedByte| {
            now > awaited.latest.max(self.line_free_at).saturating_add(bit.bit_clocks(BYTE_BITS + 2))
        };
        if let Some(awaited) = self.awaited.front().filter(|awaited| late(awaited)) {
            return difference(byte_name(awaited.byte), "nothing sent".to_owned());
        }
        if self.awaited.is_empty() && listener.current_start().is_none() && runner.cpu.pin_level(pin) != PinLevel::High
        {
            return difference("the line at rest, high".to_owned(), "low or floating".to_owned());
        }
        Ok(compared)
    }
}

/// At the end of a scan: compares the transfers on the buses. Returns the number of values compared.
pub(crate) fn compare_buses<C: CheckedChip>(runner: &mut ChipRunner<'_, C>, eval: &Evaluator) -> Result<u64, Mismatch> {
    let cycle = runner.cpu.cycle();
    let Some(devices) = runner.listener.as_mut().and_then(|listener| listener.buses.as_mut()) else { return Ok(0) };
    devices.compare(eval).map_err(|deviation| Mismatch::of_deviation(DifferenceKind::Bus, cycle, deviation))
}

/// Formats a byte that was sent for a message.
pub(crate) fn byte_name(byte: u8) -> String {
    let shown = if byte.is_ascii_graphic() { format!(" `{}`", char::from(byte)) } else { String::new() };
    format!("byte 0x{byte:02X}{shown} sent")
}

fn frame_text(frame: &SerialFrame) -> String {
    let fault = frame.fault.as_ref().map_or_else(String::new, |fault| format!(", {fault}"));
    format!("{} from clock {} on{fault}", byte_name(frame.byte), frame.start)
}

/// Compares the PWM output as measured.
fn compare_pwm<C: CheckedChip>(runner: &ChipRunner<'_, C>) -> Result<u64, Mismatch> {
    let meters = runner.listener.iter().flat_map(|listener| &listener.pwm);
    let mut compared = 0;
    for (_, meter) in meters {
        compared += meter
            .judge(runner.clock())
            .map_err(|deviation| Mismatch::of_deviation(DifferenceKind::Pwm, runner.cpu.cycle(), deviation))?;
    }
    Ok(compared)
}

/// Compares the cells of the EEPROM, once the evaluator's last write is complete.
fn compare_eeprom<C: CheckedChip>(runner: &ChipRunner<'_, C>, eval: &Evaluator) -> Result<u64, Mismatch> {
    // The busy count is decremented at the start of the scan.
    if eval.eeprom_busy_scans() > 1 {
        return Ok(0);
    }
    for (addr, &expected) in (0..).zip(eval.eeprom()) {
        let found = runner.cpu.peek("eeprom", addr);
        if found != Some(expected) {
            let found = found.map_or_else(|| "no cell".to_owned(), |found| format!("0x{found:02X}"));
            let expected = format!("0x{expected:02X} in cell {addr} of the EEPROM");
            return Err(Mismatch::of_text(DifferenceKind::Eeprom, runner.cpu.cycle(), expected, found));
        }
    }
    Ok(eval.eeprom().len() as u64)
}
