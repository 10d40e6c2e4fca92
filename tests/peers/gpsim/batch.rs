//! A batch of about 480 test cases in one program memory, and the requests that run them on both machines.
//! Each case has its own slot with code that sets up its state.

use emu_core::image::HexSegment;
use emu_pic16::isa::Pic16Row;
use std::fmt::Write;

use emu_core::image::write_hex;
use emu_core::rng::Rng;
use emu_core::table::InstructionRow;
use emu_core::{Chip, Cpu};
use emu_pic16::Pic16;
use emu_pic16::chips::{self, FileSlot};
use emu_pic16::isa::{KINDS, ROWS, encode, find_row};

use crate::drive::{self, LATER, VIEW, View};

/// Words per slot: a place for a CALL, 13 words that set up a state, the instruction under test, two RETURNs.
/// The number is odd, so that the instruction occurs at every alignment.
const SLOT: u16 = 17;
/// Offset of the setup code in a slot.
const SETUP: u16 = 1;
/// Offset of the instruction under test in a slot.
const SITE: u16 = 14;
/// Number of slots in 8 K words of program memory, which is the number of cases in a batch.
pub const CASES: usize = (0x2000 / SLOT) as usize;
/// RETURN: the filler word, so that the return from a CALL under test is visible.
const SEA: u16 = 0x0008;

/// The word that assemblers generate for CLRW.
pub const CLRW: u16 = 0x0103;
const CLRF_INTCON: u16 = 0x018B;
const BSF_GIE: u16 = 0x178B;

/// Configuration words with the watchdog off and on: RC oscillator, because in gpsim a crystal starts at once
/// after sleep (findings.txt); no brown-out reset, no LVP, no protection.
const CONFIG: [u16; 2] = [0x3F3B, 0x3F3F];

/// Registers that an instruction under test may name in addition to RAM and core registers. All 8 bits are
/// plain storage while their peripherals are off: timer 1, CCP1, CCP2, PR2, SSPADD, SPBRG, EEDATA, EEADR.
pub const STORAGE: &[u16] = &[0x0E, 0x0F, 0x15, 0x16, 0x1B, 0x1C, 0x92, 0x93, 0x99, 0x10C, 0x10D];
/// PCL, STATUS, FSR, PCLATH, which exist in every bank.
pub const CORE: &[u16] = &[2, 3, 4, 10];
/// Byte values at boundaries of the arithmetic.
const EDGES: &[u8] = &[0x00, 0x01, 0x0F, 0x10, 0x7F, 0x80, 0x81, 0x99, 0x9A, 0xFE, 0xFF];

/// A request to a machine.
#[derive(Debug, Clone, Copy)]
pub enum Do {
    /// Set the program counter.
    Goto(u16),
    /// Run a number of instructions.
    Step(u32),
    /// Sleep until an address is reached.
    Wake(u16),
    /// Record the complete state.
    View,
    /// Record the program counter.
    Later,
}

/// One instruction and its initial state.
#[derive(Debug, Clone)]
pub struct Case {
    pub row: usize,
    pub word: u16,
    /// Address of the instruction.
    pub site: u16,
    pub w: u8,
    pub status: u8,
    pub fsr: u8,
    pub pclath: u8,
    /// The address of the file register that it names, including its bank and resolved through INDF.
    pub file: Option<u16>,
    /// The byte in that register, if it is RAM or storage.
    pub value: u8,
}

impl Case {
    /// Returns whether GIE is set before it, for instructions that return from a CALL.
    pub fn gie(&self) -> bool {
        self.value & 0x1F != 0x1A
    }
}

/// A batch, ready to run.
pub struct Batch {
    pub words: Vec<u16>,
    pub watchdog: bool,
    /// The cases in execution order.
    pub cases: Vec<Case>,
    pub orders: Vec<Do>,
}

impl Batch {
    /// Returns the Intel HEX file, with the configuration word.
    pub fn hex(&self) -> String {
        let bytes: Vec<u8> = self.words.iter().flat_map(|w| w.to_le_bytes()).collect();
        write_hex(&[
            HexSegment { addr: 0, bytes: &bytes },
            HexSegment { addr: 0x400E, bytes: &CONFIG[usize::from(self.watchdog)].to_le_bytes() },
        ])
    }

    /// Returns the requests as gpsim commands.
    pub fn script(&self) -> String {
        let mut text = String::new();
        for order in &self.orders {
            match order {
                Do::Goto(to) => line(&mut text, format_args!("pc = {to}")),
                Do::Step(count) => line(&mut text, format_args!("step {count}")),
                Do::Wake(to) => line(&mut text, format_args!("break e {to}\nrun")),
                Do::View => text += VIEW,
                Do::Later => text += LATER,
            }
        }
        text
    }

    /// Executes the requests on our machine, and returns the views.
    pub fn ours(&self, machine: &mut Pic16) -> Vec<View> {
        let mut views: Vec<View> = Vec::with_capacity(self.cases.len());
        let there = drive::there(machine.chip());
        for order in &self.orders {
            match *order {
                Do::Goto(to) => machine.set_pc(to.into()),
                Do::Step(count) => (0..count).for_each(|_| _ = machine.step(&mut ())),
                Do::Wake(to) => {
                    machine.set_breakpoint(to.into(), true);
                    machine.run(machine.cycle() + 1_000_000, &mut ());
                    machine.set_breakpoint(to.into(), false);
                }
                Do::View => views.push(drive::view(machine, &there)),
                Do::Later => views.last_mut().expect("a view before").later.push(machine.pc() as u16),
            }
        }
        views
    }
}

/// The source of random cases: a row, and the don't-care bits of its word.
#[derive(Clone, Copy)]
pub struct Kind {
    pub row: usize,
    open: u16,
}

/// Returns the rows, each with the bits of its word that select neither instruction nor operands.
pub fn kinds() -> Vec<Kind> {
    (0..ROWS.len())
        .map(|row| {
            let all = word(row, |letter| match letter {
                b'f' => 0x7F,
                b'b' => 7,
                b't' => 0x7FF,
                _ => 0xFF,
            });
            let none = word(row, |_| 0);
            let open = (0..14).map(|bit| 1 << bit).filter(|bit| {
                let other =
                    find_row(none ^ bit).is_some_and(|Pic16Row { row: found, .. }| found.name == ROWS[row].name);
                other && (all ^ none) & bit == 0
            });
            Kind { row, open: open.sum() }
        })
        .collect()
}

fn word(row: usize, operand: impl Fn(u8) -> i32) -> u16 {
    let operands: Vec<i32> = ROWS[row].operands.iter().map(|slot| operand(slot.letter)).collect();
    encode(KINDS[row], &operands).unwrap_or_else(|e| panic!("{}: {e}", ROWS[row].name))
}

/// Returns a random byte, often a boundary value.
fn byte(rng: &mut Rng) -> u8 {
    let drawn = rng.next_u64();
    if drawn & 1 == 0 { (drawn >> 8) as u8 } else { EDGES[(drawn >> 8) as usize % EDGES.len()] }
}

fn one_of<T: Copy>(list: &[T], rng: &mut Rng) -> T {
    list[rng.below(list.len() as u64) as usize]
}

/// Draws a batch from `kinds`, with equal shares for each. With the watchdog, every case is SLEEP or CLRWDT.
pub fn batch(chip: &Chip, kinds: &[Kind], watchdog: bool, seed: u64) -> Batch {
    let mut rng = Rng::new(seed);
    let part = chips::part(chip.name).expect("a chip of the family");
    let ram: Vec<u16> = (0..0x200).filter(|&a| matches!(part.file_slot(a), FileSlot::Ram(_))).collect();
    let mut maker = Maker { batch: Batch { words: vec![SEA; 0x2000], watchdog, cases: vec![], orders: vec![] }, ram };
    let mut slots: Vec<u16> = (0..CASES as u16).map(|i| i * SLOT).collect();
    for i in (1..slots.len()).rev() {
        slots.swap(i, rng.below(i as u64 + 1) as usize);
    }
    let mut callers = slots.clone();
    if watchdog {
        // Assign the prescaler to the watchdog, 1:1: movlw 0xF8, option.
        let at = slots.pop().expect("more than one slot");
        callers.retain(|&caller| caller != at);
        maker.batch.words[usize::from(at)..][..2].copy_from_slice(&[0x30F8, 0x0062]);
        maker.batch.orders.extend([Do::Goto(at), Do::Step(2)]);
    }
    let first = rng.below(kinds.len() as u64) as usize;
    for (i, &slot) in slots.iter().enumerate() {
        maker.case(kinds[(first + i) % kinds.len()], slot, &mut callers, &mut rng);
    }
    maker.batch
}

struct Maker {
    batch: Batch,
    ram: Vec<u16>,
}

impl Maker {
    /// Returns a random address for the instruction under test: mostly RAM.
    fn reach(&self, rng: &mut Rng) -> u16 {
        match rng.below(10) {
            0 => one_of(STORAGE, rng),
            1 | 2 => one_of(CORE, rng) + 0x80 * rng.below(4) as u16,
            _ => one_of(&self.ram, rng),
        }
    }

    fn case(&mut self, kind: Kind, slot: u16, callers: &mut Vec<u16>, rng: &mut Rng) {
        let row: &InstructionRow = &ROWS[kind.row];
        let has = |letter: u8| row.operands.iter().any(|slot| slot.letter == letter);
        let (setup, site) = (slot + SETUP, slot + SITE);
        let reach = self.reach(rng);
        let through = has(b'f') && rng.one_in(5);
        let empty = through && rng.one_in(10);
        let pointer = if through { reach } else { rng.below(0x200) as u16 };
        // INDF itself exists in every bank.
        let pointer = if empty { pointer & 0x180 } else { pointer };
        let named = if through { 0x80 * rng.below(4) as u16 } else { reach };
        let mut status = byte(rng) & 0x1F | (named >> 7 << 5) as u8 | (pointer >> 8 << 7) as u8;
        // Write random values to TO and PD.
        status |= rng.next_u64() as u8 & 0x18;
        let mut pclath = rng.below(0x20) as u8;
        let mut target = rng.below(0x800) as u16;
        if row.name == "Call" {
            let to = rng.below(CASES as u64) as u16 * SLOT + SITE + 1;
            (pclath, target) = (pclath & 7 | (to >> 8) as u8 & 0x18, to & 0x7FF);
        }
        let operands = |letter: u8, rng: &mut Rng| match letter {
            b'f' => i32::from(named & 0x7F),
            b'b' => rng.below(8) as i32,
            b't' => i32::from(target),
            _ => byte(rng).into(),
        };
        let operands: Vec<i32> = row.operands.iter().map(|slot| operands(slot.letter, rng)).collect();
        let word = encode(KINDS[kind.row], &operands).unwrap_or_else(|e| panic!("{}: {e}", row.name));
        let word = if row.name == "Clrw" { CLRW } else { word };
        let word = if rng.one_in(16) { word ^ rng.next_u64() as u16 & kind.open } else { word };
        let mut w = byte(rng);
        if row.name == "Option" {
            // Timer 0 counts edges that never occur.
            w |= 0x30;
        }
        let case = Case {
            row: kind.row,
            word,
            site,
            w,
            status,
            fsr: pointer as u8,
            pclath,
            file: has(b'f').then_some(if through { pointer } else { named }),
            value: byte(rng),
        };
        let back = matches!(row.name, "Return" | "Retlw" | "Retfie");
        self.write(setup, &case, back, reach);
        self.order(&case, setup, back, callers, rng);
        self.batch.cases.push(case);
    }

    /// Writes the words of a slot.
    fn write(&mut self, setup: u16, case: &Case, back: bool, reach: u16) {
        let movlw = |k: u8| 0x3000 | u16::from(k);
        let movwf = |f: u16| 0x0080 | f;
        let (indf, core) = (0, |i: usize| CORE[i]);
        // A cell of RAM or storage is set through INDF; core registers already have their values.
        let plain = !CORE.contains(&(reach & 0x7F));
        let to = if plain { reach } else { self.ram[0] };
        // RETFIE sets GIE when it is already set, or when it is clear.
        let last = match back {
            true if case.gie() => BSF_GIE,
            true => CLRF_INTCON,
            false => movwf(indf),
        };
        let irp = movlw((to >> 8 << 7) as u8);
        let first = [irp, movwf(core(1)), movlw(to as u8), movwf(core(2)), movlw(case.value), last];
        let second = [
            movlw(case.fsr),
            movwf(core(2)),
            movlw(case.pclath),
            movwf(core(3)),
            movlw(case.status),
            movwf(core(1)),
            movlw(case.w),
            case.word,
        ];
        let all = first.iter().chain(&second);
        for (to, &word) in self.batch.words[usize::from(setup)..].iter_mut().zip(all) {
            *to = word;
        }
    }

    fn order(&mut self, case: &Case, setup: u16, back: bool, callers: &mut Vec<u16>, rng: &mut Rng) {
        let orders = &mut self.batch.orders;
        // One to three CALLs, so that the order of the return addresses is tested too. Only the pushed
        // addresses matter, not the targets.
        let deep = if back { 1 + usize::from(rng.one_in(4)) + usize::from(rng.one_in(8)) } else { 0 };
        let deep = deep.min(callers.len());
        for _ in 0..deep {
            let caller = callers.swap_remove(rng.below(callers.len() as u64) as usize);
            self.batch.words[usize::from(caller)] = 0x2000 | rng.below(0x800) as u16;
            orders.extend([Do::Goto(caller), Do::Step(1)]);
        }
        orders.extend([Do::Goto(setup), Do::Step(u32::from(case.site - setup) + 1), Do::View]);
        for _ in 1..deep {
            orders.extend([Do::Goto(case.site), Do::Step(1), Do::Later]);
        }
        match ROWS[case.row].name {
            "Call" => orders.extend([Do::Step(1), Do::Later]),
            "Sleep" => orders.extend([Do::Wake(case.site + 1), Do::View]),
            _ => {}
        }
    }
}

fn line(text: &mut String, what: std::fmt::Arguments) {
    text.write_fmt(what).expect("a string takes any text");
    text.push('\n');
}
