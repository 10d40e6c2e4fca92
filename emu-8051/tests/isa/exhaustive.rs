//! Arithmetic, logic and moves with all operands and addressing modes, compared with plain integer
//! arithmetic.
//!
//! The reference computes in `i32`: CY is a carry out of eight bits, AC a carry out of four, OV a signed
//! result outside -128..=127; DA works digit by digit. It does not use the boolean formulas of the
//! instruction bodies.

use emu_core::Cpu;

use super::rig::{ACC, B, PSW, TestBench, parity};

/// The inputs of an instruction: its first and its second operand, and the flags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct State {
    p: i32,
    x: i32,
    cy: bool,
    ac: bool,
    ov: bool,
    /// Whether the jump is taken.
    jumps: bool,
}

type Reference = fn(State) -> State;

fn signed(byte: i32) -> i32 {
    i32::from(byte as u8 as i8)
}

fn added(s: State, carry: bool) -> State {
    let c = i32::from(carry);
    let full = s.p + s.x + c;
    State {
        p: full % 256,
        cy: full > 255,
        ac: s.p % 16 + s.x % 16 + c > 15,
        ov: !(-128..=127).contains(&(signed(s.p) + signed(s.x) + c)),
        ..s
    }
}

fn subtracted(s: State) -> State {
    let c = i32::from(s.cy);
    let full = s.p - s.x - c;
    State {
        p: full.rem_euclid(256),
        cy: full < 0,
        ac: s.p % 16 - s.x % 16 - c < 0,
        ov: !(-128..=127).contains(&(signed(s.p) - signed(s.x) - c)),
        ..s
    }
}

/// Applies `f` to each pair of bits.
fn bitwise(s: State, f: fn(bool, bool) -> bool) -> State {
    let bits = (0..8).map(|n| 1 << n).filter(|mask| f(s.p & mask != 0, s.x & mask != 0));
    State { p: bits.sum(), ..s }
}

/// Adjusts digit by digit: 6 is added to a digit above 9 or with a carry; a carry out of the upper digit sets
/// CY.
fn decimal(s: State) -> State {
    let (mut high, mut low) = (s.p / 16, s.p % 16);
    let mut carried = s.cy;
    if low > 9 || s.ac {
        low += 6;
        high += low / 16;
        low %= 16;
    }
    if high > 9 || carried {
        high += 6;
        carried = true;
    }
    State { p: high % 16 * 16 + low, cy: carried, ..s }
}

fn counted(s: State, by: i32) -> State {
    State { p: (s.p + by).rem_euclid(256), ..s }
}

fn divided(s: State) -> State {
    let whole = (0..256).take_while(|n| s.x * n <= s.p).last().unwrap_or(0);
    State { p: whole, x: s.p - s.x * whole, cy: false, ov: false, ..s }
}

fn compared(s: State) -> State {
    State { cy: s.p < s.x, jumps: s.p != s.x, ..s }
}

/// The assembly text of an operand: A is the accumulator, r is R3, d RAM at 45h, f register B by its address,
/// i RAM at C5h by R1, k a constant, - none.
fn text(form: char, value: i32) -> String {
    match form {
        'A' => "A".into(),
        'r' => "R3".into(),
        'd' => "0x45".into(),
        'f' => "0xF0".into(),
        'i' => "@R1".into(),
        'k' => format!("#{value}"),
        _ => String::new(),
    }
}

/// The third register bank is selected.
const BANK: u8 = 0x10;
const R1: u32 = 0x11;

fn place(form: char) -> Option<(&'static str, u32)> {
    match form {
        'A' => Some(("sfr", ACC)),
        'r' => Some(("idata", 0x13)),
        'd' => Some(("idata", 0x45)),
        'f' => Some(("sfr", B)),
        'i' => Some(("idata", 0xC5)),
        _ => None,
    }
}

/// Template, in which p and x are the operands and t is a target 20h after the instruction; forms of p, forms
/// of x, cycles, reference.
type Group = (&'static str, &'static str, &'static str, u64, Reference);

#[rustfmt::skip]
const ARITHMETIC: &[Group] = &[
    ("add p,x",    "A",    "rdfik", 1, |s| added(s, false)),
    ("addc p,x",   "A",    "rdfik", 1, |s| added(s, s.cy)),
    ("subb p,x",   "A",    "rdfik", 1, subtracted),
    ("cjne p,x,t", "A",    "dfk",   2, compared),
    ("cjne p,x,t", "ri",   "k",     2, compared),
    ("mul AB",     "A",    "f",     4, |s| State { p: s.p * s.x % 256, x: s.p * s.x / 256, cy: false, ov: s.p * s.x > 255, ..s }),
    ("div AB",     "A",    "f",     4, divided),
    ("da p",       "A",    "-",     1, decimal),
    ("rl p",       "A",    "-",     1, |s| State { p: s.p * 2 % 256 + s.p / 128, ..s }),
    ("rr p",       "A",    "-",     1, |s| State { p: s.p / 2 + s.p % 2 * 128, ..s }),
    ("rlc p",      "A",    "-",     1, |s| State { p: s.p * 2 % 256 + i32::from(s.cy), cy: s.p > 127, ..s }),
    ("rrc p",      "A",    "-",     1, |s| State { p: s.p / 2 + 128 * i32::from(s.cy), cy: s.p % 2 == 1, ..s }),
    ("swap p",     "A",    "-",     1, |s| State { p: s.p % 16 * 16 + s.p / 16, ..s }),
    ("cpl p",      "A",    "-",     1, |s| State { p: 255 - s.p, ..s }),
    ("clr p",      "A",    "-",     1, |s| State { p: 0, ..s }),
    ("inc p",      "Ardfi", "-",    1, |s| counted(s, 1)),
    ("dec p",      "Ardfi", "-",    1, |s| counted(s, -1)),
    ("djnz p,t",   "rdf",  "-",     2, |s| State { jumps: s.p != 1, ..counted(s, -1) }),
    ("jz t",       "A",    "-",     2, |s| State { jumps: s.p == 0, ..s }),
    ("jnz t",      "A",    "-",     2, |s| State { jumps: s.p != 0, ..s }),
];

#[rustfmt::skip]
const LOGIC_AND_MOVES: &[Group] = &[
    ("anl p,x",    "A",    "rdfik", 1, |s| bitwise(s, |a, b| a && b)),
    ("anl p,x",    "df",   "A",     1, |s| bitwise(s, |a, b| a && b)),
    ("anl p,x",    "df",   "k",     2, |s| bitwise(s, |a, b| a && b)),
    ("orl p,x",    "A",    "rdfik", 1, |s| bitwise(s, |a, b| a || b)),
    ("orl p,x",    "df",   "A",     1, |s| bitwise(s, |a, b| a || b)),
    ("orl p,x",    "df",   "k",     2, |s| bitwise(s, |a, b| a || b)),
    ("xrl p,x",    "A",    "rdfik", 1, |s| bitwise(s, |a, b| a != b)),
    ("xrl p,x",    "df",   "A",     1, |s| bitwise(s, |a, b| a != b)),
    ("xrl p,x",    "df",   "k",     2, |s| bitwise(s, |a, b| a != b)),
    ("xch p,x",    "A",    "rdfi",  1, |s| State { p: s.x, x: s.p, ..s }),
    ("xchd p,x",   "A",    "i",     1, |s| State { p: s.p / 16 * 16 + s.x % 16, x: s.x / 16 * 16 + s.p % 16, ..s }),
    ("mov p,x",    "A",    "rdfik", 1, |s| State { p: s.x, ..s }),
    ("mov p,x",    "rdfi", "A",     1, |s| State { p: s.x, ..s }),
    ("mov p,x",    "ri",   "df",    2, |s| State { p: s.x, ..s }),
    ("mov p,x",    "ri",   "k",     1, |s| State { p: s.x, ..s }),
    ("mov p,x",    "df",   "rik",   2, |s| State { p: s.x, ..s }),
    ("mov p,x",    "d",    "f",     2, |s| State { p: s.x, ..s }),
    ("mov p,x",    "f",    "d",     2, |s| State { p: s.x, ..s }),
];

fn line(template: &str, p: char, x: char, value: i32) -> String {
    let (name, operands) = template.split_once(' ').unwrap_or((template, ""));
    let target = format!("0x{:04X}", TestBench::PC + 0x20);
    let word = |operand: &str| match operand {
        "p" => text(p, 0),
        "x" => text(x, value),
        "t" => target.clone(),
        other => other.into(),
    };
    format!("{name} {}", operands.split(',').map(word).collect::<Vec<_>>().join(","))
}

/// PSW: the flags, the third bank, and F0 and PSW.1 from `user`.
fn psw(s: State, user: i32, acc: i32) -> i32 {
    let flag = |on: bool, bit: i32| i32::from(on) << bit;
    flag(s.cy, 7) | flag(s.ac, 6) | flag(s.ov, 2) | user & 0x22 | i32::from(BANK) | parity(acc)
}

/// Tests one instruction in one state. Everything that it does not name must stay.
fn check(bench: &mut TestBench, name: &str, forms: (char, char), cycles: u64, reference: Reference, s: State) {
    let (p, x) = (place(forms.0), place(forms.1));
    let mix = s.p.wrapping_mul(167) ^ s.x.wrapping_mul(89);
    let other = mix & 0xFF;
    for at in [("sfr", ACC), ("sfr", B), ("idata", 0x45), ("idata", 0x13), ("idata", 0xC5)] {
        let value = [(p, s.p), (x, s.x)].iter().find(|(place, _)| *place == Some(at)).map_or(other, |found| found.1);
        bench.put(at.0, at.1, value as u8);
    }
    let acc = |s: State| [(p, s.p), (x, s.x)].iter().find(|f| f.0 == Some(("sfr", ACC))).map_or(other, |f| f.1);
    bench.put("sfr", PSW, psw(s, mix >> 3, acc(s)) as u8);
    let spent = bench.go();
    let wanted = reference(s);
    let pc = if wanted.jumps { TestBench::PC + 0x20 } else { bench.next() };
    let tuple = (i32::from(bench.get("sfr", PSW)), bench.cpu.pc(), spent);
    assert_eq!(tuple, (psw(wanted, mix >> 3, acc(wanted)), pc, cycles), "{name} {s:02x?}: (PSW, PC, cycles)");
    for at in [("sfr", ACC), ("sfr", B), ("idata", 0x45), ("idata", 0x13), ("idata", 0xC5)] {
        let value = [(p, wanted.p), (x, wanted.x)].iter().find(|f| f.0 == Some(at)).map_or(other, |f| f.1);
        assert_eq!(i32::from(bench.get(at.0, at.1)), value, "{name} {s:02x?}: {at:02x?}");
    }
}

/// Tests all operands of all forms, with the flag combinations that `flags` selects from the eight possible
/// ones.
fn all(groups: &[Group], flags: fn(i32, i32) -> &'static [i32]) {
    for &(template, ps, xs, cycles, reference) in groups {
        for forms in ps.chars().flat_map(|p| xs.chars().map(move |x| (p, x))) {
            let mut bench = TestBench::new(&line(template, forms.0, forms.1, 0));
            bench.put("idata", R1, 0xC5);
            // Without a second operand, two values select different backgrounds.
            let seconds: &[i32] = if forms.1 == '-' { &[0, 0x5A] } else { &ALL };
            for &x in seconds {
                let name = line(template, forms.0, forms.1, x);
                if forms.1 == 'k' {
                    bench.put_line(&name);
                }
                for (p, &pick) in (0..256).flat_map(|p| flags(p, x).iter().map(move |pick| (p, pick))) {
                    // The manual defines OV and CY of a division by zero (tested below), but not the
                    // quotient.
                    if template == "div AB" && x == 0 {
                        continue;
                    }
                    let [cy, ac, ov] = [1, 2, 4].map(|mask| pick & mask != 0);
                    let s = State { p, x, cy, ac, ov, jumps: false };
                    check(&mut bench, &name, forms, cycles, reference, s);
                }
            }
        }
    }
}

const ALL: [i32; 256] = {
    let mut all = [0; 256];
    let mut i = 0;
    while i < 256 {
        all[i] = i as i32;
        i += 1;
    }
    all
};

#[test]
fn arithmetic() {
    all(ARITHMETIC, |_, _| &[0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn logic_and_moves() {
    // They do not use flags and must not change them. Two opposite combinations per operand pair are enough;
    // which two depends on the operands.
    const PAIRS: [[i32; 2]; 4] = [[0, 7], [1, 6], [2, 5], [3, 4]];
    all(LOGIC_AND_MOVES, |p, x| &PAIRS[((p ^ x >> 2) % 4) as usize]);
}

#[test]
fn division_by_zero_sets_ov_and_clears_cy() {
    let mut bench = TestBench::new("div AB");
    for (a, flags) in (0..256).flat_map(|a| (0..8).map(move |flags| (a, flags))) {
        bench.put("sfr", ACC, a as u8);
        bench.put("sfr", B, 0);
        bench.put("sfr", PSW, (flags & 3) << 6 | (flags & 4));
        assert_eq!(bench.go(), 4);
        assert_eq!(bench.get("sfr", PSW) & 0xFE, (flags & 1) << 6 | 4, "A {a:02x}, flags {flags}");
    }
}

/// The sum of two 2-digit decimal numbers, with a carry in, is decimal after DA.
#[test]
fn decimal_sums() {
    let bcd = |n: i32| (n / 10 * 16 + n % 10) as u8;
    for (name, carries) in [("add A,B", false), ("addc A,B", true)] {
        let mut sum = TestBench::new(&name.replace("B", "0xF0"));
        let adjust = TestBench::new("da A").cpu;
        for (a, b, c) in (0..100).flat_map(|a| (0..100).flat_map(move |b| [0, 1].map(|c| (a, b, c)))) {
            sum.put("sfr", ACC, bcd(a));
            sum.put("sfr", B, bcd(b));
            sum.put("sfr", PSW, (c as u8) << 7);
            sum.go();
            let mut then = adjust.clone();
            for addr in [ACC, PSW] {
                assert!(then.poke("sfr", addr, sum.get("sfr", addr)));
            }
            then.set_pc(TestBench::PC);
            then.step(&mut ());
            let total = a + b + if carries { c } else { 0 };
            let found = (then.peek("sfr", ACC), then.peek("sfr", PSW).map(|psw| psw >> 7));
            assert_eq!(found, (Some(bcd(total % 100)), Some((total / 100) as u8)), "{name}: {a} + {b}, CY {c}");
        }
    }
}

#[test]
fn dptr_counts_through_all_its_values() {
    let mut bench = TestBench::new("inc DPTR");
    for dptr in 0..=0xFFFFu32 {
        bench.cpu.set_reg("DPTR", dptr);
        assert_eq!(bench.go(), 2);
        assert_eq!(bench.cpu.reg("DPTR"), Some((dptr + 1) % 0x1_0000), "{dptr:04x}");
    }
}
