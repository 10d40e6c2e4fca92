//! A batch: 64 KB of code memory with several cases per opcode, each at its own address, and a record for
//! each case.
//!
//! "Sea" is code memory filled with the byte [`SEA`]; see `program.rs`.

use emu_core::rng::Rng;

use crate::program::{COLLECT, PAD, Program, RECORD, SEA, XDATA, at, program};

/// Number of cases per opcode in a batch.
pub const EACH: usize = 8;
/// Number of cases in a batch: all opcodes except A5h, which is no instruction.
pub const CASES: usize = 255 * EACH;
/// Bytes for the records and the final zero. The size is a multiple of the page size, because a page without
/// its jump to the collector cannot be sea.
const RECORDS: usize = 0x8000;
const _: () = assert!((CASES + 1) * RECORD <= RECORDS);

/// One instruction and its initial state.
#[derive(Debug, Clone)]
pub struct Case {
    /// Opcode and operands.
    pub bytes: Vec<u8>,
    /// Address of the opcode.
    pub site: u16,
    /// The state; see [`at`].
    pub record: [u8; RECORD],
}

/// A batch, ready to run.
pub struct Batch {
    /// All of code memory.
    pub code: Vec<u8>,
    /// The cases in execution order.
    pub cases: Vec<Case>,
    /// The driver program, with its start and end addresses.
    pub program: Program,
}

/// The meaning of a byte after an opcode.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Dir,
    Bit,
    Imm,
    Rel,
    Page,
    /// Two bytes.
    Abs,
}

/// Registers that an instruction under test may name: all 8 bits are plain storage. The other registers
/// count, send, interrupt, have unimplemented bits, or belong to the driver program.
const DIRECT: &[u8] = &[0x81, 0x82, 0x83, 0x90, 0xB0, 0xD0, 0xE0, 0xF0];
/// Those of them that are bit addressable.
const WITH_BITS: &[u8] = &[0x90, 0xB0, 0xD0, 0xE0, 0xF0];
/// Byte values at boundaries of the arithmetic.
const EDGES: &[u8] = &[0x00, 0x01, 0x0F, 0x10, 0x7F, 0x80, 0x81, 0x99, 0x9A, 0xFE, 0xFF];

/// Returns the kinds of the bytes after `opcode` (manual, "MCS-51 instruction set", table of opcodes).
fn parts(opcode: u8) -> &'static [Part] {
    use Part::{Abs, Bit, Dir, Imm, Page, Rel};
    match opcode {
        0x01..=0xFF if opcode & 0x0F == 0x01 => &[Page],
        0x10 | 0x20 | 0x30 => &[Bit, Rel],
        0x40 | 0x50 | 0x60 | 0x70 | 0x80 | 0xD8..=0xDF => &[Rel],
        0x02 | 0x12 => &[Abs],
        0x05 | 0x15 | 0x25 | 0x35 | 0x42 | 0x45 | 0x52 | 0x55 | 0x62 | 0x65 | 0x95 => &[Dir],
        0x86..=0x8F | 0xA6..=0xAF | 0xC0 | 0xC5 | 0xD0 | 0xE5 | 0xF5 => &[Dir],
        0x43 | 0x53 | 0x63 | 0x75 => &[Dir, Imm],
        0x85 => &[Dir, Dir],
        0x24 | 0x34 | 0x44 | 0x54 | 0x64 | 0x74 | 0x94 | 0x76..=0x7F => &[Imm],
        0x90 => &[Imm, Imm],
        0x72 | 0x82 | 0x92 | 0xA0 | 0xA2 | 0xB0 | 0xB2 | 0xC2 | 0xD2 => &[Bit],
        0xB4 | 0xB6..=0xBF => &[Imm, Rel],
        0xB5 | 0xD5 => &[Dir, Rel],
        _ => &[],
    }
}

/// The use of a byte of code memory.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Sea that may be overwritten.
    Free,
    /// Sea that must remain.
    Landing,
    Taken,
}

/// Code memory while instructions are added.
struct Sea {
    code: Vec<u8>,
    uses: Vec<Use>,
}

impl Sea {
    fn put(&mut self, from: u16, bytes: &[u8], uses: Use) {
        for (i, &byte) in bytes.iter().enumerate() {
            let to = usize::from(from.wrapping_add(i as u16));
            (self.code[to], self.uses[to]) = (byte, uses);
        }
    }

    fn is(&self, from: u16, len: u16, good: &[Use]) -> bool {
        (0..len).all(|i| good.contains(&self.uses[usize::from(from.wrapping_add(i))]))
    }

    /// Returns true if two bytes of sea are at `to`, and the page that they call into has its jump to the
    /// collector.
    fn lands(&self, to: u16) -> bool {
        let pad = (to.wrapping_add(2) & 0xF800) + PAD;
        self.is(to, 2, &[Use::Free, Use::Landing]) && self.is(pad + 1, 2, &[Use::Landing])
    }

    fn keep(&mut self, to: u16) {
        self.put(to, &[SEA; 2], Use::Landing);
    }

    /// Returns a landing address. Half of them are near a page boundary.
    fn landing(&mut self, rng: &mut Rng) -> u16 {
        loop {
            let drawn = rng.next_u64() as u16;
            let to = if rng.one_in(2) { (drawn & 0xFF00).wrapping_sub(2).wrapping_add(drawn & 3) } else { drawn };
            if self.lands(to) {
                self.keep(to);
                return to;
            }
        }
    }
}

/// Returns a random byte, often a boundary value.
fn byte(rng: &mut Rng) -> u8 {
    let drawn = rng.next_u64();
    if drawn & 1 == 0 { (drawn >> 8) as u8 } else { EDGES[(drawn >> 8) as usize % EDGES.len()] }
}

fn one_of(list: &[u8], rng: &mut Rng) -> u8 {
    list[rng.below(list.len() as u64) as usize]
}

/// Draws a batch.
pub fn batch(seed: u64) -> Batch {
    let mut rng = Rng::new(seed);
    let records = 0x1800 + 0x800 * rng.below(13) as u16;
    let program = program(records);
    let mut sea = Sea { code: vec![SEA; 0x1_0000], uses: vec![Use::Free; 0x1_0000] };
    for page in 0..32 {
        let to = COLLECT.to_be_bytes();
        sea.put(page * 0x800 + PAD, &[0x02, to[0], to[1]], Use::Landing);
        // The two bytes before the jump would take its opcode as their operand.
        sea.put(page * 0x800 + PAD - 1, &[SEA], Use::Taken);
        sea.uses[usize::from(page * 0x800 + PAD)] = Use::Taken;
    }
    sea.put(COLLECT, &program.bytes, Use::Taken);
    sea.put(records, &[0; RECORDS], Use::Taken);

    let mut opcodes: Vec<u8> = (0..=255).filter(|&op| op != 0xA5).flat_map(|op| [op; EACH]).collect();
    for i in (1..opcodes.len()).rev() {
        opcodes.swap(i, rng.below(i as u64 + 1) as usize);
    }
    let mut cases = Vec::with_capacity(CASES);
    for (i, &opcode) in opcodes.iter().enumerate() {
        let (site, bytes) = place(opcode, &mut sea, &mut rng);
        let record = state(site, &bytes, &mut sea, &mut rng);
        sea.put(records + (i * RECORD) as u16, &record, Use::Taken);
        cases.push(Case { bytes, site, record });
    }
    Batch { code: sea.code, cases, program }
}

/// Places an instruction in the sea so that execution after it reaches sea. No relative jump goes to address
/// 0 across FFFFh: there s51 loses an instruction, and with it the rest of the batch (findings.txt).
fn place(opcode: u8, sea: &mut Sea, rng: &mut Rng) -> (u16, Vec<u8>) {
    loop {
        let drawn = rng.next_u64() as u16;
        let site = if rng.one_in(4) { (drawn & 0xFF00).wrapping_sub(drawn & 3) } else { drawn };
        // A zero in the high byte of the address would end the run.
        if site < 0x100 {
            continue;
        }
        let (bytes, target) = operands(opcode, site, sea, rng);
        if target == 0 && parts(opcode).contains(&Part::Rel) {
            continue;
        }
        let len = bytes.len() as u16;
        let next = site.wrapping_add(len);
        let clear = |to: u16| to.wrapping_sub(site) >= len && to.wrapping_add(1).wrapping_sub(site) >= len;
        if sea.is(site, len, &[Use::Free]) && sea.lands(next) && sea.lands(target) && clear(target) {
            sea.put(site, &bytes, Use::Taken);
            sea.keep(next);
            sea.keep(target);
            return (site, bytes);
        }
    }
}

/// Returns an instruction with random operands, and its jump target, or the next instruction if it names
/// none.
fn operands(opcode: u8, site: u16, sea: &mut Sea, rng: &mut Rng) -> (Vec<u8>, u16) {
    let parts = parts(opcode);
    let len = 1 + parts.len() as u16 + u16::from(parts.contains(&Part::Abs));
    let next = site.wrapping_add(len);
    let (mut bytes, mut target) = (vec![opcode], next);
    for part in parts {
        let drawn = byte(rng);
        match part {
            Part::Dir => bytes.push(if rng.one_in(3) { one_of(DIRECT, rng) } else { drawn & 0x7F }),
            Part::Bit if rng.one_in(3) => bytes.push(one_of(WITH_BITS, rng) | drawn & 7),
            Part::Bit => bytes.push(drawn & 0x7F),
            Part::Imm => bytes.push(drawn),
            Part::Rel => {
                bytes.push(drawn);
                target = next.wrapping_add_signed(i16::from(drawn as i8));
            }
            Part::Page => {
                bytes.push(drawn);
                target = next & 0xF800 | u16::from(opcode >> 5) << 8 | u16::from(drawn);
            }
            Part::Abs => {
                target = sea.landing(rng);
                bytes.extend(target.to_be_bytes());
            }
        }
    }
    (bytes, target)
}

/// Returns a random state for the instruction at `site`; the values that the instruction reads are often
/// boundary values.
fn state(site: u16, bytes: &[u8], sea: &mut Sea, rng: &mut Rng) -> [u8; RECORD] {
    let mut record = [0; RECORD];
    rng.fill(&mut record);
    record[at::SITE..][..2].copy_from_slice(&site.to_le_bytes());
    for field in [at::B, at::SP, at::A, at::DPL, at::DPH, at::P1] {
        record[field] = byte(rng);
    }
    let (opcode, bank) = (bytes[0], record[at::PSW] & 0x18);
    let mut pokes = [(0, 0); 3].map(|_| (rng.next_u64() as u8, byte(rng)));
    match opcode {
        0x22 | 0x32 => {
            let [high, low] = sea.landing(rng).to_be_bytes();
            let sp = record[at::SP];
            pokes = [(sp, high), (sp.wrapping_sub(1), low), (sp, high)];
        }
        0x73 => {
            let dptr = loop {
                let (to, a) = (sea.landing(rng), u16::from(record[at::A]));
                if to != 0 || a == 0 {
                    break to.wrapping_sub(a);
                }
            };
            record[at::DPL..][..2].copy_from_slice(&dptr.to_le_bytes());
        }
        0xE0 | 0xF0 => record[at::DPH] |= (XDATA >> 8) as u8,
        _ => match opcode & 0x0F {
            0x08..=0x0F => pokes[0].0 = bank | opcode & 7,
            0x06 | 0x07 => {
                pokes[0] = (bank | opcode & 1, byte(rng));
                pokes[1].0 = pokes[0].1;
            }
            _ => {}
        },
    }
    if let Some(&direct) = bytes.get(1).filter(|&&b| b < 0x80 && parts(opcode)[0] == Part::Dir) {
        pokes[2].0 = direct;
    }
    for (i, (addr, value)) in pokes.into_iter().enumerate() {
        record[at::POKES + 2 * i..][..2].copy_from_slice(&[addr, value]);
        if addr == 0 {
            record[at::CELL0] = value;
        }
    }
    record
}
