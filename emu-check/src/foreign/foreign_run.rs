//! Runs a foreign image and the evaluator in lockstep, from one wait for the timer to the next.

use std::collections::VecDeque;

use emu_core::cpu::StopReason;
use emu_core::pins::{CycleTime, PinLevel};
use ladder_eval::Evaluator;

use crate::chip::deviation::Deviation;
use crate::chip::families::{CheckedChip, HighDrive, PullUpKind, pin_behaviour};
use crate::chip::pin_behaviour::level_text;
use crate::chip::serial_line::{ByteArrival, SerialFrame, plan_arrival};
use crate::comparison::lockstep::describe_error;
use crate::comparison::peripheral_lines::byte_name;
use crate::coverage::goals::EvaluatedScan;
use crate::report::check_report::DifferenceKind;
use crate::stimulus::generator::ScanStimulus;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

use super::codes;
use super::foreign_board::ForeignBoard;
use super::line_listener::LineListener;
use super::scan_loop::ScanLoop;
use super::{ForeignFinding, ForeignMismatch};

/// Machine cycles allowed from reset to the first scan, in addition to [`MAX_PERIODS`] periods.
const MAX_RESET_CYCLES: u64 = 200_000;

/// Periods allowed from one point of a scan to the next.
const MAX_PERIODS: u64 = 3;

/// The scan starts of a run, in machine cycles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ScanStarts {
    /// Start of the first scan.
    pub first: u64,
    /// Start of the last scan.
    pub last: u64,
    /// Number of scans that have started.
    pub scans: u64,
}

/// Chip and evaluator in one run from reset.
pub(crate) struct ForeignRun<'a, C> {
    cpu: C,
    /// The evaluator, in its state after the last scan.
    pub eval: Evaluator,
    board: &'a ForeignBoard,
    stimulus_symbols: &'a StimulusSymbols,
    scan_loop: ScanLoop,
    listener: LineListener,
    /// The scan starts of this run.
    pub starts: ScanStarts,
    /// Bytes that the evaluator has sent and the line has not shown yet, each with its scan.
    awaited: VecDeque<(u64, u8)>,
    /// Bytes that the line has shown and the evaluator has not sent yet, each with its scan.
    received_frames: VecDeque<(u64, SerialFrame)>,
    sent: bool,
    incoming: Option<(u64, u8)>,
    /// Maximum machine cycles of a scan so far.
    pub longest_scan: u64,
    /// Number of values compared since the caller has last taken it.
    pub compared: u64,
    /// Findings since the caller has last taken them.
    pub findings: Vec<ForeignFinding>,
}

impl<'a, C: CheckedChip> ForeignRun<'a, C> {
    /// Starts both sides at power-up. EEPROM cells that the image does not fill are erased.
    pub(super) fn start(
        mut cpu: C,
        eval: &Evaluator,
        board: &'a ForeignBoard,
        stimulus_symbols: &'a StimulusSymbols,
        scan_loop: ScanLoop,
    ) -> Self {
        let mut eval = eval.clone();
        for addr in 0..board.peripherals.eeprom_cells {
            eval.set_eeprom(addr as usize, cpu.peek("eeprom", addr).unwrap_or(0xFF));
        }
        wire_board(&mut cpu, board);
        cpu.set_breakpoint(scan_loop.start, true);
        ForeignRun {
            cpu,
            eval,
            board,
            stimulus_symbols,
            scan_loop,
            listener: LineListener::new(board),
            starts: ScanStarts::default(),
            awaited: VecDeque::new(),
            received_frames: VecDeque::new(),
            sent: false,
            incoming: None,
            longest_scan: 0,
            compared: 0,
            findings: Vec::new(),
        }
    }

    /// Machine cycles since power-up.
    pub(super) fn cycle(&self) -> u64 {
        self.cpu.cycle()
    }

    /// Applies the external inputs of the next scan while the chip waits, then runs that scan on both sides
    /// until the chip waits again, and compares them.
    pub(super) fn scan(&mut self, stimulus: &ScanStimulus) -> Result<EvaluatedScan, ForeignMismatch> {
        self.apply_external(stimulus);
        let extra = if self.starts.scans == 0 { MAX_RESET_CYCLES } else { 0 };
        self.run_to(self.scan_loop.start, extra, "the start of the scan")?;
        let at = self.cpu.cycle();
        if self.starts.scans == 0 {
            self.starts.first = at;
            self.check_power_up();
        }
        self.starts.scans += 1;
        self.starts.last = at;
        self.compare_pins()?;
        if let Some((_, byte)) = self.incoming.filter(|(scan, _)| *scan <= self.starts.scans) {
            self.eval.receive(byte);
            self.incoming = None;
        }
        stimulus.apply(self.stimulus_symbols, &mut self.eval);
        if let Some(devices) = &mut self.listener.buses {
            devices.choose_answer(&mut self.eval);
        }
        let evaluated = EvaluatedScan::run(&mut self.eval);
        for &byte in self.eval.sent_bytes() {
            self.sent = true;
            self.awaited.push_back((self.starts.scans, byte));
        }
        self.cpu.set_breakpoint(self.scan_loop.wait, true);
        let run_end = self.run_to(self.scan_loop.wait, 0, "the end of the scan");
        self.cpu.set_breakpoint(self.scan_loop.wait, false);
        run_end?;
        self.longest_scan = self.longest_scan.max(self.cpu.cycle() - at);
        self.compare_pins()?;
        self.compare_symbols()?;
        self.compare_lines()?;
        Ok(evaluated)
    }

    /// Drives the inputs, and starts a byte to the receiver.
    fn apply_external(&mut self, stimulus: &ScanStimulus) {
        let peripherals = &self.board.peripherals;
        let now = CycleTime::at(self.cpu.cycle());
        for (&pin, &level) in self.board.inputs.iter().zip(&stimulus.inputs) {
            self.cpu.drive(now, pin, PinLevel::from_bit(level));
        }
        for (&(_, pin, reference), &value) in peripherals.analog.iter().zip(&stimulus.analog) {
            peripherals.drive_analog(&mut self.cpu, (pin, reference), value);
        }
        let Some(byte) = stimulus.byte.filter(|_| self.incoming.is_none() && !self.eval.has_received_byte()) else {
            return;
        };
        let scans = self.starts.scans;
        if peripherals.receive.is_none() || scans == 0 {
            return;
        }
        let (last, period, poll_gap) = (self.starts.last, self.scan_loop.period, self.scan_loop.max_read_gap);
        let starts = |scan: u64| {
            let ahead = scan.saturating_sub(scans).saturating_mul(period);
            // Each start may be earlier or later by up to the gap between two polls.
            let at = last.saturating_sub(scans.saturating_sub(scan).saturating_mul(period)).saturating_add(ahead);
            at.saturating_sub(poll_gap) * peripherals.clocks_per_cycle
        };
        // A scan may take longer than those observed so far.
        let max_scan_clocks =
            (self.longest_scan + self.longest_scan / 2 + 20 + 2 * poll_gap) * peripherals.clocks_per_cycle;
        let clock = peripherals.to_clock(CycleTime::at(self.cpu.cycle() + 1));
        if let Some(ByteArrival { start, scan }) =
            plan_arrival(peripherals.bit_time, clock, scans + 1, max_scan_clocks, starts)
        {
            peripherals.queue_byte(&mut self.cpu, start, byte);
            self.incoming = Some((scan, byte));
        }
    }

    /// At the start of the first scan: reports outputs that went high during set-up, and missing pull-ups of
    /// inputs.
    fn check_power_up(&mut self) {
        self.listener.is_before_first_scan = false;
        for &(pin, rose) in &self.listener.outputs {
            if let Some(clock) = rose {
                let name = self.board.pin_name(pin);
                let finding = format!("the output {name} goes high in clock {clock}, before the first scan");
                self.findings.push(ForeignFinding { code: codes::FINDING_GLITCH, text: finding });
            }
        }
        let mut cpu = self.cpu.clone();
        for &pin in &self.board.inputs {
            let pulled = pin_behaviour(self.board.chip, pin)
                .is_some_and(|n| matches!(n.pull_up, PullUpKind::Inputs | PullUpKind::Always));
            if !pulled {
                continue;
            }
            let now = CycleTime::at(cpu.cycle());
            cpu.drive(now, pin, PinLevel::Low);
            cpu.drive(now, pin, PinLevel::Float);
            if cpu.pin_level(pin) != PinLevel::High {
                let finding = format!("the input {} floats when nothing drives it", self.board.pin_name(pin));
                self.findings.push(ForeignFinding { code: codes::FINDING_PULL_UP, text: finding });
            }
        }
    }

    fn run_to(&mut self, to: u32, extra: u64, what: &str) -> Result<(), ForeignMismatch> {
        let until = self.cpu.cycle().saturating_add(self.scan_loop.period * MAX_PERIODS).saturating_add(extra);
        let word = self.board.chip.word_bytes.max(1);
        let at = |pc: u32| format!("0x{:04X}", pc * word);
        let found = loop {
            let stop = self.cpu.run(until, &mut self.listener);
            // A device on a bus answers an edge before the next one of the chip.
            if let Some((pin, level)) = self.listener.buses.as_mut().and_then(|buses| buses.drive.take()) {
                self.cpu.drive(CycleTime::at(self.cpu.cycle()), pin, level);
                if stop == StopReason::Probe {
                    continue;
                }
            }
            match stop {
                StopReason::Breakpoint { pc } if pc == to => return Ok(()),
                // A scan that takes longer than a period leaves no time to wait.
                StopReason::Breakpoint { pc } if pc == self.scan_loop.start && to == self.scan_loop.wait => {
                    break "the next scan begins at once, nothing waits for the timer".to_owned();
                }
                StopReason::Breakpoint { .. } => {}
                StopReason::Limit => {
                    break format!("not reached within several periods, the program is at {}", at(self.cpu.pc()));
                }
                StopReason::Halted => break format!("the chip has halted at {}", at(self.cpu.pc())),
                StopReason::Error(error) => break describe_error(error, at),
                StopReason::Probe => break "a stop without a request".to_owned(),
            }
        };
        Err(ForeignMismatch::of_text(DifferenceKind::Stop, what.to_owned(), found))
    }

    fn compare_pins(&mut self) -> Result<(), ForeignMismatch> {
        for &(symbol, pin) in &self.board.outputs {
            if self.board.timing_dependent.get(symbol) == Some(&true) {
                continue;
            }
            self.compared += 1;
            let expected = PinLevel::from_bit(self.eval.get(symbol) != 0);
            let level = self.cpu.pin_level(pin);
            if level != expected {
                return Err(ForeignMismatch::of_symbol(
                    DifferenceKind::Pin,
                    symbol,
                    level_text(expected),
                    level_text(level),
                ));
            }
        }
        Ok(())
    }

    /// Compares the symbols in memory, if a map gives their locations.
    fn compare_symbols(&mut self) -> Result<(), ForeignMismatch> {
        let Some(places) = &self.board.places else { return Ok(()) };
        for (symbol, is_timing_dependent) in self.board.timing_dependent.iter().enumerate() {
            let is_input = self.stimulus_symbols.inputs.contains(&symbol);
            if *is_timing_dependent || is_input {
                continue;
            }
            self.compared += 1;
            let (expected, found) = (self.eval.get(symbol), places.read_symbol(&self.cpu, symbol));
            if expected != found {
                return Err(ForeignMismatch::of_symbol(
                    DifferenceKind::Symbol,
                    symbol,
                    expected.to_string(),
                    found.to_string(),
                ));
            }
        }
        Ok(())
    }

    /// Compares the serial line, the PWM output and the EEPROM.
    fn compare_lines(&mut self) -> Result<(), ForeignMismatch> {
        let (scan, clock) = (self.starts.scans, self.board.peripherals.to_clock(CycleTime::at(self.cpu.cycle())));
        if let Some((_, listener)) = &mut self.listener.serial {
            listener.advance_to(clock);
            while let Some(frame) = listener.take_frame() {
                self.received_frames.push_back((scan, frame));
            }
        }
        while let (Some(&(_, byte)), Some((_, frame))) = (self.awaited.front(), self.received_frames.front()) {
            self.compared += 1;
            if frame.fault.is_some() || self.board.compares_bytes && frame.byte != byte {
                let fault = frame.fault.as_ref().map_or_else(String::new, |fault| format!(", {fault}"));
                return Err(ForeignMismatch::of_text(
                    DifferenceKind::Serial,
                    byte_name(byte),
                    byte_name(frame.byte) + &fault,
                ));
            }
            self.awaited.pop_front();
            self.received_frames.pop_front();
        }
        // Both sides may wait for the transmitter for a different number of scans.
        let is_late = |sent_in_scan: u64| scan > sent_in_scan + 2 * self.board.scans_per_byte + 2;
        if let Some((sent_in_scan, frame)) = self.received_frames.front() {
            if !self.sent {
                let finding = format!(
                    "{} in clock {} since power-up, before any element sends",
                    byte_name(frame.byte),
                    frame.start
                );
                if !self.findings.iter().any(|finding| finding.code == codes::FINDING_EARLY_BYTE) {
                    self.findings.push(ForeignFinding { code: codes::FINDING_EARLY_BYTE, text: finding });
                }
                return Err(ForeignMismatch::of_text(
                    DifferenceKind::Serial,
                    "nothing sent".to_owned(),
                    byte_name(frame.byte),
                ));
            }
            if is_late(*sent_in_scan) {
                return Err(ForeignMismatch::of_text(
                    DifferenceKind::Serial,
                    "nothing sent".to_owned(),
                    byte_name(frame.byte),
                ));
            }
        }
        if let Some(&(_, byte)) = self.awaited.front().filter(|(sent_in_scan, _)| is_late(*sent_in_scan)) {
            return Err(ForeignMismatch::of_text(DifferenceKind::Serial, byte_name(byte), "nothing sent".to_owned()));
        }
        for ((_, pulses), duty) in self.listener.pwm.iter_mut().zip(self.eval.pwm_duties()) {
            self.compared += 1;
            if let Some(Deviation { expected, found }) = pulses.judge(clock) {
                return Err(ForeignMismatch::of_text(DifferenceKind::Pwm, expected, found));
            }
            pulses.set_duty(clock, *duty);
        }
        if let Some(devices) = self.listener.buses.as_mut().filter(|_| self.board.compares_buses) {
            self.compared += devices.compare(&self.eval).map_err(|Deviation { expected, found }| {
                ForeignMismatch::of_text(DifferenceKind::Bus, expected, found)
            })?;
        }
        self.compare_eeprom()
    }

    /// Compares the EEPROM cells of variables that the evaluator has written completely, once the write time
    /// is over.
    fn compare_eeprom(&mut self) -> Result<(), ForeignMismatch> {
        if self.eval.eeprom_busy_scans() > 0 {
            return Ok(());
        }
        for variable in &self.board.eeprom_variables {
            let value = self.eval.get(variable.symbol).to_le_bytes();
            let cells: Vec<u8> =
                self.eval.eeprom().iter().skip(variable.addr as usize).take(variable.bytes as usize).copied().collect();
            if !value.starts_with(&cells) {
                continue;
            }
            for (addr, &expected) in (variable.addr..).zip(&cells) {
                self.compared += 1;
                let found = self.cpu.peek("eeprom", addr);
                if found != Some(expected) {
                    let found = found.map_or_else(|| "no cell".to_owned(), |found| format!("0x{found:02X}"));
                    let expected = format!("0x{expected:02X} in cell {addr} of the EEPROM");
                    return Err(ForeignMismatch::of_text(DifferenceKind::Eeprom, expected, found));
                }
            }
        }
        Ok(())
    }
}

/// Sets the external levels of a chip at power-up.
pub(crate) fn wire_board<C: CheckedChip>(cpu: &mut C, board: &ForeignBoard) {
    let now = CycleTime::at(0);
    for &pin in &board.inputs {
        cpu.drive(now, pin, PinLevel::Low);
    }
    let is_open_drain = |pin| pin_behaviour(board.chip, pin).is_some_and(|behaviour| behaviour.high == HighDrive::Open);
    for &(_, pin) in board.outputs.iter().filter(|output| is_open_drain(output.1)) {
        cpu.drive(now, pin, PinLevel::PullUp);
    }
    for &(_, pin, reference) in &board.peripherals.analog {
        board.peripherals.drive_analog(cpu, (pin, reference), 0);
    }
    if let Some(pin) = board.peripherals.receive {
        cpu.drive(now, pin, PinLevel::High);
    }
    for pin in board.peripherals.buses.pull_ups() {
        cpu.drive(now, pin, PinLevel::PullUp);
    }
}
