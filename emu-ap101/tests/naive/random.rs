//! Random programs on the naive model and on another machine: memories, registers, counts, ends and edges of
//! outputs must be equal.
//!
//! `EMU_AP101_PROGRAMS` sets the number of programs, `EMU_AP101_SEED` the seed of the first one. A seed
//! always gives the same program.

use emu_core::rng::Rng;

use super::asm::{KINDS, UNITS};
use super::config::{BLOCK, Config, Entry, Record};
use super::core::Core;
use super::decode::OPS;
use super::machine::{End, Line, Naive, When};
use super::script::Subject;
use super::tally::Tally;

/// Number of program cycles that each program runs, unless it ends before.
const CYCLES: u64 = 100;

/// Number of machine cycles after which a program has run long enough in any case.
const LONG: u64 = 200_000;

/// A program and its inputs.
pub struct Plan {
    pub config: Option<Config>,
    pub bytes: Vec<Option<u8>>,
    pub drives: Vec<(When, Line, bool)>,
}

fn pick<T: Copy>(rng: &mut Rng, from: &[T]) -> T {
    from[rng.below(from.len() as u64) as usize]
}

/// Draws a random plan.
pub fn draw(rng: &mut Rng) -> Plan {
    let block = !rng.one_in(8);
    let mut config = Config::none();
    if block {
        settings(rng, &mut config);
        tables(rng, &mut config);
    }
    let mut present: Vec<Entry> = config.programs.iter().filter(|entry| entry.present).copied().collect();
    if present.is_empty() {
        let last = rng.below(24) as u16;
        present.push(Entry { start: 0, last, rx: 0, present: true, enabled: true });
    }
    let mut words = vec![None; 2048];
    for entry in &present {
        fill(rng, &config, entry, &mut words);
    }
    let mut bytes = vec![None; 0x1300];
    for (at, word) in words.iter().enumerate() {
        if let Some(word) = word {
            let [low, high] = u16::to_le_bytes(*word);
            (bytes[2 * at], bytes[2 * at + 1]) = (Some(low), Some(high));
        }
    }
    let longest = present.iter().map(|entry| u64::from(entry.last - entry.start)).max().unwrap_or(0);
    let turn = (longest + config.outputs as u64).max(4);
    if block && rng.one_in(2) {
        // Periods around the length of a program cycle, and long ones.
        config.period = pick(rng, &[1, turn / 2, turn - 1, turn, turn + 1, turn + 2, turn + 30, 3 * turn]);
    }
    if block {
        for (at, byte) in config.write().into_iter().enumerate() {
            bytes[BLOCK + at] = Some(byte);
        }
    }
    let drives = drives(rng, &config, turn.max(config.period) * CYCLES);
    Plan { config: block.then_some(config), bytes, drives }
}

fn settings(rng: &mut Rng, config: &mut Config) {
    config.live = rng.one_in(3);
    config.reconfigurable = rng.one_in(2);
    config.outputs = pick(rng, &[0, 1, 2, 4, 4, 8, 8, 16, 40, 256]);
    config.inputs = pick(rng, &[0, 1, 4, 8, 16, 512]);
    config.hz = pick(rng, &[1_000_000, 32_768, 999_999, 20_000, 1000, 1000, 1000, 100, 1, 3_333, 12_345]);
}

fn tables(rng: &mut Rng, config: &mut Config) {
    let count = pick(rng, &[0, 1, 1, 2, 3, 4, 8]);
    let mut start = pick(rng, &[0, 0, 0, 7, 500, 1900]);
    for number in 0..8 {
        let mut entry = Entry { start: 0, last: 0, rx: 0, present: false, enabled: rng.one_in(2) };
        if number < count && !rng.one_in(6) {
            let last = start + pick(rng, &[0, 1, 3, 7, 10, 15, 20, 25]);
            let rx = pick(rng, &[0, 1, 2, 3, 127, 128, 255, 256, 511, 2047, 1030]);
            entry = Entry { start, last, rx, present: true, enabled: !rng.one_in(3) };
            // Programs mostly follow each other; sometimes they overlap.
            start = if rng.one_in(6) { start } else { last + 1 };
        }
        config.programs[number] = entry;
    }
    for number in (0..4).chain([60, 127]) {
        let kind = rng.below(KINDS.len() as u64) as u8;
        let unit = if kind < 5 { pick(rng, &[0, 0, 1, 1, 2, 2, 3]) } else { 0 };
        let short = pick(rng, &[0, 1, 1, 2, 3, 5]);
        let preset = if rng.one_in(8) { pick(rng, &[32_767, 32_768, 65_535, 300, 40]) } else { short };
        let none = Record { kind, unit: 0, preset: 0 };
        config.modules[number] = if kind == 0 { none } else { Record { kind, unit, preset } };
    }
}

/// Fills the words of one program.
fn fill(rng: &mut Rng, config: &Config, entry: &Entry, words: &mut [Option<u16>]) {
    let mut at = entry.start;
    while at <= entry.last {
        if at + 4 <= entry.last && rng.one_in(8) {
            // A bit that toggles in each program cycle, or an input, is written to a module, and the module's
            // Q to an output.
            let (toggle, module, output) = (rng.below(4) as u16, rng.below(4) as u16, rng.below(4) as u16);
            let head = if rng.one_in(2) { [0x1600 + toggle, 0x2600 + toggle] } else { [toggle, 0xFFFF] };
            let tail = [0x2400 + module, 0x0400 + module + pick(rng, &[0, 0, 128]), 0x2200 + output];
            for word in head.into_iter().chain(tail) {
                words[usize::from(at)] = Some(word);
                at += 1;
            }
            continue;
        }
        let word = instruction(rng, config, entry, at);
        words[usize::from(at)] = Some(word);
        at += 1;
        // A write of a port is mostly followed by its data.
        if word / 4096 == 2 && word % 2048 / 128 == 10 && at <= entry.last && !rng.one_in(4) {
            words[usize::from(at)] = Some(0xF000 + pick(rng, &[0, 1, 2, 3, 7, 2047]));
            at += 1;
        }
    }
    // A hole in the program is blank memory.
    if entry.last > entry.start + 3 && rng.one_in(12) {
        words[usize::from(entry.start + 2)] = None;
    }
}

fn instruction(rng: &mut Rng, config: &Config, entry: &Entry, at: u16) -> u16 {
    if rng.one_in(25) {
        return rng.next_u64() as u16;
    }
    let name = pick(
        rng,
        &[
            "LD", "LD", "LDC", "STO", "STO", "STO", "STO", "STOC", "STOC", "STC", "RTC", "AND", "ANDC", "OR", "ORC",
            "XOR", "NOT", "CLR", "JMP", "JMPC", "NOP",
        ],
    );
    let op = OPS.iter().position(|op| op.0 == name).expect("a name") as u16 * 4096;
    let indexed = rng.one_in(5);
    let mode = if indexed { 2048 } else { 0 };
    match name {
        "NOT" | "CLR" | "NOP" => op + pick(rng, &[0, 0, 0, 5]),
        "JMP" | "JMPC" => {
            let size = u64::from(entry.last - entry.start) + 1;
            let ahead = u64::from(entry.last - at);
            let target = match rng.below(40) {
                0 => rng.below(2048) as u16,
                1 | 2 => entry.start + rng.below(size) as u16,
                3..10 => entry.start,
                _ => at + 1 + rng.below(ahead.max(1)) as u16,
            };
            // A jump forward from the last word would leave the program.
            let target = if target > entry.last && !rng.one_in(40) { entry.start } else { target % 2048 };
            op + mode + if indexed { (target + 2048 - entry.rx) % 2048 } else { target }
        }
        _ => op + mode + operand(rng, config, if indexed { entry.rx } else { 0 }),
    }
}

/// An address that mostly refers to something that exists; the index `rx` is subtracted.
fn operand(rng: &mut Rng, config: &Config, rx: u16) -> u16 {
    let few = |rng: &mut Rng, size: usize| rng.below(size as u64 + 2).min(if rng.one_in(4) { 511 } else { 7 }) as u16;
    // First address of the kind, its size, and an offset in it.
    let (base, size, place) = match rng.below(22) {
        0..4 => (0, 512, few(rng, config.inputs)),
        4..9 => (512, 256, few(rng, config.outputs) % 256),
        9..13 => (1024, 128, rng.below(4) as u16),
        13 => (1152, 128, rng.below(4) as u16),
        14 => (1280, 128, rng.below(4) as u16),
        15..19 => (1536, 256, pick(rng, &[0, 1, 2, 3, 3, 4, 248, 249, 250, 251])),
        19 => (1792, 256, few(rng, config.outputs) % 256),
        20 => (pick(rng, &[768, 1408]), 128, rng.below(128) as u16),
        _ => return rng.below(2048) as u16,
    };
    base + (place + size - rx % size) % size
}

/// Mostly inputs, then glitches, losses of the supply and cold starts.
fn drives(rng: &mut Rng, config: &Config, until: u64) -> Vec<(When, Line, bool)> {
    let mut drives = Vec::new();
    let moment = |rng: &mut Rng| (rng.below(until + 2), rng.below(2) as u8);
    for _ in 0..pick(rng, &[0, 5, 40, 200]) {
        drives.push((moment(rng), Line::Input(rng.below(config.inputs as u64 + 1).min(9) as usize), rng.one_in(2)));
    }
    for _ in 0..pick(rng, &[0, 0, 10, 60]) {
        drives.push((moment(rng), Line::Output(rng.below(config.outputs as u64 + 1).min(9) as usize), rng.one_in(2)));
    }
    for _ in 0..pick(rng, &[0, 0, 0, 1, 3]) {
        let from = moment(rng);
        let long = pick(rng, &[0, 1, 3, 50]);
        drives.push((from, Line::Power, false));
        drives.push(((from.0 + long, 1), Line::Power, true));
    }
    for _ in 0..pick(rng, &[0, 0, 0, 1, 3]) {
        let from = moment(rng);
        drives.push((from, Line::Clear, true));
        drives.push(((from.0 + pick(rng, &[0, 1, 60]), 1), Line::Clear, false));
    }
    drives.sort_by_key(|drive| drive.0);
    drives
}

/// Edges that last: two edges of an output at the same time cancel each other.
fn lasting(edges: &[(When, usize, bool)]) -> Vec<(When, usize, bool)> {
    let mut all: Vec<(When, usize, bool)> = Vec::new();
    let mut sorted = edges.to_vec();
    sorted.sort_by_key(|edge| (edge.0, edge.1));
    for edge in sorted {
        if all.last().is_some_and(|last| last.0 == edge.0 && last.1 == edge.1) {
            all.pop();
        } else {
            all.push(edge);
        }
    }
    all
}

/// The first visible difference between two machines.
fn difference<A: Subject, B: Subject>(wanted: &A, got: &B, config: &Config) -> Result<(), String> {
    let same = |what: &dyn Fn() -> String, wanted: Option<u64>, got: Option<u64>| {
        if wanted == got { Ok(()) } else { Err(format!("{}: wanted {wanted:?}, got {got:?}", what())) }
    };
    same(&|| "cycle".to_string(), Some(wanted.cycle()), Some(got.cycle()))?;
    same(&|| "instructions".to_string(), Some(wanted.instructions()), Some(got.instructions()))?;
    for name in ["A", "NA", "RIC", "RX", "PROG", "OVR"] {
        same(&|| name.to_string(), wanted.reg(name).map(u64::from), got.reg(name).map(u64::from))?;
    }
    for n in 0..config.outputs {
        same(&|| format!("pin E{n}"), Some(wanted.output(n).into()), Some(got.output(n).into()))?;
    }
    let spaces = [("i", config.inputs), ("e", config.outputs), ("m", 512), ("r", 384), ("preset", 256), ("value", 256)];
    for (space, size) in spaces {
        for at in 0..size {
            let (wanted, got) = (wanted.peek(space, at), got.peek(space, at));
            same(&|| format!("{space}:{at}"), wanted.map(u64::from), got.map(u64::from))?;
        }
    }
    Ok(())
}

/// A plan with random drives for a given program.
pub fn driven(rng: &mut Rng, bytes: Vec<Option<u8>>, config: Option<Config>, until: u64) -> Plan {
    let drives = drives(rng, config.as_ref().unwrap_or(&Config::none()), until);
    Plan { config, bytes, drives }
}

/// A change from outside for a machine without pending drives.
fn disturbance(rng: &mut Rng, config: &Config) -> Line {
    match rng.below(8) {
        0 => Line::Power,
        1 => Line::Clear,
        2 | 3 if config.outputs > 0 => Line::Output(rng.below(config.outputs.min(9) as u64) as usize),
        _ => Line::Input(rng.below(9) as usize),
    }
}

/// The machine has halted because nothing changes any more, and the model has continued. Asserts that nothing
/// has changed in the model either, and runs the machine on without halting.
fn goes_on_alike<S: Subject>(naive: &Naive, other: &mut S, until: u64) -> Result<End, String> {
    let at = other.cycle();
    if !naive.is_left_alone() {
        return Err(format!("halted at {at} with something to come"));
    }
    if let Some(edge) = naive.edges.iter().rev().find(|edge| edge.0 > (at, 0)) {
        return Err(format!("halted at {at} before {edge:?}"));
    }
    Ok(other.run_on(until))
}

/// Runs a plan on both machines and returns the first difference as an error.
pub fn compare<S: Subject>(rng: &mut Rng, plan: &Plan, tally: &mut Tally, ends: &mut Vec<End>) -> Result<(), String> {
    let config = plan.config.clone().unwrap_or_else(Config::none);
    let mut naive = Naive::new(&plan.bytes).map_err(|at| format!("the model refuses at {at:x}"))?;
    let mut other = S::make(&plan.bytes).map_err(|at| format!("refused at {at:x}"))?;
    for &(when, line, level) in &plan.drives {
        naive.drive(when, line, level);
        other.drive(when, line, level);
    }
    let mut calm = if rng.one_in(4) { 3 } else { 0 };
    loop {
        let gap = pick(rng, &[1, 2, 7, 50, 300, 2000, 20_000]);
        let until = naive.cycle + 1 + rng.below(gap);
        let end = naive.run(until);
        let mut got = other.run(until);
        if got == End::Halted && end == End::Limit {
            got = goes_on_alike(&naive, &mut other, until)?;
            tally.event("settled");
        }
        if end != got {
            return Err(format!("up to {until} wanted {end:?} at {}, got {got:?} at {}", naive.cycle, other.cycle()));
        }
        difference(&naive, &other, &config).map_err(|fault| format!("cycle {}, {end:?}: {fault}", naive.cycle))?;
        // A reset without supply is not defined.
        if end == End::Limit && rng.one_in(40) && naive.supplied() {
            let cold = rng.one_in(2);
            naive.reset(cold);
            other.reset(cold);
            continue;
        }
        if end == End::Halted && rng.one_in(2) && config.reconfigurable {
            // An idle machine can only be woken from outside.
            let at = 248 + rng.below(8) as usize;
            naive.poke_ram(at, true);
            other.poke_ram(at, true);
            continue;
        }
        if end == End::Limit && calm > 0 && naive.is_left_alone() {
            // A quiet time, and then a change for a machine that may have settled.
            calm -= 1;
            let later = naive.cycle + pick(rng, &[1500, 5000, 30_000]);
            let (when, line) = ((later + rng.below(300), rng.below(2) as u8), disturbance(rng, &config));
            let levels = if matches!(line, Line::Power | Line::Clear) { [false, true] } else { [true, true] };
            for (when, level) in [when, (when.0 + rng.below(40), 1)].into_iter().zip(levels) {
                naive.drive(when, line, level);
                other.drive(when, line, level);
            }
            continue;
        }
        if end != End::Limit || naive.tally.program_cycles() >= CYCLES || naive.cycle > LONG {
            tally.add(&naive.tally);
            ends.push(end);
            break;
        }
    }
    let (wanted, got) = (lasting(&naive.edges), lasting(&other.edges()));
    let differs = wanted.iter().zip(&got).find(|(a, b)| a != b);
    if wanted != got {
        return Err(format!("{} edges, got {}; the first that differ: {differs:?}", wanted.len(), got.len()));
    }
    Ok(())
}

/// The plan of a seed as text.
fn show(seed: u64) -> String {
    let plan = draw(&mut Rng::new(seed));
    let mut text = String::new();
    if let Some(config) = &plan.config {
        let Config { live, reconfigurable, outputs, inputs, hz, period, .. } = config;
        text += &format!(
            "live {live} reconfigurable {reconfigurable} channels {inputs},{outputs} clock {hz} period {period}\n"
        );
        for (k, entry) in config.programs.iter().enumerate().filter(|(_, entry)| entry.present || entry.enabled) {
            text += &format!("{k}: {entry:?}\n");
        }
        for (n, Record { kind, unit, preset }) in
            config.modules.iter().enumerate().filter(|(_, record)| record.kind != 0)
        {
            text += &format!("R{n} {} {} {preset}, ", KINDS[usize::from(*kind)], UNITS[usize::from(*unit)]);
        }
    }
    for at in 0..2048 {
        if let (Some(low), Some(high)) = (plan.bytes[2 * at], plan.bytes[2 * at + 1]) {
            let word = u16::from_le_bytes([low, high]);
            let decoded = super::decode::decode(word);
            text += &format!(
                "\n{at:4} {word:04x} {} {} {}",
                OPS[usize::from(word >> 12)].0,
                decoded.indexed,
                decoded.field
            );
        }
    }
    let drives: Vec<String> =
        plan.drives.iter().map(|(when, line, level)| format!("{}.{} {line:?} {level}", when.0, when.1)).collect();
    format!("{text}\n{}", drives.join(", "))
}

/// Minimum number of occurrences of each event in 1000 programs.
const FLOOR: u64 = 15;

fn many<S: Subject>() {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let programs = number("EMU_AP101_PROGRAMS").unwrap_or(if cfg!(debug_assertions) { 60 } else { 1000 });
    let first = number("EMU_AP101_SEED").unwrap_or(0xA101_0000);
    println!("{programs} programs from seed {first:#x} ({first}) on");
    let (mut tally, mut ends, mut faults) = (Tally::default(), Vec::new(), Vec::new());
    for seed in first..first + programs {
        let mut rng = Rng::new(seed);
        let plan = draw(&mut rng);
        if let Err(fault) = compare::<S>(&mut rng, &plan, &mut tally, &mut ends) {
            faults.push((seed, fault));
        }
    }
    let mut rows = tally.rows();
    let ending =
        |name: &str, is: fn(&End) -> bool| (format!("ended: {name}"), ends.iter().filter(|end| is(end)).count() as u64);
    rows.push(ending("ran to the end", |end| *end == End::Limit));
    rows.push(ending("halted", |end| *end == End::Halted));
    rows.push(ending("jump out of the program", |end| matches!(end, End::Jump { .. })));
    rows.push(ending("watchdog", |end| matches!(end, End::Watchdog { .. })));
    for (name, count) in &rows {
        println!("{count:12} {name}");
    }
    let list: Vec<String> = faults.iter().take(40).map(|(seed, fault)| format!("seed {seed}: {fault}")).collect();
    if let Some((seed, _)) = faults.first() {
        panic!("{} of {programs} differ:\n{}\n{}", faults.len(), list.join("\n"), show(*seed));
    }
    // A small number of programs need not cover everything.
    let floor = if programs < 1000 { 0 } else { programs * FLOOR / 1000 };
    let rare: Vec<_> = rows.iter().filter(|(_, count)| *count < floor).collect();
    assert!(rare.is_empty(), "occurred less than {floor} times: {rare:?}");
}

#[test]
fn random_programs_run_the_same_on_both() {
    many::<Core>();
}
