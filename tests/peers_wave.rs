//! Waveforms compared in other readers: sigrok (Debian's sigrok-cli) and GTKWave (vcd2fst, fst2vcd). They
//! must read every signal at every time as our own reader does.
//!
//! A plain `cargo test` ignores the tests; `.ci/peers` installs the tools and runs them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use emu_test_support::test_folder;
use vcd::{Command as Line, Parser};

/// An image of `tests/cli/in`, its chip, the flags of the run, and ticks of the file per machine cycle.
const RUNS: &[(&str, &str, &[&str], u64)] = &[
    (
        "hello.hex",
        "atmega328p",
        &["--vcd-add", "r16", "--vcd-add", "TCNT1", "--vcd-add", "UDR0", "--vcd-add", "SREG.7"],
        625,
    ),
    ("timer.s", "atmega328p", &["--cycles", "500", "--vcd-add", "data:0x100", "--vcd-add", "TCNT0"], 625),
    (
        "timer51.a51",
        "at89s52",
        &["--cycles", "90", "--vcd-add", "ACC", "--vcd-add", "TL0", "--vcd-add", "bit:0x20.3"],
        1_000_000,
    ),
    (
        "press16.hex",
        "pic16f877a",
        &["--config", "0x3F39", "--set", "RA4=1", "--at", "20c:RA4=0", "--cycles", "400", "--vcd-add", "W"],
        250,
    ),
    ("and.asm", "ap101", &["--set", "I1=1", "--at", "20c:I2=1", "--cycles", "60", "--vcd-add", "A"], 2000),
];

/// Runs a program, requires exit code 0, and returns its output.
fn run(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).output().unwrap_or_else(|why| panic!("{program}: {why}"));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{program} {args:?}: {}", String::from_utf8_lossy(&output.stderr));
    text
}

/// Records a run.
fn record(folder: &Path, (image, mcu, args, _): &(&str, &str, &[&str], u64), bits: bool) -> PathBuf {
    let file = folder.join(format!("{image}.vcd"));
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/in").join(image);
    let mut all = vec!["run", image.to_str().expect("a name"), "--mcu", mcu, "--vcd", file.to_str().expect("a name")];
    all.extend_from_slice(args);
    all.extend(bits.then_some("--vcd-bits"));
    run(env!("CARGO_BIN_EXE_emu"), &all);
    file
}

/// Returns the changes of every signal by its name, and the last time.
fn changes(file: &Path) -> (BTreeMap<String, Vec<(u64, String)>>, u64) {
    let text = fs::read(file).expect("a waveform");
    let (mut names, mut all, mut now) = (BTreeMap::new(), BTreeMap::new(), 0);
    for line in Parser::new(text.as_slice()) {
        let (code, value) = match line.expect("a line of a waveform") {
            Line::VarDef(_, bits, code, name, _) => {
                names.insert(code, (name.clone(), bits as usize));
                all.insert(name, Vec::new());
                continue;
            }
            Line::Timestamp(at) => {
                now = at;
                continue;
            }
            Line::ChangeScalar(code, value) => (code, value.to_string()),
            Line::ChangeVector(code, value) => (code, value.iter().map(|bit| bit.to_string()).collect()),
            _ => continue,
        };
        let (name, bits) = &names[&code];
        let fill = if value.starts_with(['x', 'z']) { value[..1].to_owned() } else { "0".to_owned() };
        let value = fill.repeat(bits.saturating_sub(value.len())) + &value;
        let list: &mut Vec<(u64, String)> = all.get_mut(name).expect("a declared signal");
        // A change to the same value does not count; of two changes at one time, the last one counts.
        list.retain(|(at, _)| *at != now);
        if list.last().is_none_or(|(_, last)| *last != value) {
            list.push((now, value));
        }
    }
    (all, now)
}

#[test]
#[ignore = "needs sigrok-cli"]
fn sigrok_reads_the_same_bits() {
    let folder = test_folder!("peers-sigrok");
    for row in RUNS {
        let file = record(&folder, row, true);
        let (ours, end) = changes(&file);
        let input = format!("vcd:downsample={}", row.3);
        let csv = run("sigrok-cli", &["-I", &input, "-i", file.to_str().expect("a name"), "-O", "csv"]);
        let head = csv.lines().find_map(|line| line.split_once("): ").filter(|_| line.contains("Channels")));
        let names: Vec<&str> = head.expect("the names of the channels").1.split(", ").collect();
        let samples = csv.lines().filter(|line| line.starts_with(['0', '1']));
        let mut count = 0;
        for (sample, line) in samples.enumerate() {
            let at = sample as u64 * row.3;
            for (name, read) in names.iter().zip(line.split(',')) {
                let (_, list) = ours.iter().find(|(own, _)| own == name).unwrap_or_else(|| panic!("{}: {name}", row.0));
                let value = list.iter().take_while(|(when, _)| *when <= at).last().map(|(_, value)| value.as_str());
                // sigrok reads unknown values as 0.
                let value = if value == Some("1") { "1" } else { "0" };
                assert_eq!(value, read, "{}: {name} at {at}", row.0);
            }
            count += 1;
        }
        println!("{}: {count} samples of {} channels", row.0, names.len());
        assert_eq!(count, end / row.3, "{}", row.0);
        assert!(names.len() >= 20 || row.1 == "ap101", "{}: {names:?}", row.0);
    }
}

#[test]
#[ignore = "needs gtkwave (vcd2fst, fst2vcd)"]
fn gtkwave_reads_the_same_values() {
    let folder = test_folder!("peers-gtkwave");
    for row in RUNS {
        for bits in [false, true] {
            let file = record(&folder, row, bits);
            let (fst, back) = (file.with_extension("fst"), file.with_extension("back.vcd"));
            let name = |file: &Path| file.to_str().expect("a name").to_owned();
            run("vcd2fst", &[&name(&file), &name(&fst)]);
            fs::write(&back, run("fst2vcd", &["-f", &name(&fst)])).expect("written");
            let ((mut ours, _), (theirs, _)) = (changes(&file), changes(&back));
            // An event has no value; the GTKWave tools store it differently.
            ours.retain(|name, _| name != "uart0_sent");
            assert!(ours.values().map(Vec::len).sum::<usize>() > ours.len(), "{}: nothing happens", row.0);
            for (name, list) in &ours {
                assert_eq!(theirs.get(name), Some(list), "{}: {name}", row.0);
            }
        }
    }
}
