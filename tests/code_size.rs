//! Sizes and times compared with LDmicro on its own programs: the table of docs/code-size.md. `EMU_BLESS=1`
//! rewrites it.
//!
//! The programs belong to LDmicro and are not part of this repository. They are in the folder `EMU_CORPUS`,
//! by default `../shared/ld`; without the folder the page stays unchanged.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// A program on a chip, with LDmicro's bytes (releases 5.4 and 2.3, measured by running both) and mean clocks
/// per scan, where known.
struct Row {
    program: &'static str,
    mcu: &'static str,
    bytes: (u32, u32),
    clocks: Option<(u32, u32)>,
}

const fn row(program: &'static str, mcu: &'static str, new: u32, old: u32) -> Row {
    Row { program, mcu, bytes: (new, old), clocks: None }
}

#[rustfmt::skip]
const ROWS: &[Row] = &[
    row("sample-traffic",       "pic16f876",  1322, 1342),
    Row { clocks: Some((547, 1016)), ..row("sample-traffic", "atmega8", 1448, 2154) },
    row("reg-contacts",         "pic16f876",   244,  276),
    row("reg-integers",         "atmega162",  1396, 2120),
    row("reg-timers-counters",  "atmega128",  1528, 1882),
    row("sample-blink",         "pic16f877",   882,  918),
    row("sample-pic-adc",       "pic16f877",  2388, 2358),
];

const HEAD: &str = "# Size and speed beside LDmicro

Bytes are what the HEX file carries (on a PIC with the two of its configuration word), clocks the mean of a scan outside of the wait for the
timer, measured on the emulated chip by `emu check` with its default stimulus. LDmicro's figures come from running its releases 5.4.1.1 and 2.3 on
the same programs and chips; its clocks are those of its AVR code on the emulated chip, give or take 10. \"Share\" is ours
of the better of the two. The programs are LDmicro's regression tests and samples, which are not part of this repository.

The table is written by `EMU_CORPUS=folder EMU_BLESS=1 cargo test --release --test code_size`, which also fails when a share is above 50 %.

| program | chip | ours | LDmicro 5.4 | LDmicro 2.3 | share | clocks a scan, mean | LDmicro 5.4 | LDmicro 2.3 | share |
|---|---|---|---|---|---|---|---|---|---|
";

fn corpus() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/ld");
    let folder = std::env::var_os("EMU_CORPUS").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}

/// Returns the number of bytes in the data records of an Intel HEX file.
fn payload(hex: &str) -> u32 {
    let records = hex.lines().filter(|line| line.get(7..9) == Some("00"));
    records.map(|line| u32::from_str_radix(&line[1..3], 16).expect("a length")).sum()
}

#[test]
fn half_of_ldmicro() {
    let Some(folder) = corpus() else { return println!("skipped: no corpus, EMU_CORPUS names its folder") };
    let mut page = HEAD.to_owned();
    let mut above = Vec::new();
    for Row { program: name, mcu, bytes: (new, old), clocks } in ROWS {
        let text = fs::read_to_string(folder.join(format!("{name}.ld"))).expect("a program");
        let program = ladder::parse(name, &text).unwrap_or_else(|faults| panic!("{name}: {faults:?}")).program;
        let options = emu_check::CheckOptions { mcu: (*mcu).to_owned(), ..emu_check::CheckOptions::default() };
        let target =
            ladder_compile::CompileOptions { mcu: options.mcu.clone(), ..ladder_compile::CompileOptions::default() };
        let compiled = ladder_compile::compile(&program, &target).unwrap_or_else(|faults| panic!("{name}: {faults:?}"));
        let report = emu_check::check(&program, &options, &mut |_, _| {}).unwrap_or_else(|f| panic!("{name}: {f:?}"));
        assert!(report.agreed, "{}", report.text());
        let ours = payload(&compiled.hex);
        let share = |ours: f64, new: u32, old: u32| ours * 100.0 / f64::from(new.min(old));
        let bytes = share(ours.into(), *new, *old);
        _ = write!(page, "| {name} | {mcu} | {ours} | {new} | {old} | {bytes:.0} % |");
        let mean = report.figures.scan_cycles_mean;
        let time = clocks.map(|(new, old)| (new, old, share(mean, new, old)));
        _ = match time {
            Some((new, old, share)) => writeln!(page, " {mean:.0} | {new} | {old} | {share:.0} % |"),
            None => writeln!(page, " | | | |"),
        };
        if bytes > 50.0 || time.is_some_and(|(_, _, share)| share > 50.0) {
            above.push(format!("{name} on {mcu}: {bytes:.1} % of the bytes, {time:?} of the clocks"));
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/code-size.md");
    if std::env::var_os("EMU_BLESS").is_some() {
        fs::write(&path, &page).expect("the page is written");
    }
    assert!(above.is_empty(), "{above:#?}");
    assert_eq!(fs::read_to_string(&path).unwrap_or_default(), page, "EMU_BLESS=1 writes docs/code-size.md anew");
}
