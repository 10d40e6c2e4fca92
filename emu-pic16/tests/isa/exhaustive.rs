//! Arithmetic, logic and moves with all bytes of W and of the operand, in every addressing mode, compared
//! with adders that work bit by bit.

use emu_core::Cpu;
use emu_core::rng::Rng;

use super::rig::{TestBench, put_word, word};

/// C, DC and Z.
pub type Flags = [bool; 3];

/// Result of an instruction: operand, W and flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Result {
    pub value: u8,
    pub flags: Flags,
    pub skips: bool,
}

/// Computes the result from operand, W and flags.
pub type Reference = fn(u8, u8, Flags) -> Result;

fn bit(byte: u8, n: usize) -> bool {
    byte >> n & 1 == 1
}

fn byte(bits: [bool; 8]) -> u8 {
    bits.iter().enumerate().map(|(n, &bit)| u8::from(bit) << n).sum()
}

/// Adds bit by bit; returns the sum and the carries out of all bits.
fn add(a: u8, b: u8, mut carry: bool) -> (u8, [bool; 8]) {
    let (mut sum, mut carries) = ([false; 8], [false; 8]);
    for n in 0..8 {
        let ones = u8::from(bit(a, n)) + u8::from(bit(b, n)) + u8::from(carry);
        sum[n] = ones % 2 == 1;
        carry = ones >= 2;
        carries[n] = carry;
    }
    (byte(sum), carries)
}

fn arithmetic(a: u8, b: u8, carry: bool) -> Result {
    let (value, carries) = add(a, b, carry);
    Result { value, flags: [carries[7], carries[3], value == 0], skips: false }
}

fn with_z(value: u8, flags: Flags) -> Result {
    Result { value, flags: [flags[0], flags[1], value == 0], skips: false }
}

fn bitwise(a: u8, b: u8, flags: Flags, f: fn(bool, bool) -> bool) -> Result {
    with_z(byte(std::array::from_fn(|n| f(bit(a, n), bit(b, n)))), flags)
}

fn moved(value: u8, flags: Flags) -> Result {
    Result { value, flags, skips: false }
}

fn counts(value: u8, flags: Flags) -> Result {
    Result { value, flags, skips: value == 0 }
}

/// Flags that an instruction writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Writes {
    None,
    C,
    Z,
    All,
}

/// Instructions with a file register and a destination (DS33023, section 29): the flags that they write, and
/// their result.
#[rustfmt::skip]
pub const BYTES: &[(&str, Writes, Reference)] = &[
    ("addwf",  Writes::All,  |f, w, _| arithmetic(f, w, false)),
    ("andwf",  Writes::Z,    |f, w, s| bitwise(f, w, s, |a, b| a && b)),
    ("comf",   Writes::Z,    |f, _, s| bitwise(f, 0, s, |a, _| !a)),
    ("decf",   Writes::Z,    |f, _, s| with_z(add(f, 0xFF, false).0, s)),
    ("decfsz", Writes::None, |f, _, s| counts(add(f, 0xFF, false).0, s)),
    ("incf",   Writes::Z,    |f, _, s| with_z(add(f, 0, true).0, s)),
    ("incfsz", Writes::None, |f, _, s| counts(add(f, 0, true).0, s)),
    ("iorwf",  Writes::Z,    |f, w, s| bitwise(f, w, s, |a, b| a || b)),
    ("movf",   Writes::Z,    |f, _, s| with_z(f, s)),
    ("rlf",    Writes::C,    |f, _, s| Result {
        value: byte(std::array::from_fn(|n| if n == 0 { s[0] } else { bit(f, n - 1) })),
        flags: [bit(f, 7), s[1], s[2]], skips: false }),
    ("rrf",    Writes::C,    |f, _, s| Result {
        value: byte(std::array::from_fn(|n| if n == 7 { s[0] } else { bit(f, n + 1) })),
        flags: [bit(f, 0), s[1], s[2]], skips: false }),
    // The complement of W is added: a carry means no borrow.
    ("subwf",  Writes::All,  |f, w, _| arithmetic(f, !w, true)),
    ("swapf",  Writes::None, |f, _, s| moved(byte(std::array::from_fn(|n| bit(f, (n + 4) % 8))), s)),
    ("xorwf",  Writes::Z,    |f, w, s| bitwise(f, w, s, |a, b| a != b)),
];

/// Instructions with a constant.
#[rustfmt::skip]
const CONSTANTS: &[(&str, Reference)] = &[
    ("addlw", |k, w, _| arithmetic(k, w, false)),
    ("andlw", |k, w, s| bitwise(k, w, s, |a, b| a && b)),
    ("iorlw", |k, w, s| bitwise(k, w, s, |a, b| a || b)),
    ("movlw", |k, _, s| moved(k, s)),
    ("sublw", |k, w, _| arithmetic(k, !w, true)),
    ("xorlw", |k, w, s| bitwise(k, w, s, |a, b| a != b)),
];

/// IRP at its position in STATUS, and FSR.
type Pointer = (u8, u8);

/// Ways to access the operand: text in the instruction, address of the byte, and the pointer to it.
const PLACES: &[(&str, u16, Option<Pointer>)] =
    &[("0x25", 0x25, None), ("0x04", 0x04, None), ("0x00", 0x1A5, Some((0x80, 0xA5))), ("0x00", 0xA5, Some((0, 0xA5)))];

pub fn status_of(flags: Flags, rest: u8) -> u8 {
    rest | u8::from(flags[0]) | u8::from(flags[1]) << 1 | u8::from(flags[2]) << 2
}

pub fn flags_of(status: u8) -> Flags {
    [bit(status, 0), bit(status, 1), bit(status, 2)]
}

/// Returns the values of W to test: all bytes where W matters, otherwise some.
fn ws(name: &str) -> Vec<u8> {
    match name {
        "addwf" | "andwf" | "iorwf" | "subwf" | "xorwf" => (0..=255).collect(),
        _ => vec![0x5A, 0xFF],
    }
}

/// Returns the flags before: all combinations where C is read, otherwise two random complementary ones.
fn befores(name: &str, rng: &mut Rng) -> Vec<u8> {
    let some = rng.next_u64() as u8 & 7;
    if name == "rlf" || name == "rrf" { (0..8).collect() } else { vec![some] }
}

#[test]
fn instructions_with_a_file_register() {
    let mut rng = Rng::new(0x5EED_1600);
    for &(name, _, reference) in BYTES {
        for (text, addr, indirect) in PLACES {
            for to_w in [true, false] {
                let line = format!("{name} {text}, {}", if to_w { "W" } else { "F" });
                let mut bench = TestBench::new(&line);
                let rest = 0x18 | indirect.map_or(0, |pointer| pointer.0);
                if let Some((_, fsr)) = indirect {
                    bench.cpu.set_reg("FSR", u32::from(*fsr));
                }
                for w in ws(name) {
                    for f in 0..=255 {
                        for before in befores(name, &mut rng) {
                            bench.cpu.set_reg("STATUS", u32::from(rest | before));
                            bench.put(*addr, f);
                            bench.set_w(w);
                            let wanted = reference(f, w, flags_of(before));
                            let what = || format!("{line}: W={w:02x} f={f:02x} flags={before:x} wanted {wanted:02x?}");
                            assert_eq!(bench.go(), 1 + u64::from(wanted.skips), "{}: cycles", what());
                            assert_eq!(bench.cpu.pc(), TestBench::PC + 1 + u32::from(wanted.skips), "{}: PC", what());
                            let places = if to_w { (wanted.value, f) } else { (w, wanted.value) };
                            assert_eq!((bench.w(), bench.get(*addr)), places, "{}: W, f", what());
                            let status = status_of(wanted.flags, rest);
                            assert_eq!(bench.get(0x03), status, "{}: STATUS", what());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn instructions_with_a_constant() {
    let mut rng = Rng::new(0x5EED_1601);
    let mut bench = TestBench::new("nop");
    for &(name, reference) in CONSTANTS {
        for k in 0..=255 {
            let line = format!("{name} {k}");
            put_word(&mut bench.cpu, TestBench::PC, word(&line));
            for w in 0..=255 {
                let before = rng.next_u64() as u8 & 7;
                bench.cpu.set_reg("STATUS", u32::from(0x18 | before));
                bench.set_w(w);
                let wanted = reference(k, w, flags_of(before));
                assert_eq!(bench.go(), 1, "{line}: cycles");
                let found = (bench.w(), bench.get(0x03));
                assert_eq!(found, (wanted.value, status_of(wanted.flags, 0x18)), "{line}: W={w:02x} flags={before:x}");
            }
        }
    }
}

/// MOVWF, CLRF and CLRW, with all bytes of W and of the file register.
#[test]
fn moves_and_clears() {
    let mut rng = Rng::new(0x5EED_1602);
    let [mut movwf, mut clrf, mut clrw] = ["movwf 0x25", "clrf 0x25", "clrw"].map(TestBench::new);
    for w in 0..=255 {
        for f in 0..=255 {
            let status = 0x18 | rng.next_u64() as u8 & 7;
            for bench in [&mut movwf, &mut clrf, &mut clrw] {
                bench.cpu.set_reg("STATUS", status.into());
                bench.put(0x25, f);
                bench.set_w(w);
                assert_eq!(bench.go(), 1);
            }
            let see = |bench: &TestBench| (bench.w(), bench.get(0x25), bench.get(0x03));
            assert_eq!(see(&movwf), (w, w, status), "movwf: W={w:02x} f={f:02x}");
            assert_eq!(see(&clrf), (w, 0, status | 4), "clrf: W={w:02x} f={f:02x}");
            assert_eq!(see(&clrw), (0, f, status | 4), "clrw: W={w:02x} f={f:02x}");
        }
    }
}
