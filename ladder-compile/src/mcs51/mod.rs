//! The 8051 back end: intermediate code to an image of program memory.
//!
//! How the chip is used stands in `docs/compile-8051.md`.

pub mod arch;
mod bits;
mod branch;
mod bytes;
mod compare;
pub mod layout;
mod lookup;
pub mod pace;
pub mod regs;
mod runtime;
pub mod select;
pub mod serial;
mod state;
mod words;

use emu_8051::chips::{PARTS, Part};
use emu_8051::isa::Kind;
use ladder::ElementId;

use crate::code::{Asm, Code, Label};
use crate::ir::Op;
use crate::map::Special;
use crate::target::{Built, Job, Line, Mark, Refusal, Target};
use crate::worst::longest;
use arch::{Jump, Mcs51};
use layout::Layout;
use pace::{Pace, Timer};
use regs::Regs;
use select::Select;
use serial::Speed;

/// The pins, those with a second job last: P3.0 and P3.1 carry the serial line, P0 needs resistors outside.
const PINS: &[&str] = &[
    "P1.0", "P1.1", "P1.2", "P1.3", "P1.4", "P1.5", "P1.6", "P1.7", "P2.0", "P2.1", "P2.2", "P2.3", "P2.4", "P2.5",
    "P2.6", "P2.7", "P3.2", "P3.3", "P3.4", "P3.5", "P3.6", "P3.7", "P3.0", "P3.1", "P0.0", "P0.1", "P0.2", "P0.3",
    "P0.4", "P0.5", "P0.6", "P0.7",
];

/// The chips of this back end.
pub const TARGETS: &[Target] = &[target("8051"), target("8052"), target("at89s52")];

const fn target(name: &str) -> Target {
    Target { chip: &part(name).chip, pins: PINS, uart: Some(("P3.1", "P3.0")), pwm: None, adc: &[], eeprom: 0, build }
}

/// The row of a chip, which is there: it is looked up when this crate is compiled.
const fn part(name: &str) -> &'static Part {
    let (mut n, name) = (0, name.as_bytes());
    loop {
        let known = PARTS[n].chip.name.as_bytes();
        let mut i = 0;
        while i < name.len() && i < known.len() && known[i] == name[i] {
            i += 1;
        }
        if i == name.len() && i == known.len() {
            return &PARTS[n];
        }
        n += 1;
    }
}

/// Cycles of a turn of the loop that waits, a JNB, in whose first cycle the flag is read: a match that it just missed is seen by
/// the next one, which ends as long after it.
const POLL: u64 = 2;

/// Cycles of a jump, whatever its form.
const JUMP: u64 = 2;

/// Makes the image.
///
/// # Errors
/// The chip cannot hold or do it.
pub fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let regs = Regs(job.target.chip);
    lacks(job)?;
    let pace =
        pace::pace(job.clock_hz, job.cycle_us).map_err(|(shortest, longest)| Refusal::Period { shortest, longest })?;
    let line = job.ir.uart.send || job.ir.uart.receive;
    let speed = match job.baud.filter(|_| line) {
        Some(baud) => Some(
            serial::speed(job.clock_hz, baud, job.cycle_us, regs.has_timer2())
                .map_err(|nearest| Refusal::Baud { nearest })?,
        ),
        None => None,
    };
    let needs = layout::Needs { pace: pace.bytes(), ..layout::needs(job.ir) };
    let layout = layout::layout(job.ir, job.pins, regs, job.target.chip.ram_len, needs)?;
    let plan = Plan { job, regs, layout: &layout, pace, speed };
    // A byte may be sent without a look at the transmitter where the scans are far enough apart.
    let quick = plan.image(false)?;
    let image = if quick.wait == 0 { quick } else { plan.image(true)? };
    plan.fits(&image)?;
    Ok(plan.built(image))
}

/// What the chips do not have.
fn lacks(job: &Job<'_>) -> Result<(), Refusal> {
    let missing = [
        (!job.ir.adcs.is_empty(), "analog inputs"),
        (job.ir.pwm_hz.is_some(), "PWM output"),
        (job.ir.eeprom > 0, "EEPROM"),
    ];
    let all = missing.into_iter().filter(|(wanted, _)| *wanted).map(|(_, what)| Refusal::Lacks {
        cause: format!("{} has no {what}", job.target.chip.name),
        hint: "choose a PIC16 or an AVR".to_owned(),
        element: None,
    });
    let mut all: Vec<Refusal> = all.collect();
    match (all.len(), all.pop()) {
        (1, Some(one)) => Err(one),
        (_, Some(last)) => {
            all.push(last);
            Err(Refusal::Many(all))
        }
        _ => Ok(()),
    }
}

struct Plan<'a> {
    job: &'a Job<'a>,
    regs: Regs,
    layout: &'a Layout,
    pace: Pace,
    speed: Option<Speed>,
}

/// Code with its times.
struct Image {
    code: Code,
    /// The longest path of a scan.
    worst: u64,
    /// The longest path of each rung.
    rungs: Vec<u64>,
    /// The longest time from a match to its scan.
    poll: u64,
    /// The longest wait for the transmitter.
    wait: u64,
}

impl Plan<'_> {
    fn timer(&self) -> Timer<'_> {
        let second = self.regs.has_timer2() && !self.speed.is_some_and(|speed| speed.second);
        Timer { pace: self.pace, second, ram: &self.layout.pace, regs: self.regs }
    }

    /// The code; `waits` says whether a byte looks whether the one before is out.
    fn image(&self, waits: bool) -> Result<Image, Refusal> {
        let ir = self.job.ir;
        let mut asm = Asm::new(Mcs51);
        asm.mark(Mark::Part("reset: outputs low, RAM, initial values"));
        runtime::reset(&mut asm, ir, self.layout);
        let timer = self.timer();
        const SIXTEEN_BITS: i32 = 1;
        let tmod = self.speed.map_or(0, |speed| speed.tmod()) | if timer.second { 0 } else { SIXTEEN_BITS };
        if tmod != 0 {
            asm.op(Kind::MovDirImm, &[self.regs.byte("TMOD"), tmod]);
        }
        if let Some(speed) = self.speed {
            asm.mark(Mark::Part("serial line"));
            speed.start(&mut asm, self.regs, ir.uart.receive, self.pace.shortest());
        }
        asm.mark(Mark::Part("pacing timer"));
        timer.start(&mut asm);
        let poll = asm.label();
        timer.wait(&mut asm, poll);
        asm.mark(Mark::Part("latch the inputs"));
        for port in &self.layout.ports {
            if let Some(input) = port.input {
                asm.op(Kind::MovDirDir, &[input.into(), port.sfr.into()]);
            }
        }
        if let Some(arrived) = self.layout.arrived {
            asm.op(Kind::MovCBit, &[self.regs.bit("RI")]);
            asm.op(Kind::MovBitC, &[arrived.into()]);
        }
        let mut select = Select::new(&mut asm, ir, self.layout, self.regs);
        select.waits = waits;
        scan(self.job, &mut select);
        let sends = std::mem::take(&mut select.sends);
        let (multiply, divide, tables) = (select.multiply, select.divide, std::mem::take(&mut select.tables));
        select.mark(Mark::Part("write the outputs"));
        let ports = self.layout.ports.iter().filter_map(|port| Some((port.sfr, port.output?)));
        for (sfr, output) in ports {
            select.asm.op(Kind::MovDirDir, &[sfr.into(), output.into()]);
        }
        select.mark(Mark::ScanEnd);
        select.asm.repeat(Jump::Go, poll, 1);
        select.mark(Mark::ScanOver);
        for (width, entry) in multiply.into_iter().enumerate().filter_map(|(n, entry)| Some((n, entry?))) {
            select.mark(Mark::Part("multiplication"));
            select.multiplication(entry, width);
        }
        for (width, entry) in divide.into_iter().enumerate().filter_map(|(n, entry)| Some((n, entry?))) {
            select.mark(Mark::Part("division"));
            select.division(entry, width);
        }
        for (label, bytes) in tables {
            asm.mark(Mark::Part("table"));
            asm.place(label);
            asm.data(&bytes.into_iter().map(u16::from).collect::<Vec<_>>());
        }
        let code = asm.finish().map_err(Refusal::Internal)?;
        Ok(self.timed(code, &sends, poll))
    }

    fn timed(&self, code: Code, sends: &[Label], poll_at: Label) -> Image {
        let at = |mark| code.at(mark).unwrap_or(0);
        let (start, end) = (at(Mark::ScanStart), at(Mark::ScanEnd));
        let look = code.insns.iter().find(|insn| insn.addr == code.at_label(poll_at)).map_or(0, |insn| insn.len);
        let poll = POLL + longest(&code, at(Mark::Poll) + look, start);
        let mut worst = longest(&code, start, end) + JUMP;
        // A byte goes out at the latest where the slowest scan sends without a wait, if no byte takes longer than the scans
        // that the language gives it (see `serial::speed`): then what one waits for was late itself.
        let before = sends.iter().map(|&send| longest(&code, start, code.at_label(send))).max().unwrap_or(0) + poll;
        let behind = sends.iter().map(|&send| longest(&code, code.at_label(send), end)).max().unwrap_or(0) + JUMP;
        let wait = match (self.speed, sends.is_empty()) {
            (Some(speed), false) => {
                let (byte, apart) = speed.byte(self.job.baud.unwrap_or(1), self.job.cycle_us, self.pace.period);
                (before + byte + JUMP).saturating_sub(apart)
            }
            _ => 0,
        };
        if wait > 0 {
            worst = worst.max(before + JUMP + behind);
        }
        let mut bounds: Vec<u32> = (0..self.job.ir.rungs.len() as u32).map(|n| at(Mark::Rung(n))).collect();
        bounds.push(at(Mark::RungsEnd));
        let rungs = bounds.iter().zip(bounds.iter().skip(1)).map(|(&from, &to)| {
            let sends = sends.iter().any(|&send| (from..to).contains(&code.at_label(send)));
            longest(&code, from, to) + if sends { wait } else { 0 }
        });
        let rungs = rungs.collect();
        Image { code, worst, rungs, poll, wait }
    }

    fn fits(&self, image: &Image) -> Result<(), Refusal> {
        let (needed, available) = (image.code.words.len() as u64, u64::from(self.job.target.chip.on_chip));
        if needed > available {
            return Err(Refusal::Code { needed, available, rungs: sizes(self.job, &image.code) });
        }
        // The scan must be over when the next turn of the timer is.
        if self.pace.turns > 1 && image.worst + image.poll > u64::from(self.pace.length) {
            return Err(Refusal::Lacks {
                cause: format!(
                    "a scan takes up to {} machine cycles, but the timer overflows every {}, {} times in a cycle of {} us",
                    image.worst + image.poll,
                    self.pace.length,
                    self.pace.turns,
                    self.job.cycle_us
                ),
                hint: "divide the program, or choose a faster chip".to_owned(),
                element: None,
            });
        }
        Ok(())
    }

    fn built(&self, image: Image) -> Built {
        let Image { code, worst, rungs, poll, .. } = image;
        let (bits, words) = self.layout.places();
        let bytes = code.words.iter().map(|&word| word as u8).collect();
        let baud = self.job.baud.unwrap_or(0);
        let (transmit, receive) = self.job.target.uart.unwrap_or(("", ""));
        let mut specials = Vec::new();
        if let Some(speed) = self.speed {
            if self.job.ir.uart.send {
                specials.push(Special::Transmit { pin: transmit.to_owned(), baud, bit: speed.bit });
            }
            if self.job.ir.uart.receive {
                specials.push(Special::Receive { pin: receive.to_owned(), baud });
            }
        }
        let port0 = self.regs.byte("P0") as u8;
        let drains = self.job.pins.iter().filter(|pin| pin.output && self.regs.pin(pin.pin).0 == port0).map(|pin| {
            let cause = format!("`{}` stands at {}, which pulls low and never high", pin.name, pin.pin);
            (cause, "fit a resistor from the pin to the supply, or choose a pin of another port".to_owned())
        });
        Built {
            segments: vec![(0, bytes)],
            lines: lines(&code),
            bits,
            words,
            period: self.pace.period,
            shortest: self.pace.shortest(),
            tick: 1,
            poll,
            worst,
            rungs,
            ram_bytes: self.layout.ram_bytes,
            fuses: vec![
                format!("clock: {} Hz at XTAL1 and XTAL2", self.job.clock_hz),
                "EA high: the program is on the chip".to_owned(),
            ],
            specials,
            warnings: drains.collect(),
            marks: code.marks,
        }
    }
}

/// The scan, with a mark at every rung and every element of the program, also at those without code.
fn scan(job: &Job<'_>, select: &mut Select<'_>) {
    let ir = job.ir;
    let steps = ir.rungs.iter().flat_map(|rung| rung.steps.iter().map(|step| &step.op));
    let all: Vec<&Op> = ir.begin.iter().chain(steps).chain(&ir.end).collect();
    let mut live = state::live(&all, false).into_iter();
    let mut one = |select: &mut Select<'_>, op: &Op| select.one(op, live.next().unwrap_or(false));
    ir.begin.iter().for_each(|op| one(select, op));
    for (number, rung) in ir.rungs.iter().enumerate() {
        let number = number as u32;
        select.mark(Mark::Rung(number));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.elements {
            let id = ElementId { rung: number, index };
            select.mark(Mark::Element(id));
            while let Some(step) = steps.next_if(|step| step.at <= id) {
                one(select, &step.op);
            }
        }
        steps.for_each(|step| one(select, &step.op));
    }
    select.mark(Mark::RungsEnd);
    ir.end.iter().for_each(|op| one(select, op));
}

/// Bytes of each rung.
fn sizes(job: &Job<'_>, code: &Code) -> Vec<u64> {
    let at = |n: u32| code.at(Mark::Rung(n)).or(code.at(Mark::RungsEnd)).unwrap_or(0);
    (0..job.ir.rungs.len() as u32).map(|n| u64::from(at(n + 1).saturating_sub(at(n)))).collect()
}

/// The code by lines; data by at most eight bytes.
fn lines(code: &Code) -> Vec<Line> {
    let mut lines = Vec::new();
    let slice = |from: u32, to: u32| code.words.get(from as usize..to as usize).unwrap_or_default();
    let mut at = 0;
    let data = |lines: &mut Vec<Line>, from: u32, to: u32| {
        let mut starts: Vec<u32> = code.marks.iter().map(|&(_, at)| at).filter(|at| (from..to).contains(at)).collect();
        starts.extend([from, to]);
        starts.sort_unstable();
        for (&from, &to) in starts.iter().zip(starts.iter().skip(1)) {
            for (n, words) in slice(from, to).chunks(8).enumerate() {
                let addr = from + 8 * n as u32;
                lines.push(Line { addr, words: words.to_vec(), text: String::new(), target: None });
            }
        }
    };
    for insn in &code.insns {
        data(&mut lines, at, insn.addr);
        at = insn.addr + insn.len;
        let (words, text) = (slice(insn.addr, at).to_vec(), insn.text.clone());
        lines.push(Line { addr: insn.addr, words, text, target: insn.target });
    }
    data(&mut lines, at, code.words.len() as u32);
    lines
}
