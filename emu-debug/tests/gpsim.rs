//! gpsim's own regression tests for chips of the PIC16 family, executed here. Their sources are not part of
//! this project: `tests/peers/gpsim/regression.sh` fetches and assembles them. `regression.txt` next to it
//! lists the result of each.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::{ElfMachine, SimulatorMessage, SymbolFile, SymbolSpaces, load, load_messages, load_symbols};
use emu_debug::AddressNames;
use emu_debug::cod::{CodRunLimits, CodScript, CodVerdict, run_script};
use emu_pic16::{Options, Pic16, chips};
use emu_test_support::case_lines;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/peers/gpsim");

/// Machine cycles after which a program is given up; the longest passing one needs 10 million.
const CYCLES: u64 = 30_000_000;

/// LVP in the configuration words of the chips that have it.
const LVP: u16 = 1 << 7;

/// How a program is run.
#[derive(Default)]
struct Settings {
    /// LVP is off, whatever the program sets.
    lvp_off: bool,
    /// Oscillator frequency in Hz if the program does not set it.
    hz: Option<u64>,
    /// Assertions to skip: those with one of these texts.
    but: Vec<String>,
}

impl Settings {
    /// Parses `lvp off`, `hz N`, `but TEXT`, separated by semicolons.
    fn read(text: &str) -> Settings {
        let mut settings = Settings::default();
        for item in text.split(';').map(str::trim).filter(|item| !item.is_empty() && *item != "-") {
            match item.split_once(' ') {
                Some(("lvp", "off")) => settings.lvp_off = true,
                Some(("hz", hz)) => settings.hz = hz.parse().ok(),
                Some(("but", text)) => settings.but.push(text.to_owned()),
                _ => panic!("`{item}` is not a setting"),
            }
        }
        settings
    }
}

/// Returns the commands of a test with a command file of its own, as messages for the start. Commands that
/// load the program are left out.
fn commands(text: &str) -> Vec<SimulatorMessage> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("load "));
    lines.map(|text| SimulatorMessage { addr: 0, kind: 'e', text: text.to_owned() }).collect()
}

/// Runs a program; returns how it ended, in a line without the time.
fn ends(dir: &Path, name: &str, chip: &str, settings: &Settings) -> String {
    let bytes = |kind| {
        let path = dir.join(format!("{name}.{kind}"));
        std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    };
    let chip = &chips::part(chip).unwrap_or_else(|| panic!("{name}: no chip {chip}")).chip;
    let (cod, hex) = (bytes("cod"), bytes("hex"));
    let file = SymbolFile { name, bytes: &cod };
    let symbols = load_symbols(&[file], SymbolSpaces::PIC16).unwrap().symbols;
    let mut messages = load_messages(&file).unwrap();
    if let Ok(text) = std::fs::read_to_string(dir.join(format!("{name}.stc"))) {
        messages.extend(commands(&text));
    }
    for text in &settings.but {
        let all = messages.len();
        messages.retain(|message| !matches!(message.kind, 'a' | 'A') || !message.text.contains(text.as_str()));
        assert!(messages.len() < all, "{name}: no assertion says {text}");
    }
    let script = match CodScript::read(&messages) {
        Ok(script) => script,
        Err(refused) => return format!("refused: {}", refused[0].cause),
    };
    let image = load(name, &hex, chip.hex_spaces, chip.elf_spaces, ElfMachine(0)).unwrap().image;
    let hz = script.frequency().or(settings.hz).unwrap_or(20_000_000);
    let mut words = [0xFF; 16];
    image.fill("config", &mut words);
    let config = u16::from_le_bytes([words[14], words[15]]) & !LVP;
    let config = settings.lvp_off.then_some(config);
    let options = Options { hz, config, start_up: false, ideal_acquisition: true, ..Options::default() };
    let mut cpu = Pic16::with(chip, &image, RamInit::Zero, options);
    let (names, limits) = (AddressNames { chip, symbols: &symbols }, CodRunLimits { cycle: CYCLES, hz });
    let outcome = run_script(&mut cpu, &script, names, limits, &mut |cpu, at, pin, millivolts| {
        cpu.drive_volts(at, pin, millivolts.clamp(0, 1 << 20) as u32);
    });
    match outcome.verdict {
        verdict if verdict.passed() => "passes".to_owned(),
        CodVerdict::Message { text, .. } => format!("says {text}"),
        CodVerdict::Refused(refused) => format!("refused: {}", refused.cause),
        CodVerdict::Limit { .. } => "does not end".to_owned(),
        CodVerdict::Halted { .. } => "halts".to_owned(),
        other => format!("{other:?}"),
    }
}

/// Prints a text even if the test passes, when normal output is captured.
fn say(text: &str) {
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}

/// Builds the programs in a folder of its own; returns their names and chips, or nothing if the sources are
/// not available.
fn build(dir: &Path) -> Vec<(String, String)> {
    std::fs::create_dir_all(dir).unwrap();
    let ours = chips::PIC16_PARTS.iter().map(|part| part.chip.name);
    let mut command = Command::new(format!("{FOLDER}/regression.sh"));
    let done = command.arg(dir).args(ours).output().expect("bash");
    say(&format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr)));
    assert!(done.status.success());
    let list = std::fs::read_to_string(dir.join("list.txt")).unwrap();
    list.lines().filter_map(|line| line.split_once(' ')).map(|(a, b)| (a.to_owned(), b.to_owned())).collect()
}

#[test]
#[ignore = "fetches the source package of gpsim; needs gputils"]
fn gpsims_own_tests_end_as_the_table_says() {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gpsim");
    let programs = build(&dir);
    if programs.is_empty() {
        return;
    }
    let text = std::fs::read_to_string(format!("{FOLDER}/regression.txt")).unwrap();
    let mut wrong = Vec::new();
    let mut counts = [0; 4];
    let mut rows = 0;
    for line in case_lines(&text) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let &[name, settings, wanted, why] = cells.as_slice() else { panic!("{line}") };
        rows += 1;
        let Some((_, chip)) = programs.iter().find(|(known, _)| known == name) else {
            wrong.push(format!("{name} was not built"));
            continue;
        };
        assert_eq!(why.is_empty(), settings == "-" && wanted == "passes", "{name}: a reason says why it does not pass");
        let ended = ends(&dir.join("tests"), name, chip, &Settings::read(settings));
        if ended != wanted {
            wrong.push(format!("{name}: {ended}, wanted {wanted}"));
        }
        counts[match (wanted, settings) {
            ("passes", "-") => 0,
            ("passes", _) => 1,
            _ if wanted.starts_with("refused:") => 3,
            _ => 2,
        }] += 1;
    }
    for (name, _) in &programs {
        if !text.lines().any(|line| line.split('|').next().is_some_and(|cell| cell.trim() == name)) {
            wrong.push(format!("{name} is not in the table"));
        }
    }
    let [pass, with, differ, refused] = counts;
    say(&format!(
        "{rows} tests of gpsim: {pass} pass, {with} pass but for what the table says, {differ} end otherwise, \
         {refused} are refused\n"
    ));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
