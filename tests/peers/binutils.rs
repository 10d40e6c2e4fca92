//! The instruction table compared with GNU binutils: its assembler on every row, its disassembler on every
//! word.

use std::fmt::Write;
use std::path::Path;

use emu_avr::isa::{AvrOpKind, KINDS, PC_MASK, ROWS, disassemble, encode, is_missing};
use emu_core::rng::Rng;
use emu_core::table::{BitPattern, InstructionLocation, InstructionRow};
use emu_test_support::case_lines;
use emu_test_support::{random_seed, run_tool, test_folder};

/// Maximum number of instructions per row; a row with fewer forms is tested completely.
const MOST: u32 = 4_096;
/// Byte address of the first instruction, high enough that no relative target is below 0.
const START: u32 = 0x2000;

/// Intended differences from avr-objdump, each with its reason.
const DIFFERENCES: &str = include_str!("../golden/avr-objdump.txt");

/// Returns the operand values, in row order, of a row whose fields hold `raw`.
fn values(row: &InstructionRow, raw: u32, pc: u32) -> Vec<i32> {
    let site = InstructionLocation { pc, len: row.len(), next_len: 1, pc_mask: PC_MASK };
    let mut rest = raw;
    let mut bits = row.pattern.value;
    for slot in row.operands.iter().filter(|s| row.pattern.has_letter(s.letter)) {
        let width = row.pattern.extract_field(slot.letter, 0).width;
        bits |= row.pattern.insert_field(slot.letter, rest & ((1 << width) - 1));
        rest >>= width;
    }
    row.operands
        .iter()
        .zip(row.operand_values(bits, &site))
        .filter(|(s, _)| row.pattern.has_letter(s.letter))
        .map(|(_, v)| v)
        .collect()
}

/// Returns the instruction of a row in GNU assembler syntax: registers by name, numbers in decimal, relative
/// targets from `.`.
fn gas(row: &InstructionRow, values: &[i32], pc: u32) -> String {
    let mut text = format!("{} ", row.mnemonic);
    let slots: Vec<_> = row.operands.iter().filter(|s| row.pattern.has_letter(s.letter)).zip(values).collect();
    for c in row.syntax.bytes() {
        let Some(&(slot, &value)) = slots.iter().find(|(s, _)| s.letter == c) else {
            text.push(c as char);
            continue;
        };
        let width = row.pattern.extract_field(slot.letter, 0).width;
        let _ = match slot.kind.name {
            name if name.starts_with("register") => write!(text, "r{value}"),
            "target" if width < 16 => write!(text, ".{:+}", (value - pc as i32 - 1) * 2),
            "target" => write!(text, "{}", value * 2),
            _ => write!(text, "{value}"),
        };
    }
    text
}

/// Returns the raw operand fields to try: all of them, or the edges and random ones.
fn fields(row: &InstructionRow, rng: &mut Rng) -> Vec<u32> {
    let width: u32 = row.operands.iter().map(|s| row.pattern.extract_field(s.letter, 0).width).sum();
    if 1 << width <= MOST {
        return (0..1 << width).collect();
    }
    let edges = (0..width).flat_map(|b| [1 << b, (1 << b) - 1, ((1u64 << width) - 1 - (1 << b)) as u32]);
    edges.chain((0..MOST / 2).map(|_| rng.below(1 << width) as u32)).collect()
}

/// Assembles and links with the GNU tools, and returns the words from `START`.
fn assembled(name: &str, kind: AvrOpKind, text: &str, dir: &Path) -> Vec<u16> {
    let core = if is_missing(2 * (PC_MASK + 1), kind) { "avr51" } else { "avr5" };
    std::fs::write(dir.join(format!("{name}.s")), text).expect("a source");
    let file = |end: &str| format!("{name}.{end}");
    run_tool("avr-as", &[&format!("-mmcu={core}"), &file("s"), "-o", &file("o")], dir);
    let start = format!("-Ttext={START:#x}");
    run_tool(
        "avr-ld",
        &["-m", core, "--no-relax", "--defsym=__heap_end=0", &start, &file("o"), "-o", &file("elf")],
        dir,
    );
    run_tool("avr-objcopy", &["-O", "binary", "-j", ".text", &file("elf"), &file("bin")], dir);
    let bytes = std::fs::read(dir.join(file("bin"))).expect("the code");
    bytes.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
}

#[test]
#[ignore = "needs binutils-avr: .ci/peers installs it"]
fn the_gnu_assembler_encodes_every_row_as_we_do() {
    let dir = test_folder!("gas");
    let seed = random_seed();
    let mut rng = Rng::new(seed);
    let mut all = 0;
    for (row, &kind) in ROWS.iter().zip(KINDS) {
        let mut text = String::new();
        let mut wanted: Vec<(u16, String)> = Vec::new();
        for raw in fields(row, &mut rng) {
            let pc = START / 2 + wanted.len() as u32;
            let mut values = values(row, raw, pc);
            if matches!(kind, AvrOpKind::Jmp | AvrOpKind::Call) {
                values[0] &= PC_MASK as i32;
            }
            let line = gas(row, &values, pc);
            let words = encode(kind, &values, pc).unwrap_or_else(|e| panic!("{line}: {e}"));
            wanted.extend(words.iter().map(|&w| (w, line.clone())));
            text += &line;
            text.push('\n');
            all += 1;
        }
        let found = assembled(row.name, kind, &text, &dir);
        assert_eq!(found.len(), wanted.len(), "{}: words", row.name);
        for (found, (word, line)) in found.iter().zip(&wanted) {
            assert_eq!(found, word, "seed {seed:#x}: {line}: avr-as {found:04x}, ours {word:04x}");
        }
    }
    println!("{all} instructions of {} rows", ROWS.len());
}

/// Parses a number as both disassemblers write it.
fn number(text: &str) -> Option<i32> {
    emu_debug::address_names::parse_number(text).and_then(|number| i32::try_from(number).ok())
}

/// Normalises operands of both sides: no spaces, numbers in decimal, targets relative to the next
/// instruction.
fn normal(mnemonic: &str, operands: &str, pc: u32, relative: bool) -> String {
    let piece = |text: &str| -> String {
        let text = text.trim();
        if let Some((pointer, q)) = text.split_once('+').filter(|(p, q)| !p.is_empty() && *p != "." && !q.is_empty()) {
            return format!("{pointer}+{}", number(q).unwrap_or(-1));
        }
        match number(text) {
            Some(target) if relative => {
                let words = (target / 2 - pc as i32 - 1).rem_euclid(PC_MASK as i32 + 1);
                format!(".{:+}", if words > PC_MASK as i32 / 2 { words - PC_MASK as i32 - 1 } else { words } * 2)
            }
            Some(value) => value.to_string(),
            None => text.to_owned(),
        }
    };
    let operands: Vec<String> = operands.split(',').map(piece).collect();
    format!("{mnemonic} {}", operands.join(",")).trim().to_owned()
}

/// A line of the list: pattern, mnemonic of avr-objdump, our mnemonic, reason.
struct Difference {
    pattern: BitPattern,
    theirs: &'static str,
    ours: &'static str,
}

fn differences() -> Vec<Difference> {
    let lines = case_lines(DIFFERENCES);
    lines
        .map(|line| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let [pattern, theirs, ours, reason] = columns[..] else { panic!("four columns are wanted: {line}") };
            assert!(!reason.is_empty(), "a reason is wanted: {line}");
            Difference { pattern: BitPattern::parse(pattern, 16), theirs, ours }
        })
        .collect()
}

/// Every first word, followed by a word that is an operand for some instructions and an instruction (`cpse
/// r3, r20`) for the others.
#[test]
#[ignore = "needs binutils-avr: .ci/peers installs it"]
fn the_gnu_disassembler_reads_every_word_as_we_do() {
    const SECOND: u16 = 0x1234;
    let dir = test_folder!("objdump");
    let bytes: Vec<u8> = (0..=0xFFFFu16).flat_map(|w| [w, SECOND]).flat_map(u16::to_le_bytes).collect();
    std::fs::write(dir.join("all.bin"), bytes).expect("all.bin");
    let listing = run_tool("avr-objdump", &["-D", "-z", "-b", "binary", "-m", "avr:5", "all.bin"], &dir).stdout;
    let listing = String::from_utf8_lossy(&listing);
    let differences = differences();
    let mut used = vec![0usize; differences.len()];
    let mut unexplained = Vec::new();
    let mut seen = 0u32;
    for line in listing.lines() {
        let mut columns = line.split('\t');
        let (Some(addr), Some(_), Some(mnemonic)) = (columns.next(), columns.next(), columns.next()) else { continue };
        let Some(addr) = addr.trim().strip_suffix(':').and_then(|a| u32::from_str_radix(a, 16).ok()) else { continue };
        if addr % 4 != 0 {
            continue;
        }
        seen += 1;
        let word = (addr / 4) as u16;
        let theirs = normal(mnemonic.trim(), columns.next().filter(|c| !c.starts_with(';')).unwrap_or(""), 0, false);
        let pc = (addr / 2) & PC_MASK;
        let text = disassemble(&[word, SECOND], pc);
        let text = text.text.split(';').next().unwrap_or("").trim().to_owned();
        let (ours, operands) = text.split_once(' ').unwrap_or((&text, ""));
        let relative = ours.starts_with("br") && ours != "break" || ours == "rjmp" || ours == "rcall";
        let both = (theirs, normal(ours, operands, pc, relative));
        if both.0 == both.1 {
            continue;
        }
        let explains = |d: &Difference| {
            d.pattern.matches(word.into()) && both.0.split(' ').next() == Some(d.theirs) && ours == d.ours
        };
        match differences.iter().position(explains) {
            Some(n) => used[n] += 1,
            None => unexplained.push(format!("{word:04x}: objdump `{}`, ours `{}`", both.0, both.1)),
        }
    }
    assert_eq!(seen, 0x1_0000, "lines of avr-objdump understood");
    let shown = &unexplained[..unexplained.len().min(40)];
    assert!(unexplained.is_empty(), "{} unexplained:\n{}", unexplained.len(), shown.join("\n"));
    for (d, n) in differences.iter().zip(&used) {
        assert!(*n > 0, "no word is read as {} there and {} here any more", d.theirs, d.ours);
    }
    println!("65536 words, {} of them read differently for the reasons listed", used.iter().sum::<usize>());
}
