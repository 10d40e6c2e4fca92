//! All rows compared with gpsim, each from at least [`ENOUGH`] states: W, STATUS, FSR, PCLATH, all of RAM,
//! storage registers, the program counter, the return addresses on the stack, and cycles.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use emu_core::Chip;
use emu_pic16::chips::{self, FileSlot};
use emu_pic16::isa::{ROWS, disassemble};
use emu_test_support::{random_seed, test_folder};

use crate::batch::{Batch, CASES, CLRW, CORE, Case, Kind, STORAGE, batch, kinds};
use crate::drive::{View, gpsim, image, machine};

/// Minimum number of states compared per row.
const ENOUGH: u64 = 10_000;
/// Number of gpsim processes in parallel.
const WORKERS: u64 = 2;
/// OPTION, TRISA, TRISB, TRISC, which the instructions OPTION and TRIS write.
const CONTROL: &[u16] = &[0x81, 0x85, 0x86, 0x87];
const PCL: u16 = 0x02;
const STATUS: u16 = 0x03;
const INTCON: u16 = 0x0B;
const TRISA: u16 = 0x85;

/// Cases that are not compared, with the reason. Each has a line in findings.txt.
const LEFT_OUT: &[&str] = &[
    "Z, DC, C where STATUS is the destination of an instruction that sets only some of them: there it writes none (DS39582, 2.2.2.1)",
    "CLRW with bits set that do not matter: there it is not an instruction (DS33023, CLRW: 00 0001 0xxx xxxx)",
    "DECFSZ and INCFSZ of PCL: here the jump is all, there it may skip besides (sheets silent)",
    "GIE after RETFIE without an interrupt before it: there it stays clear (DS33023, RETFIE: 1 -> GIE)",
];

/// Returns which of [`LEFT_OUT`] applies to a case, whether the case is still compared in part, and which
/// bits of STATUS and INTCON are compared.
fn left_out(case: &Case) -> Option<(usize, bool, u8, u8)> {
    let row = &ROWS[case.row];
    let into_file = row.name.ends_with('F') || row.name == "Clrf";
    if into_file && case.file.is_some_and(|f| f & 0x7F == STATUS) && !matches!(row.flags, "" | "CDZ") {
        let own = if row.flags == "Z" { 0xFC } else { 0xF9 };
        return Some((0, true, own, 0xFF));
    }
    match row.name {
        "Clrw" if case.word != CLRW => Some((1, false, 0, 0)),
        "DecfszF" | "IncfszF" if case.file.is_some_and(|f| f & 0x7F == PCL) => Some((2, false, 0, 0)),
        "Retfie" if !case.gie() => Some((3, true, 0xFF, 0x7F)),
        _ => None,
    }
}

/// Returns the addresses to compare, with their bits.
fn looked_at(chip: &Chip) -> Vec<(usize, u8)> {
    let part = chips::part(chip.name).expect("a chip of the family");
    let mask = |addr: u16| match part.file_slot(addr) {
        FileSlot::Ram(_) => 0xFF,
        // The program counter is compared separately; at this address gpsim shows the address of the
        // instruction after the next one.
        _ if addr & 0x7F == PCL => 0,
        // gpsim's TRIS writes the two unimplemented bits (DS39582, table 4-2).
        _ if addr == TRISA => 0x3F,
        _ if CORE.contains(&(addr & 0x7F)) || STORAGE.contains(&addr) || CONTROL.contains(&addr) => 0xFF,
        // The three flags depend on pins and a timer.
        _ if addr & 0x7F == INTCON => 0xF8,
        _ => 0,
    };
    (0..0x200).map(|addr| (usize::from(addr), mask(addr))).filter(|(_, mask)| *mask != 0).collect()
}

/// The results of the comparison.
struct Tally {
    compared: Vec<u64>,
    left_out: Vec<Vec<u64>>,
    wrong: Vec<String>,
}

fn differences(ours: &View, theirs: &View, from: (u64, u64), looked_at: &[(usize, u8)], part: (u8, u8)) -> Vec<String> {
    let mut list = Vec::new();
    let mut note = |what: &str, ours: u64, theirs: u64| {
        if ours != theirs {
            list.push(format!("{what} {ours:02x}, gpsim {theirs:02x}"));
        }
    };
    note("cycles", ours.cycle.wrapping_sub(from.0), theirs.cycle.wrapping_sub(from.1));
    note("pc", ours.pc.into(), theirs.pc.into());
    note("W", ours.w.into(), theirs.w.into());
    for (k, (a, b)) in ours.later.iter().zip(&theirs.later).enumerate() {
        note(&format!("pc {} later", k + 1), (*a).into(), (*b).into());
    }
    for &(addr, mask) in looked_at {
        let mask = match addr as u16 & 0x7F {
            STATUS => mask & part.0,
            INTCON => mask & part.1,
            _ => mask,
        };
        let byte = |v: &View| v.data[addr].map_or(0x100, |b| u64::from(b & mask));
        note(&format!("[{addr:03x}]"), byte(ours), byte(theirs));
    }
    list
}

fn describe(case: &Case) -> String {
    let line = disassemble(&[case.word], case.site.into());
    format!(
        "{:04x} {:04x} {} from W={:02x} STATUS={:02x} FSR={:02x} PCLATH={:02x} file {:03x?} value {:02x}",
        case.site, case.word, line.text, case.w, case.status, case.fsr, case.pclath, case.file, case.value
    )
}

fn compare(batch: &Batch, ours: &[View], theirs: &[View], looked_at: &[(usize, u8)], seed: u64, tally: &mut Tally) {
    assert_eq!(ours.len(), theirs.len(), "batch {seed:#x}: views");
    let mut from = (0, 0);
    let mut views = ours.iter().zip(theirs);
    for (i, case) in batch.cases.iter().enumerate() {
        let left_out = left_out(case);
        let (any, part) = left_out.map_or((true, (0xFF, 0xFF)), |(_, any, status, intcon)| (any, (status, intcon)));
        let mut list = Vec::new();
        for _ in 0..1 + usize::from(ROWS[case.row].name == "Sleep") {
            let (ours, theirs) = views.next().expect("a view a case");
            list.extend(differences(ours, theirs, from, looked_at, part));
            from = (ours.cycle, theirs.cycle);
        }
        match left_out {
            Some((why, ..)) => tally.left_out[why][case.row] += 1,
            None => tally.compared[case.row] += 1,
        }
        if any && !list.is_empty() {
            // Memory persists from one case to the next, so later cases need not be wrong.
            tally.wrong.push(format!("batch {seed:#x}, case {i}: {}\n  {}", describe(case), list.join("\n  ")));
            return;
        }
    }
}

/// Runs batches until every row was compared often enough.
fn run(rows: &[Kind], watchdog: bool, seed: u64, tally: &Mutex<Tally>) {
    let chip = chips::chip("pic16f877a").expect("a chip of the family");
    let looked_at = looked_at(chip);
    let batches = ENOUGH * rows.len() as u64 * 114 / 100 / CASES as u64 + 1;
    let next = AtomicU64::new(0);
    let work = |folder: &Path| loop {
        let i = next.fetch_add(1, Ordering::Relaxed);
        if i >= batches || tally.lock().expect("no worker panicked").wrong.len() >= 20 {
            return;
        }
        let seed = seed.wrapping_add(i);
        let drawn = batch(chip, rows, watchdog, seed);
        let hex = drawn.hex();
        std::fs::write(folder.join("batch.hex"), &hex).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let ours = drawn.ours(&mut machine(chip, &image(chip, "batch.hex", &hex)));
        let theirs = gpsim(chip, "batch.hex", &drawn.script(), folder);
        compare(&drawn, &ours, &theirs, &looked_at, seed, &mut tally.lock().expect("no worker panicked"));
    };
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
            let (work, folder) = (&work, test_folder!(&format!("gpsim-{worker}-{watchdog}")));
            scope.spawn(move || work(&folder));
        }
    });
}

#[test]
#[ignore = "needs gpsim"]
fn all_rows_beside_gpsim() {
    let seed = random_seed();
    println!("EMU_SEED {seed:#x}");
    let rows = kinds();
    let none = || vec![0; ROWS.len()];
    let tally = Mutex::new(Tally { compared: none(), left_out: vec![none(); LEFT_OUT.len()], wrong: Vec::new() });
    let (asleep, awake): (Vec<Kind>, Vec<Kind>) = rows.iter().partition(|k| ROWS[k.row].name == "Sleep");
    run(&awake, false, seed, &tally);
    // In addition to SLEEP with a wake by the watchdog, CLRWDT after a wake.
    let dog: Vec<Kind> = rows.iter().copied().filter(|k| ROWS[k.row].name == "Clrwdt").chain(asleep).collect();
    run(&dog, true, seed, &tally);
    let tally = tally.into_inner().expect("no worker panicked");
    assert!(tally.wrong.is_empty(), "{} differ:\n{}", tally.wrong.len(), tally.wrong.join("\n"));
    println!("compared: {} states of {} rows", tally.compared.iter().sum::<u64>(), ROWS.len());
    for (why, counts) in LEFT_OUT.iter().zip(&tally.left_out) {
        println!("left out in {} states: {why}", counts.iter().sum::<u64>());
    }
    let few: Vec<String> = (0..ROWS.len())
        .filter(|&row| tally.compared[row] < ENOUGH)
        .map(|row| format!("{}: {}", ROWS[row].name, tally.compared[row]))
        .collect();
    assert!(few.is_empty(), "rows compared in fewer than {ENOUGH} states: {few:?}");
}
