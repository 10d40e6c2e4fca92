//! Random programs with random inputs from outside: chips, wirings, drives of pins, and changes of the
//! machine between runs.

use emu_8051::chips::{MCS51_PARTS, chip};
use emu_8051::isa::find_row;
use emu_8051::{Mcs51, Mcs51Readings, Options};
use emu_core::image::{Image, Segment};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_core::table::MatchedRow;
use emu_core::{Cpu, RamInit};
use emu_test_support::slices::{RandomInput, SlicePlan, pick_random};

fn byte(rng: &mut Rng) -> u8 {
    if rng.one_in(3) { pick_random(rng, &[0, 1, 2, 0x0F, 0x7F, 0x80, 0xFE, 0xFF]) } else { rng.next_u64() as u8 }
}

/// Registers that random code uses: all of them, but PCON and the watchdog less often.
const SFRS: &[u8] = &[
    0x80, 0x81, 0x82, 0x83, 0x84, 0x85, 0x88, 0x89, 0x8A, 0x8B, 0x8C, 0x8D, 0x8E, 0x90, 0x98, 0x99, 0xA0, 0xA2, 0xA8,
    0xB0, 0xB8, 0xC8, 0xC9, 0xCA, 0xCB, 0xCC, 0xCD, 0xD0, 0xE0, 0xF0, 0x88, 0x90, 0xB0, 0xC8, 0x98, 0xD0, 0xE0, 0x91,
];

fn direct(rng: &mut Rng) -> u8 {
    match rng.below(40) {
        0 => pick_random(rng, &[0x87, 0xA6, 0xFF]),
        1..=14 => pick_random(rng, SFRS),
        _ => rng.next_u64() as u8 & 0x7F,
    }
}

fn bit(rng: &mut Rng) -> u8 {
    if rng.one_in(2) { pick_random(rng, SFRS) & 0xF8 | rng.next_u64() as u8 & 7 } else { rng.next_u64() as u8 & 0x7F }
}

/// Random instructions of all opcodes, without any byte A5h, so that a jump into an operand does not end the
/// run.
pub fn wild(len: usize, rng: &mut Rng) -> Vec<u8> {
    let mut code = Vec::with_capacity(len + 3);
    while code.len() < len {
        let opcode = rng.next_u64() as u8;
        let Some(MatchedRow { row, .. }) = find_row([opcode, 0, 0]) else { continue };
        let end = code.len() + row.len() as usize;
        code.push(opcode);
        for slot in row.operands.iter().filter(|slot| !slot.kind.wide) {
            match slot.kind.name {
                "direct address" => code.push(direct(rng)),
                "bit address" => code.push(bit(rng)),
                "target" if !rng.one_in(3) => code.push((rng.below(40) as u8).wrapping_sub(20)),
                "target" | "constant" => code.push(byte(rng)),
                // A register is part of the opcode.
                _ => {}
            }
        }
        // Long constants and targets.
        code.resize_with(end, || byte(rng));
    }
    code.truncate(len);
    code.iter_mut().filter(|b| **b == 0xA5).for_each(|b| *b = 0xA4);
    code
}

/// Waits and work as written by compilers and people. Labels are line numbers (`L0` is the first line). %k is
/// a random byte, %b a random bit, %r a random register, %n the address of a NOP, and %i the address of a
/// constant of the program.
const SNIPPETS: &[&str] = &[
    "jnb TF0,L0; clr TF0",
    "jbc TF0,L2; sjmp L0; nop",
    "jnb TF1,L0; clr TF1; cpl P1.%b",
    "jnb TF2,L0; clr TF2",
    "jb TF2,L2; jnb EXF2,L0; anl T2CON,#0x3F",
    "jb P3.2,L0",
    "jnb P3.%b,L0; jb P3.%b,L1",
    "mov A,P1; jz L0; cpl A; mov P2,A",
    "mov A,P1; anl A,#%k; jz L0",
    "mov A,P3; cjne A,#0xFF,L3; sjmp L0; inc 0x33",
    "mov A,P1; cjne A,P1,L3; sjmp L0; inc 0x34",
    "jnb 0x20.%b,L0; clr 0x20.%b",
    "nop; jnb 0x20.%b,L0; clr 0x20.%b; cpl P1.%b",
    "nop; nop; jb 0x21.%b,L5; jb P3.3,L0; sjmp L0; clr 0x21.%b",
    "mov C,0x20.%b; jnc L0; clr 0x20.%b",
    "mov A,0x30; cjne A,#%k,L0",
    "mov A,0x30; xrl A,0x31; jnb ACC.2,L0; inc 0x31",
    "mov R0,#0x20; mov A,@R0; jz L1; mov @R0,#0",
    "cjne R5,#%k,L0",
    "mov R%r,#%k; djnz R%r,L1",
    "mov R6,#5; mov R7,#%k; djnz R7,L2; djnz R6,L1",
    "mov R6,#3; mov 0x40,#%k; nop; djnz 0x40,L2; djnz R6,L1",
    "mov R4,#3; jnb TF0,L1; clr TF0; djnz R4,L1",
    "mov R4,#2; jb P3.4,L2; jnb TF1,L1; clr TF1; djnz R4,L1",
    "mov DPTR,#%k; inc DPTR; mov A,DPL; jnz L1",
    "mov A,TL0; cjne A,#%k,L0",
    "mov A,TH1; mov B,TL1; cjne A,TH1,L0",
    "mov A,TCON; anl A,#0x20; jz L0; clr TF0",
    "mov A,TCON; jnb ACC.1,L0; mov 0x35,A",
    "mov A,IE; jz L0",
    "mov A,IE; jb ACC.7,L3; setb EA; setb 0x20.0; jnb 0x20.%b,L3",
    "mov A,IP; rl A; mov B,IP; jnb 0x20.%b,L0; clr 0x20.%b",
    "jnb IE.%b,L0; nop",
    "mov SBUF,A; jnb TI,L1; clr TI",
    "mov SBUF,#%k; jbc TI,L3; sjmp L1; cpl P1.%b",
    "jb RI,L2; jnb TF0,L0; clr RI; mov A,SBUF; mov P1,A",
    "mov A,SCON; anl A,#3; jz L0; anl SCON,#0xFC",
    "mov A,SBUF; cjne A,#%k,L3; nop; mov 0x36,A",
    "orl PCON,#1; nop; inc 0x37",
    "orl PCON,#1; mov A,PCON; jb ACC.0,L1",
    "mov A,PSW; jnb ACC.7,L3; jnb 0x20.%b,L0; cpl C",
    "cpl P3.4; nop; cpl P3.4; cpl P3.5; setb P3.5",
    "clr P3.2; setb P3.2; clr P3.3; inc 0x38; setb P3.3",
    "cpl P1.0; cpl P1.1; setb P1.0; setb P1.1",
    "mov P1,#%k; mov P1,#0xFF",
    "mov P3,#0xFF; xrl IP,#%k; xrl IE,#0x0A; mov IE,#0x9F",
    "mov A,#%k; add A,0x30; da A; addc A,#%k; mov B,#%k; div AB; mul AB; mov 0x39,A",
    "mov DPTR,#%n; movx A,@DPTR; xrl A,#4; movx @DPTR,A",
    "mov DPTR,#%n; clr A; movc A,@A+DPTR; xrl A,#4; movx @DPTR,A",
    "mov DPTR,#%i; movx A,@DPTR; inc A; movx @DPTR,A",
    "mov R0,#%k; movx A,@R0; inc A; movx @R0,A; mov P2,#0x40",
    "mov A,0xA2; xrl 0xA2,#1; inc DPTR; mov 0x84,A",
    "mov 0xA6,#0x1E; mov 0xA6,#0xE1",
    "mov 0xA6,#0x1E; mov 0xA6,#0xE1; jnb TF0,L0; clr TF0",
    "mov 0xA6,#0x1E; mov A,P1; mov 0xA6,#0xE1; anl A,#%k; jz L0",
    "jnb TF2,L2; sjmp L3; sjmp L0; clr TF2; mov 0xA6,#0x1E",
    "lcall L3; nop; sjmp L5; push PSW; ret; nop",
    "mov A,#1; mov DPTR,#L3; jmp @A+DPTR; nop; sjmp L5; nop",
    "mov PSW,#0x18; mov A,R%r; jnz L4; inc 0x3A; mov PSW,#0",
    "mov TH0,#%k; mov TL0,#%k; mov TH1,#%k; mov TL1,#0xF0",
    "mov TMOD,#%k; setb TR0; setb TR1",
    "jnb 0x20.%b,L2; clr 0x20.%b; jnb 0x21.%b,L0; clr 0x21.%b",
];

/// What service routines do in addition to saving A and PSW.
const SERVICE: &[&str] = &[
    "setb 0x20.%b",
    "setb 0x21.%b",
    "inc 0x20",
    "mov 0x20,#0xFF",
    "inc 0x30",
    "inc 0x05",
    "cpl P1.%b",
    "mov SBUF,0x30",
    "mov A,SBUF",
    "cpl TR1",
    "xrl IP,#%k",
    "mov IE,#0x9F",
    "mov TH0,#%k",
    "jnb P3.2,L1; nop",
    "mov C,P3.2; mov P1.7,C",
    "mov R3,#%k; djnz R3,L1",
];

/// A program that is built line by line.
struct Text {
    bytes: Vec<u8>,
    nops: Vec<u32>,
    constants: Vec<u32>,
    heads: Vec<u32>,
}

impl Text {
    fn here(&self) -> u32 {
        self.bytes.len() as u32
    }

    fn org(&mut self, addr: u32) {
        self.bytes.resize(addr as usize, 0);
    }

    /// Appends the lines of `text`, which are separated by semicolons.
    fn add(&mut self, text: &str, rng: &mut Rng) {
        let (bit, register) = (rng.below(8), 2 + rng.below(6));
        let some = |places: &[u32], rng: &mut Rng| if places.is_empty() { 0x4000 } else { pick_random(rng, places) };
        let mut filled = text.replace("%b", &bit.to_string()).replace("%r", &register.to_string());
        filled = filled.replace("%n", &some(&self.nops, rng).to_string());
        filled = filled.replace("%i", &some(&self.constants, rng).to_string());
        while filled.contains("%k") {
            filled = filled.replacen("%k", &byte(rng).to_string(), 1);
        }
        let lines: Vec<&str> = filled.split(';').map(str::trim).collect();
        // The length of a line does not depend on the addresses of targets; a first pass computes the
        // addresses.
        let mut labels = [self.here(); 10];
        for round in 0..2 {
            let begin = self.bytes.len();
            for (n, line) in lines.iter().enumerate() {
                let pc = self.here();
                labels[n] = pc;
                let line = (0..10).fold((*line).to_owned(), |l, n| {
                    l.replace(&format!(",L{n}"), &format!(",{}", labels[n]))
                        .replace(&format!(" L{n}"), &format!(" {}", labels[n]))
                        .replace(&format!("#L{n}"), &format!("#{}", labels[n]))
                });
                let words = emu_asm::assemble_line(chip("8052").expect("a chip"), &line, pc)
                    .unwrap_or_else(|e| panic!("{line}: {e}"));
                if round == 1 && line == "nop" {
                    self.nops.push(pc);
                }
                if round == 1 && line.starts_with("mov R") && line.contains('#') {
                    self.constants.push(pc + 1);
                }
                self.bytes.extend(words.iter().map(|&word| word as u8));
            }
            if round == 0 {
                self.bytes.truncate(begin);
            }
        }
        self.heads.extend(&labels[..lines.len()]);
    }
}

/// Vectors, service routines, a start that enables timers, serial port and interrupts, and an endless
/// sequence of snippets.
fn orderly(rng: &mut Rng) -> Text {
    let mut text = Text { bytes: Vec::new(), nops: Vec::new(), constants: Vec::new(), heads: Vec::new() };
    for source in 0..6 {
        text.org(3 + 8 * source);
        text.add(&format!("ljmp {}", 0x40 + 0x28 * source), rng);
    }
    for source in 0..6u32 {
        text.org(0x40 + 0x28 * source);
        text.add("push ACC; push PSW", rng);
        if rng.one_in(3) {
            text.add("mov PSW,#8", rng);
        }
        (0..1 + rng.below(2)).for_each(|_| text.add(pick_random(rng, SERVICE), rng));
        match source {
            4 => text.add(pick_random(rng, &["clr RI; clr TI", "anl SCON,#0xFC", "jbc RI,L1; clr TI"]), rng),
            5 => text.add("anl T2CON,#0x3F", rng),
            _ => {}
        }
        text.add("pop PSW; pop ACC; reti", rng);
        assert!(text.here() <= 0x68 + 0x28 * source);
    }
    text.org(0x130);
    let begin = text.here();
    text.bytes[..3].copy_from_slice(&[0x02, (begin >> 8) as u8, begin as u8]);
    let (mode, timers) = (rng.next_u64() as u8, pick_random(rng, &[0x21u8, 0x11, 0x22, 0x12, 0x02, 0x23, 0x10]));
    let gates = if rng.one_in(4) { mode & 0xCC } else { 0 };
    text.add(&format!("mov TMOD,#{}; mov SP,#0x58", timers | gates), rng);
    text.add("mov TH0,#%k; mov TL0,#%k; mov TH1,#%k; mov TL1,#%k", rng);
    text.add(&format!("mov SCON,#{}", pick_random(rng, &[0x50u8, 0x10, 0x90, 0xD0, 0x40, 0x00, 0x52])), rng);
    text.add(&format!("mov T2CON,#{}", pick_random(rng, &[4u8, 0x0C, 0x0D, 0x34, 5, 6, 0x3C, 0])), rng);
    text.add(&format!("mov T2MOD,#{}; mov RCAP2H,#%k; mov RCAP2L,#%k", rng.below(4)), rng);
    text.add(&format!("mov PCON,#{}; mov IP,#%k", rng.below(2) << 7), rng);
    text.add(&format!("mov TCON,#{}", 0x50 | rng.next_u64() as u8 & 0x05), rng);
    let enabled = if rng.one_in(5) { 0 } else { 0x80 | rng.next_u64() as u8 & 0x3F };
    text.add(&format!("mov IE,#{enabled}"), rng);
    let body = text.here();
    (0..3 + rng.below(14)).for_each(|_| text.add(pick_random(rng, SNIPPETS), rng));
    text.add(&if rng.one_in(8) { "sjmp L0".into() } else { format!("ljmp {body}") }, rng);
    text
}

/// A random pin; the pins that peripherals use are more frequent.
fn pin(rng: &mut Rng) -> PinId {
    if rng.one_in(2) { pick_random(rng, &[8, 9, 24, 26, 27, 28, 29]) } else { rng.below(32) as PinId }
}

fn level(rng: &mut Rng) -> PinLevel {
    pick_random(rng, &[PinLevel::Low, PinLevel::Low, PinLevel::High, PinLevel::Float, PinLevel::Float])
}

fn act(text: &Text, rng: &mut Rng) -> RandomInput {
    let head =
        |rng: &mut Rng| if text.heads.is_empty() { rng.below(0x1000) as u32 } else { pick_random(rng, &text.heads) };
    match rng.below(9) {
        0 => RandomInput::Poke("idata", 0x20 + rng.below(2) as u32, byte(rng)),
        1 => RandomInput::Poke("sfr", direct(rng).into(), byte(rng)),
        2 => RandomInput::Poke("bit", bit(rng).into(), byte(rng)),
        3 => RandomInput::Pc(head(rng)),
        4 | 5 => RandomInput::Trap(head(rng), !rng.one_in(3)),
        6 => RandomInput::Drive(pin(rng), level(rng)),
        7 if !text.nops.is_empty() => {
            RandomInput::Poke("code", pick_random(rng, &text.nops), pick_random(rng, &[0, 4]))
        }
        _ => RandomInput::Nothing,
    }
}

/// Makes a random program with its inputs, for about `span` cycles.
pub fn plan(seed: u64, span: u64) -> SlicePlan<Mcs51> {
    let rng = &mut Rng::new(seed);
    let part = pick_random(rng, &[0, 1, 3, 4, 6, 7, 8, 8, 9, 10, 10, 11, 12]);
    let chip = &MCS51_PARTS[part].chip;
    let readings = Mcs51Readings { samples_interrupt_at_once: rng.one_in(4), read_holds_interrupts: rng.one_in(4) };
    let options = Options { von_neumann: rng.one_in(4), ea: !rng.one_in(8), x2: rng.one_in(2), readings };
    let mut text = if rng.one_in(4) {
        // The same 4 KB fill all of memory, so that a return to any address finds a program.
        let block = wild(0x1000, rng);
        Text { bytes: block.repeat(16), nops: Vec::new(), constants: Vec::new(), heads: Vec::new() }
    } else {
        orderly(rng)
    };
    let bytes = std::mem::take(&mut text.bytes);
    let image = Image { segments: vec![Segment { space: "code", addr: 0, bytes }], ..Image::default() };
    let mut start = Mcs51::with(chip, &image, RamInit::Random(rng.next_u64()), options);
    start.set_bus_on_pins(rng.one_in(4));
    // Drives are single or in groups, some of them in the same cycle.
    let mut at = 0;
    while at < span {
        at += if rng.one_in(3) { rng.below(4) } else { rng.below(span / 10) };
        start.drive(CycleTime::at(at), pin(rng), level(rng));
    }
    if rng.one_in(10) {
        let at = rng.below(span);
        start.drive(CycleTime::at(at), 32, PinLevel::High);
        start.drive(CycleTime::at(at + rng.below(6)), 32, PinLevel::Low);
    }
    let mut acts: Vec<(u64, RandomInput)> = (0..rng.below(6)).map(|_| (rng.below(span), act(&text, rng))).collect();
    acts.push((span, RandomInput::Nothing));
    acts.sort_by_key(|act| act.0);
    let what = format!("seed {seed:#018x}, {}, {options:?}, {acts:x?}", chip.name);
    SlicePlan { description: what, start, inputs: acts, breakpoint_candidates: text.heads }
}
