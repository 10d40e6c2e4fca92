//! The 8051 back end: translates intermediate code to an image of program memory.
//!
//! `docs/compile-8051.md` describes how the code uses the chip.

pub mod arch;
mod bit_ops;
mod branch;
mod byte_ops;
mod compare;
mod known_state;
pub mod layout;
mod lookup;
pub mod pacing;
pub mod registers;
mod runtime;
pub mod select;
pub mod serial;
mod word_ops;

use diag::Severity;
use emu_8051::chips::{MCS51_PARTS, Mcs51Part};
use emu_8051::isa::Mcs51OpKind;
use ladder::ElementId;

use crate::code::{CodeLabel, CodeWriter, FinishedCode};
use crate::ir::IrOp;
use crate::longest_path::longest_path;
use crate::map::SpecialPin;
use crate::pins::AssignedPin;
use crate::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, CompileTarget, ImageLine, PinNeed};
use arch::{Mcs51Arch, Mcs51Jump};
use layout::Mcs51Layout;
use pacing::{Mcs51Pacing, Mcs51PacingTimer};
use registers::Mcs51Registers;
use select::Mcs51Selector;
use serial::Mcs51BaudSetup;

/// Pins in order of assignment, those with a second function last: P3.0 and P3.1 are the serial line, P0
/// needs external resistors.
const PINS: &[&str] = &[
    "P1.0", "P1.1", "P1.2", "P1.3", "P1.4", "P1.5", "P1.6", "P1.7", "P2.0", "P2.1", "P2.2", "P2.3", "P2.4", "P2.5",
    "P2.6", "P2.7", "P3.2", "P3.3", "P3.4", "P3.5", "P3.6", "P3.7", "P3.0", "P3.1", "P0.0", "P0.1", "P0.2", "P0.3",
    "P0.4", "P0.5", "P0.6", "P0.7",
];

/// Chips of this back end.
pub const TARGETS: &[CompileTarget] = &[target("8051"), target("8052"), target("at89s52")];

const fn target(name: &str) -> CompileTarget {
    CompileTarget {
        chip: &chip_part(name).chip,
        pins: PINS,
        uart: Some(("P3.1", "P3.0")),
        pwm: &[],
        i2c: None,
        spi: None,
        adc: &[],
        eeprom: 0,
        build,
    }
}

/// Description of a chip that must exist; evaluated at compile time.
const fn chip_part(name: &str) -> &'static Mcs51Part {
    let (mut n, name) = (0, name.as_bytes());
    loop {
        let known = MCS51_PARTS[n].chip.name.as_bytes();
        let mut i = 0;
        while i < name.len() && i < known.len() && known[i] == name[i] {
            i += 1;
        }
        if i == name.len() && i == known.len() {
            return &MCS51_PARTS[n];
        }
        n += 1;
    }
}

/// Cycles of an iteration of the poll loop, a JNB that reads the flag in its first cycle.
///
/// A match that one iteration just misses is detected by the next one, which ends as long after the match.
const POLL_CYCLES: u64 = 2;

/// Cycles of a jump in any form.
const JUMP_CYCLES: u64 = 2;

/// Builds an image.
///
/// # Errors
/// The program does not fit the chip, or the chip lacks a feature that the program needs.
pub fn build(job: &CompileJob<'_>) -> Result<BuiltImage, BuildRefusal> {
    let regs = Mcs51Registers(job.target.chip);
    check_capabilities(job)?;
    let pace = pacing::plan_pacing(job.clock_hz, job.cycle_us)?;
    let line = job.ir.uart.send || job.ir.uart.receive;
    let speed = match job.baud.filter(|_| line) {
        Some(baud) => Some(
            serial::plan_baud(job.clock_hz, baud, job.cycle_us, regs.has_timer2())
                .map_err(|nearest| BuildRefusal::BaudOutOfRange { nearest })?,
        ),
        None => None,
    };
    let needs = layout::Mcs51RamNeeds { pace: pace.bytes(), ..layout::ram_needs(job.ir) };
    let layout = layout::layout(job.ir, job.pins, regs, job.target.chip.ram_len, needs)?;
    let plan = Mcs51BuildPlan { job, regs, layout: &layout, pace, speed };
    // If scans are far enough apart, a byte can be sent without checking the transmitter.
    let quick = plan.image(false)?;
    let image = if quick.transmitter_wait_cycles == 0 { quick } else { plan.image(true)? };
    plan.check_fit(&image)?;
    Ok(plan.built_image(image))
}

/// Refuses features that the chips of this family lack.
fn check_capabilities(job: &CompileJob<'_>) -> Result<(), BuildRefusal> {
    let missing = [
        (!job.ir.adcs.is_empty(), "analog inputs"),
        (!job.ir.pwms.is_empty(), "PWM output"),
        (job.ir.eeprom_bytes > 0, "EEPROM"),
    ];
    let all = missing.into_iter().filter(|(wanted, _)| *wanted).map(|(_, what)| BuildRefusal::Unsupported {
        cause: format!("{} has no {what}", job.target.chip.name),
        hint: "choose a PIC16 or an AVR".to_owned(),
        element: None,
    });
    let mut all: Vec<BuildRefusal> = all.collect();
    match (all.len(), all.pop()) {
        (1, Some(one)) => Err(one),
        (_, Some(last)) => {
            all.push(last);
            Err(BuildRefusal::Several(all))
        }
        _ => Ok(()),
    }
}

/// All decisions made before the first instruction is emitted.
struct Mcs51BuildPlan<'a> {
    job: &'a CompileJob<'a>,
    regs: Mcs51Registers,
    layout: &'a Mcs51Layout,
    pace: Mcs51Pacing,
    speed: Option<Mcs51BaudSetup>,
}

/// Finished code with its timing in machine cycles.
struct TimedCode {
    code: FinishedCode,
    /// Longest path of a scan.
    worst_scan_cycles: u64,
    /// Longest path of each rung.
    rung_cycles: Vec<u64>,
    /// Maximum time from a match to its scan.
    poll_cycles: u64,
    /// Maximum wait for the transmitter.
    transmitter_wait_cycles: u64,
}

impl Mcs51BuildPlan<'_> {
    fn timer(&self) -> Mcs51PacingTimer<'_> {
        let second = self.regs.has_timer2() && !self.speed.is_some_and(|speed| speed.uses_timer2);
        Mcs51PacingTimer { pace: self.pace, is_timer2: second, ram: &self.layout.pacing_ram, regs: self.regs }
    }

    /// Generates the image. With `waits`, sending a byte waits until the previous one is complete.
    fn image(&self, waits: bool) -> Result<TimedCode, BuildRefusal> {
        let ir = self.job.ir;
        let mut asm = CodeWriter::new(Mcs51Arch);
        asm.mark(CodeMark::Section("reset: outputs low, RAM, initial values"));
        runtime::emit_reset(&mut asm, ir, self.layout);
        let timer = self.timer();
        const SIXTEEN_BITS: i32 = 1;
        let tmod = self.speed.map_or(0, |speed| speed.tmod()) | if timer.is_timer2 { 0 } else { SIXTEEN_BITS };
        if tmod != 0 {
            asm.op(Mcs51OpKind::MovDirImm, &[self.regs.byte("TMOD"), tmod]);
        }
        if let Some(speed) = self.speed {
            asm.mark(CodeMark::Section("serial line"));
            speed.start(&mut asm, self.regs, ir.uart.receive, self.pace.shortest());
        }
        asm.mark(CodeMark::Section("pacing timer"));
        timer.start(&mut asm);
        let poll = asm.new_label();
        timer.wait(&mut asm, poll);
        asm.mark(CodeMark::Section("latch the inputs"));
        for port in &self.layout.ports {
            if let Some(input) = port.input {
                asm.op(Mcs51OpKind::MovDirDir, &[input.into(), port.sfr.into()]);
            }
        }
        if let Some(arrived) = self.layout.byte_received_flag {
            asm.op(Mcs51OpKind::MovCBit, &[self.regs.bit("RI")]);
            asm.op(Mcs51OpKind::MovBitC, &[arrived.into()]);
        }
        let mut select = Mcs51Selector::new(&mut asm, ir, self.layout, self.regs);
        select.must_wait_for_transmitter = waits || ir.uart.waits;
        // Two cycles an iteration, and the bit time until the first bit begins.
        select.sent_iterations = self.speed.map_or(0, |speed| (speed.byte_cycles() * 12 / 20) as u32 + 8);
        scan(self.job, &mut select);
        let sends = std::mem::take(&mut select.send_labels);
        let (multiply, divide, tables) = (select.multiply, select.divide, std::mem::take(&mut select.tables));
        select.mark(CodeMark::Section("write the outputs"));
        let ports = self.layout.ports.iter().filter_map(|port| Some((port.sfr, port.output?)));
        for (sfr, output) in ports {
            select.asm.op(Mcs51OpKind::MovDirDir, &[sfr.into(), output.into()]);
        }
        select.mark(CodeMark::ScanEnd);
        select.asm.jump_back(Mcs51Jump::Unconditional, poll, 1);
        select.mark(CodeMark::AfterScan);
        for (width, entry) in multiply.into_iter().enumerate().filter_map(|(n, entry)| Some((n, entry?))) {
            select.mark(CodeMark::Section("multiplication"));
            select.multiplication(entry, width);
        }
        for (width, entry) in divide.into_iter().enumerate().filter_map(|(n, entry)| Some((n, entry?))) {
            select.mark(CodeMark::Section("division"));
            select.division(entry, width);
        }
        for (label, bytes) in tables {
            asm.mark(CodeMark::Section("table"));
            asm.place_label(label);
            asm.data(&bytes.into_iter().map(u16::from).collect::<Vec<_>>());
        }
        let code = asm.finish().map_err(BuildRefusal::Internal)?;
        Ok(self.with_timing(code, &sends, poll))
    }

    fn with_timing(&self, code: FinishedCode, sends: &[CodeLabel], poll_at: CodeLabel) -> TimedCode {
        let at = |mark| code.mark_address(mark).unwrap_or(0);
        let (start, end) = (at(CodeMark::ScanStart), at(CodeMark::ScanEnd));
        let look =
            code.instructions.iter().find(|insn| insn.addr == code.label_address(poll_at)).map_or(0, |insn| insn.len);
        let poll = POLL_CYCLES + longest_path(&code, at(CodeMark::PollLoop) + look, start);
        let mut worst = longest_path(&code, start, end) + JUMP_CYCLES;
        // A byte is complete at the latest when the slowest scan sends without waiting, provided no byte
        // takes longer than the scans that the language allows for it (see `serial::plan_baud`). So a byte
        // can only be late if the previous one was late too.
        // With jumps a send may come before or behind anything.
        let longest = |from: u32, to: u32| {
            if self.job.ir.has_jumps() { longest_path(&code, start, end) } else { longest_path(&code, from, to) }
        };
        let before = sends.iter().map(|&send| longest(start, code.label_address(send))).max().unwrap_or(0) + poll;
        let behind = sends.iter().map(|&send| longest(code.label_address(send), end)).max().unwrap_or(0) + JUMP_CYCLES;
        let wait = match (self.speed, sends.is_empty()) {
            (Some(speed), false) => {
                let apart =
                    serial::cycles_between_sends(self.job.baud.unwrap_or(1), self.job.cycle_us, self.pace.period);
                (before + speed.byte_cycles() + JUMP_CYCLES).saturating_sub(apart)
            }
            _ => 0,
        };
        if wait > 0 {
            worst = worst.max(before + JUMP_CYCLES + behind);
        }
        let mut bounds: Vec<u32> = (0..self.job.ir.rungs.len() as u32).map(|n| at(CodeMark::Rung(n))).collect();
        bounds.push(at(CodeMark::RungsEnd));
        let rungs = bounds.iter().zip(bounds.iter().skip(1)).map(|(&from, &to)| {
            let sends = sends.iter().any(|&send| (from..to).contains(&code.label_address(send)));
            longest_path(&code, from, to) + if sends { wait } else { 0 }
        });
        let rungs = rungs.collect();
        TimedCode {
            code,
            worst_scan_cycles: worst,
            rung_cycles: rungs,
            poll_cycles: poll,
            transmitter_wait_cycles: wait,
        }
    }

    fn check_fit(&self, image: &TimedCode) -> Result<(), BuildRefusal> {
        let (needed, available) = (image.code.words.len() as u64, u64::from(self.job.target.chip.on_chip_flash_bytes));
        if needed > available {
            return Err(BuildRefusal::CodeTooLarge { needed, available, rungs: rung_bytes(self.job, &image.code) });
        }
        // The scan must end before the next overflow of the timer.
        if self.pace.timer_rounds > 1 && image.worst_scan_cycles + image.poll_cycles > u64::from(self.pace.round_cycles)
        {
            return Err(BuildRefusal::Unsupported {
                cause: format!(
                    "a scan takes up to {} machine cycles, but the timer overflows every {}, {} times in a cycle of {} us",
                    image.worst_scan_cycles + image.poll_cycles,
                    self.pace.round_cycles,
                    self.pace.timer_rounds,
                    self.job.cycle_us
                ),
                hint: "divide the program, or choose a faster chip".to_owned(),
                element: None,
            });
        }
        Ok(())
    }

    fn built_image(&self, image: TimedCode) -> BuiltImage {
        let TimedCode { code, worst_scan_cycles: worst, rung_cycles: rungs, poll_cycles: poll, .. } = image;
        let (bits, words) = (self.layout.bit_locations(), self.layout.word_locations());
        let bytes = code.words.iter().map(|&word| word as u8).collect();
        let baud = self.job.baud.unwrap_or(0);
        let (transmit, receive) = self.job.target.uart.unwrap_or(("", ""));
        let mut specials = Vec::new();
        if let Some(speed) = self.speed {
            if self.job.ir.uart.send {
                specials.push(SpecialPin::Transmit { pin: transmit.to_owned(), baud, bit: speed.bit });
            }
            if self.job.ir.uart.receive {
                specials.push(SpecialPin::Receive { pin: receive.to_owned(), baud });
            }
        }
        let port0 = self.regs.byte("P0") as u8;
        let in_port0 = |pin: &AssignedPin| self.regs.pin(pin.pin).byte == port0;
        let drains = self.job.pins.iter().filter(|pin| pin.output && in_port0(pin)).map(|pin| PinNeed {
            severity: Severity::Warning,
            cause: format!("`{}` is at {}, which pulls low and never high", pin.name, pin.pin),
            hint: "fit a resistor from the pin to the supply, or choose a pin of another port",
        });
        let floating = PinNeed::of_floating_inputs(self.job.pins, in_port0);
        BuiltImage {
            segments: vec![(0, bytes)],
            lines: image_lines(&code),
            bit_places: bits,
            word_places: words,
            period: self.pace.period,
            shortest_period_cycles: self.pace.shortest(),
            tick_cycles: 1,
            poll_cycles: poll,
            worst_scan_cycles: worst,
            rung_cycles: rungs,
            ram_bytes: self.layout.ram_bytes,
            fuses: vec![
                format!("clock: {} Hz at XTAL1 and XTAL2", self.job.clock_hz),
                "EA high: the program is on the chip".to_owned(),
            ],
            specials,
            pin_needs: drains.chain(floating).collect(),
            marks: code.marks,
        }
    }
}

/// Emits the scan, with a mark at every rung and every element of the program, also at elements without code.
fn scan(job: &CompileJob<'_>, select: &mut Mcs51Selector<'_>) {
    let ir = job.ir;
    let steps = ir.rungs.iter().flat_map(|rung| rung.steps.iter().map(|step| &step.op));
    let all: Vec<&IrOp> = ir.prologue.iter().chain(steps).chain(&ir.epilogue).collect();
    let mut live = known_state::acc_live_after(&all, false).into_iter();
    let mut one = |select: &mut Mcs51Selector<'_>, op: &IrOp| select.select_op(op, live.next().unwrap_or(false));
    ir.prologue.iter().for_each(|op| one(select, op));
    for (number, rung) in ir.rungs.iter().enumerate() {
        let number = number as u32;
        select.mark(CodeMark::Rung(number));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.element_count {
            let id = ElementId { rung: number, index };
            select.mark(CodeMark::Element(id));
            while let Some(step) = steps.next_if(|step| step.element <= id) {
                one(select, &step.op);
            }
        }
        steps.for_each(|step| one(select, &step.op));
    }
    select.mark(CodeMark::RungsEnd);
    ir.epilogue.iter().for_each(|op| one(select, op));
}

/// Size of each rung in bytes.
fn rung_bytes(job: &CompileJob<'_>, code: &FinishedCode) -> Vec<u64> {
    let at = |n: u32| code.mark_address(CodeMark::Rung(n)).or(code.mark_address(CodeMark::RungsEnd)).unwrap_or(0);
    (0..job.ir.rungs.len() as u32).map(|n| u64::from(at(n + 1).saturating_sub(at(n)))).collect()
}

/// Lines of the image; data lines have at most eight bytes.
fn image_lines(code: &FinishedCode) -> Vec<ImageLine> {
    let mut lines = Vec::new();
    let slice = |from: u32, to: u32| code.words.get(from as usize..to as usize).unwrap_or_default();
    let mut at = 0;
    let data = |lines: &mut Vec<ImageLine>, from: u32, to: u32| {
        let mut starts: Vec<u32> = code.marks.iter().map(|&(_, at)| at).filter(|at| (from..to).contains(at)).collect();
        starts.extend([from, to]);
        starts.sort_unstable();
        for (&from, &to) in starts.iter().zip(starts.iter().skip(1)) {
            for (n, words) in slice(from, to).chunks(8).enumerate() {
                let addr = from + 8 * n as u32;
                lines.push(ImageLine { addr, words: words.to_vec(), text: String::new(), target: None });
            }
        }
    };
    for insn in &code.instructions {
        data(&mut lines, at, insn.addr);
        at = insn.addr + insn.len;
        let (words, text) = (slice(insn.addr, at).to_vec(), insn.text.clone());
        lines.push(ImageLine { addr: insn.addr, words, text, target: insn.target });
    }
    data(&mut lines, at, code.words.len() as u32);
    lines
}
