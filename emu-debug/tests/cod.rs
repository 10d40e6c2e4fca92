//! Self-checking programs, and messages written by hand, on a PIC16F873.

use std::sync::OnceLock;

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::{
    ElfMachine, Image, Segment, SimulatorMessage, SymbolAt, SymbolFile, SymbolSpaces, load, load_messages, load_symbols,
};
use emu_debug::AddressNames;
use emu_debug::cod::{CodOutcome, CodRunLimits, CodScript, CodVerdict, run_script};
use emu_pic16::{Options, Pic16};
use emu_test_support::case_lines;

const DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cod");

fn chip() -> &'static Chip {
    &emu_pic16::chips::part("pic16f873").unwrap().chip
}

fn machine(image: &Image, hz: u64) -> Pic16 {
    let options = Options { hz, start_up: false, ..Options::default() };
    Pic16::with(chip(), image, RamInit::Zero, options)
}

/// Runs the program in `DIR/name.hex` with the messages in `DIR/name.cod`.
fn program(dir: &str, name: &str) -> CodOutcome {
    let bytes = |kind| {
        let path = format!("{dir}/{name}.{kind}");
        std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"))
    };
    let (cod, hex) = (bytes("cod"), bytes("hex"));
    let file = SymbolFile { name, bytes: &cod };
    let symbols = load_symbols(&[file], SymbolSpaces::PIC16).unwrap().symbols;
    let script = CodScript::read(&load_messages(&file).unwrap()).unwrap();
    let image = load(name, &hex, chip().hex_spaces, chip().elf_spaces, ElfMachine(0)).unwrap().image;
    let hz = script.frequency().unwrap_or(20_000_000);
    let names = AddressNames { chip: chip(), symbols: &symbols };
    run_script(&mut machine(&image, hz), &script, names, CodRunLimits { cycle: 10_000_000, hz }, &mut |_, _, _, _| {})
}

#[test]
fn programs_pass() {
    for (name, least) in
        [("assertions", 16), ("resistors", 10), ("gates", 21), ("switch", 6), ("pulses", 12), ("eeprom", 10)]
    {
        let outcome = program(DIR, name);
        assert!(outcome.verdict.passed(), "{name}: {outcome:?}");
        assert!(outcome.assertions_checked >= least, "{name}: {outcome:?}");
    }
}

/// Returns a machine at 4 MHz whose program is NOP.
fn nops() -> Pic16 {
    static NOPS: OnceLock<Pic16> = OnceLock::new();
    let segment = Segment { space: "flash", addr: 0, bytes: vec![0; 0x2000] };
    let image = Image { segments: vec![segment], ..Image::default() };
    NOPS.get_or_init(|| machine(&image, 4_000_000)).clone()
}

/// Runs messages over words of NOP, with the names of the table of expressions.
fn messages(messages: &[Said], cycle: u64) -> Result<CodOutcome, String> {
    let message = |&(addr, kind, text): &Said| SimulatorMessage { addr, kind, text: text.to_owned() };
    let script = CodScript::read(&messages.iter().map(message).collect::<Vec<_>>());
    let script = script.map_err(|refused| refused[0].to_string())?;
    let symbol = |name: &str, space, addr| SymbolAt::new(name, space, addr, 0);
    let symbols = [symbol("done", "flash", 10), symbol("count", "data", 0x20)];
    let names = AddressNames { chip: chip(), symbols: &symbols };
    let mut cpu = nops();
    Ok(run_script(&mut cpu, &script, names, CodRunLimits { cycle, hz: 4_000_000 }, &mut |_, _, _, _| {}))
}

#[test]
fn expressions_have_their_values() {
    let text = std::fs::read_to_string(format!("{DIR}/expressions.txt")).unwrap();
    for line in case_lines(&text) {
        let (expression, wanted) = line.rsplit_once(" | ").unwrap();
        let assertion = format!("{expression}, 'it is false'");
        let found = match messages(&[(0, 'a', &assertion), (1, 'a', "'end'")], 10) {
            Err(_) => "refused",
            Ok(outcome) => match outcome.verdict {
                CodVerdict::Refused(_) => "refused",
                CodVerdict::Message { pc: 0, .. } => "false",
                CodVerdict::Message { pc: 1, .. } => "true",
                other => panic!("{line}: {other:?}"),
            },
        };
        assert_eq!(found, wanted, "{line}");
    }
}

/// A message: program word, kind, text.
type Said<'t> = (u32, char, &'t str);

/// Returns the location where the run ends, and its text: `text@pc:cycle`.
fn ends(list: &[Said]) -> String {
    match messages(list, 100) {
        Err(refused) => refused,
        Ok(CodOutcome { verdict: CodVerdict::Message { text, pc, cycle, .. }, .. }) => format!("{text}@{pc}:{cycle}"),
        Ok(CodOutcome { verdict: CodVerdict::Limit { cycle }, .. }) => format!("limit {cycle}"),
        Ok(CodOutcome { verdict: CodVerdict::Refused(refused), .. }) => refused.to_string(),
        Ok(other) => format!("{other:?}"),
    }
}

#[test]
fn messages_do_what_they_say() {
    let cases: &[(&[Said], &str)] = &[
        (&[(3, 'a', "'stop'")], "stop@3:3"),
        (&[(3, 'A', "\"*** PASSED\"")], "*** PASSED@3:3"),
        (&[(3, 'a', "")], "@3:3"),
        (&[(3, 'a', ",'text after a comma'")], "text after a comma@3:3"),
        (&[(2, 'a', "cycles == 2"), (3, 'a', "cycles == 2")], "does not hold: cycles == 2@3:3"),
        (&[], "limit 100"),
        (&[(0, 'e', "break c 0x20")], "limit 32"),
        (&[(0, 'e', "break c 200")], "limit 100"),
        (&[(0, 'x', "what ever")], "limit 100"),
        // Before and after the instruction.
        (&[(2, 'C', "count = cycles"), (3, 'a', "count != 2, 'two'")], "two@3:3"),
        (&[(2, 'c', "count = cycles"), (3, 'a', "count != 3, 'three'")], "three@3:3"),
        (&[(0, 'e', "symbol n=1"), (2, 'C', "n = n + 1"), (3, 'a', "n != 2, 'two'")], "two@3:3"),
        (&[(0, 'e', "count = 5"), (1, 'a', "count != 5, 'five'")], "five@1:1"),
        (
            &[(0, 'e', "echo # anything"), (0, 'e', "# a comment"), (0, 'e', "x.xpos = 3.0"), (9, 'a', "'end'")],
            "end@9:9",
        ),
        (&[(0, 'e', "reg(0x21) = 5"), (1, 'a', "reg(0x21) != 5, 'five'")], "five@1:1"),
        (
            &[
                (
                    0,
                    'e',
                    "stimulus asynchronous_stimulus initial_state 0 start_cycle 2 period 0 { 3, 1, 50, 0 } name s end",
                ),
                (0, 'e', "node n"),
                (0, 'e', "attach n s portb1"),
                (4, 'a', "(portb & 2) == 0, 'too soon'"),
                (8, 'a', "(portb & 2) == 0, 'high'"),
            ],
            "high@8:8",
        ),
        (
            &[(0, 'e', "stimulus asynchronous_stimulus")],
            "message e at 0x0000, `stimulus asynchronous_stimulus`: a stimulus without its end",
        ),
        (&[(0, 'e', "frequency 0")], "message e at 0x0000, `frequency 0`: a clock of 0 Hz"),
        (&[(0, 'e', ".frequency = 0")], "message e at 0x0000, `.frequency = 0`: a clock of 0 Hz"),
        (&[(0, 'e', "run")], "message e at 0x0000, `run`: `run` is not carried out"),
        (
            &[(0, 'e', "module load lcd l")],
            "message e at 0x0000, `module load lcd l`: there is no model of the module `lcd`",
        ),
        (&[(0, 'e', "attach n portb0")], "message e at 0x0000, `attach n portb0`: there is no node `n`"),
        (
            &[(0, 'e', "node n"), (0, 'e', "attach n portz0")],
            "message e at 0x0000, `attach n portz0`: there is no pin `portz0`",
        ),
        (&[(4, 'C', "nothing = 1")], "message C at 0x0004, `nothing = 1`: there is nothing called `nothing`"),
        (
            &[(0, 'e', "module load pulldown p"), (0, 'e', "p.voltage = 'x'")],
            "message e at 0x0000, `p.voltage = 'x'`: `p.voltage` cannot be set to that",
        ),
    ];
    for (list, wanted) in cases {
        assert_eq!(ends(list), *wanted, "{list:?}");
    }
}

/// A pulse on an input begins exactly at its cycle, whatever the program does at the time.
#[test]
fn pulses_come_at_their_cycle() {
    for at in 1..40u32 {
        let set = format!("p.set = {at}");
        let level = |cycle: u32| format!("(portb & 1) == {}, 'at {cycle}'", u8::from(cycle >= at));
        let levels: Vec<String> = (0..60).map(level).collect();
        let mut list: Vec<Said> = vec![
            (0, 'e', "module load pulsegen p"),
            (0, 'e', "p.clear = 0"),
            (0, 'e', &set),
            (0, 'e', "node n"),
            (0, 'e', "attach n p.pin portb0"),
        ];
        list.extend(levels.iter().enumerate().map(|(cycle, level)| (cycle as u32, 'a', level.as_str())));
        list.push((60, 'a', "'end'"));
        assert_eq!(ends(&list), "end@60:60");
    }
}

/// In reset no time passes for the chip, and not every event of the bench changes something: the chip starts
/// when its reset pin actually goes high.
#[test]
fn a_chip_held_in_reset_waits_for_the_bench() {
    let list: &[Said] = &[
        (0, 'e', "module load pulsegen p"),
        (0, 'e', "p.initial = 5"),
        (0, 'e', "p.clear = 10"),
        (0, 'e', "p.clear = 20"),
        (0, 'e', "p.set = 50"),
        (0, 'e', "node n"),
        (0, 'e', "attach n p.pin mclr"),
        (3, 'a', "cycles < 20, 'again'"),
    ];
    assert_eq!(ends(list), "again@3:53");
}

/// Two pins of the chip hold one wire low. The release of the first is not visible on a pin, but the second
/// then frees the wire.
#[test]
fn a_wire_is_free_when_the_last_lets_go() {
    // BSF STATUS, RP0; CLRF TRISB; MOVLW and MOVWF TRISB twice; BCF STATUS, RP0.
    for (first, second) in [(0xFD, 0xFF), (0xFE, 0xFF)] {
        let words: [u16; 10] = [0x1683, 0x0186, 0x3000 | first, 0x0086, 0, 0x3000 | second, 0x0086, 0x1283, 0, 0];
        let segment = Segment { space: "flash", addr: 0, bytes: words.iter().flat_map(|w| w.to_le_bytes()).collect() };
        let image = Image { segments: vec![segment], ..Image::default() };
        let message = |&(addr, kind, text): &Said| SimulatorMessage { addr, kind, text: text.to_owned() };
        let list: [Said; 7] = [
            (0, 'e', "module load pullup p"),
            (0, 'e', "node n"),
            (0, 'e', "attach n p.pin portb0 portb1"),
            (3, 'a', "(portb & 3) == 0, 'both pull'"),
            (5, 'a', "(portb & 3) == 0, 'one pulls'"),
            (8, 'a', "(portb & 3) == 3, 'none pulls'"),
            (9, 'a', "'end'"),
        ];
        let script = CodScript::read(&list.iter().map(message).collect::<Vec<_>>()).unwrap();
        let limits = CodRunLimits { cycle: 100, hz: 4_000_000 };
        let names = AddressNames { chip: chip(), symbols: &[] };
        let outcome = run_script(&mut machine(&image, 4_000_000), &script, names, limits, &mut |_, _, _, _| {});
        assert!(matches!(&outcome.verdict, CodVerdict::Message { text, .. } if text == "end"), "{outcome:?}");
    }
}

/// All voltages are reported to a chip with analog inputs.
#[test]
fn voltages_are_reported() {
    let list = [
        (0, "module load pullup v"),
        (0, "v.voltage = 1.5"),
        (0, "node n"),
        (0, "attach n v.pin porta0"),
        (4, "v.voltage = 3.25"),
    ];
    let kind = |addr| if addr == 0 { 'e' } else { 'C' };
    let list: Vec<SimulatorMessage> = list
        .map(|(addr, text)| SimulatorMessage { addr, kind: kind(addr), text: text.to_owned() })
        .into_iter()
        .collect();
    let script = CodScript::read(&list).unwrap();
    let names = AddressNames { chip: chip(), symbols: &[] };
    let mut driven = Vec::new();
    let mut cpu = nops();
    let limits = CodRunLimits { cycle: 10, hz: 4_000_000 };
    run_script(&mut cpu, &script, names, limits, &mut |cpu, at, pin, millivolts| {
        driven.push((cpu.chip().pins[usize::from(pin)].name, at.cycle, millivolts));
    });
    assert_eq!(driven, [("RA0", 0, 1500), ("RA0", 4, 3250)]);
}

/// The programs of `tests/peers/cod`, assembled again, pass in gpsim and here.
#[test]
#[ignore = "needs gputils and gpsim"]
fn programs_pass_in_gpsim_too() {
    let sources = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/peers/cod");
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("cod");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("run.stc"), "load STC\nrun\nquit\n").unwrap();
    let call = |program: &str, args: &[&str]| {
        let mut command = std::process::Command::new(program);
        command.args(args).current_dir(&folder).stdin(std::process::Stdio::null());
        let done = command.output().unwrap_or_else(|e| panic!("{program}: {e}"));
        format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr))
    };
    let mut count = 0;
    for entry in std::fs::read_dir(sources).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    for entry in std::fs::read_dir(sources).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        if path.extension().is_none_or(|kind| kind != "asm") {
            continue;
        }
        call("gpasm", &["-w", "2", "-c", &format!("{name}.asm")]);
        call("gplink", &["-w", "-o", &format!("{name}.hex"), &format!("{name}.o")]);
        let theirs = call("gpsim", &["-i", "-I", "run.stc", "-D", &format!("STC={name}.cod")]);
        assert!(theirs.contains(&format!("*** PASSED {name}")), "{name}: {theirs}");
        let ours = program(folder.to_str().unwrap(), name);
        assert!(ours.verdict.passed(), "{name}: {ours:?}");
        count += 1;
    }
    assert!(count >= 7);
}
