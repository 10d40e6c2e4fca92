//! Tests round trips of the test programs, and of LDmicro's own programs if they are available.

use crate::common;
use std::path::{Path, PathBuf};

use ladder::{ProgramElement, parse, write};

/// The words of each line that is neither blank nor a remark.
fn words(text: &str) -> Vec<Vec<&str>> {
    let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with(';'));
    lines.map(|l| l.split_whitespace().collect()).collect()
}

fn round_trip(name: &str, text: &str) {
    let program =
        parse(name, text).unwrap_or_else(|e| panic!("{name}: {}", common::diagnostic_codes(&e).join(" "))).program;
    let written = write(&program);
    assert_eq!(words(&written), words(text), "{name}");
    let again = parse(name, &written).unwrap_or_else(|e| panic!("{name}, written: {e:?}")).program;
    // The written text has its own layout; writing it once more shows that nothing else differs.
    assert_eq!(write(&again), written, "{name}");
    let elements = |p: &ladder::LadderProgram| {
        p.elements().map(|ProgramElement { id, element: e, .. }| (id, e.clone())).collect::<Vec<_>>()
    };
    assert_eq!(elements(&again), elements(&program), "{name}");
    assert_eq!(again.settings, program.settings, "{name}");
    assert_eq!((again.format, again.dialect), (program.format, program.dialect), "{name}");
}

#[test]
fn own_programs() {
    let old = "LDmicro0.1\r\nMICRO=Atmel AVR ATmega8 28-PDIP\r\nCYCLE=10000\r\nCRYSTAL=4000000\r\nBAUD=2400\r\nCOMPILED=a b.hex\r\n\r\n\
        IO LIST\r\n    Xa at 2\r\n    Yb at 3\r\nEND\r\n\r\nPROGRAM\r\nRUNG\r\n\tPARALLEL\r\n\tCONTACTS Xa 0\r\n; remark\r\n\
        SERIES\r\nCONTACTS Yb 1\r\nPARALLEL\r\nSHORT\r\nOPEN\r\nEND\r\nEND\r\nSERIES\r\nPARALLEL\r\nOSR\r\nOSF\r\nEND\r\nEND\r\nEND\r\n\
        COIL Yb 0 0 0\r\nEND\r\n";
    let new = "LDmicro0.2\nCYCLE=10000 us at Timer1, YPlcCycleDuty:0, ConfigurationWord(s):0x0\nCRYSTAL=16000000 Hz\n\
        BAUD=9600 Hz, RATE=100000 Hz, SPEED=100000 Hz\nCOMPILED=x.hex\nCOMPILER=AVR HEX\nPULL-UP LIST\nPb: 0x0F\nPC: 0xff\nEND\n\
        VAR LIST\n2 bytes v\nw signed 16 bit variable\nEND\nIO LIST\nXa at 2 0 0\nYb at 3 1 40001\nEND\nPROGRAM\n\
        RUNG\nCONTACTS Xa 0 0\nCOIL Yb 0 0 0 0\nEND\nRUNG\nMOVE v 0x1F\nEND\n";
    let empty = "LDmicro0.2\nCYCLE=1\nCRYSTAL=1\nPULL-UP LIST\nEND\nVAR LIST\nEND\nIO LIST\nEND\nPROGRAM\n";
    for (name, text) in [("old", old), ("new", new), ("empty", empty)] {
        round_trip(name, text);
    }
}

/// A file is written back with its words, its code page and its line ends.
#[test]
fn bytes_come_back() {
    let mut seen = 0;
    for path in ["../examples", "../emu-check/tests/programs"].into_iter().flat_map(|folder| ld_files(folder.as_ref()))
    {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        round_trip(&name, &text);
        let latin: Vec<u8> = text
            .replace("PROGRAM\nRUNG\n", "PROGRAM\nRUNG\n    COMMENT caf\u{e9}\n")
            .chars()
            .map(|c| c as u8)
            .collect();
        let windows = String::from_utf8_lossy(text.as_bytes()).replace('\n', "\r\n").into_bytes();
        for bytes in [text.clone().into_bytes(), latin, windows] {
            let read = |bytes: &[u8]| ladder::parse_bytes(&name, bytes, ladder::ParseOptions::default());
            let parsed = read(&bytes).unwrap_or_else(|e| panic!("{name}: {e:?}"));
            let written = ladder::write_bytes(&parsed.program, parsed.encoding);
            let bare = |bytes: &[u8]| -> Vec<Vec<u8>> {
                let lines = bytes.split(|c| *c == b'\n').map(|line| line.trim_ascii_start().to_vec());
                lines.filter(|line| !line.trim_ascii().is_empty() && !line.starts_with(b";")).collect()
            };
            assert_eq!(bare(&written), bare(&bytes), "{name}");
            let again = read(&written).unwrap_or_else(|e| panic!("{name}, written: {e:?}"));
            assert_eq!(ladder::write_bytes(&again.program, again.encoding), written, "{name}");
            seen += 1;
        }
    }
    assert!(seen >= 40, "{seen} files");
}

fn ld_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    entries.filter_map(|e| Some(e.ok()?.path())).filter(|p| p.extension().is_some_and(|e| e == "ld")).collect()
}

/// The `.ld` files of a corpus folder: the value of the variable `name`, or `default` beside the workspace.
fn corpus_files(name: &str, default: &str) -> Vec<PathBuf> {
    // A relative folder starts at the workspace root.
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = root.join(std::env::var_os(name).filter(|v| !v.is_empty()).unwrap_or_else(|| default.into()));
    if !folder.is_dir() {
        println!("skipped: no corpus in {} (set {name})", folder.display());
        return Vec::new();
    }
    let files = ld_files(&folder);
    assert!(!files.is_empty(), "{} holds no .ld file", folder.display());
    println!("{} programs in {}", files.len(), folder.display());
    files
}

#[test]
fn programs_of_the_corpus() {
    for path in corpus_files("EMU_CORPUS", "../shared/ld") {
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        round_trip(&name, &text);
        let program = parse(&name, &text).expect("reads").program;
        let refused: Vec<_> = ladder::check(&program).into_iter().filter(diag::Diagnostic::is_error).collect();
        assert!(refused.is_empty(), "{name}: {refused:?}");
    }
}

/// Programs of LDmicro 5 read back as they were written. Those that are refused have only elements that are
/// not supported.
#[test]
fn programs_of_ldmicro5() {
    let files = [("EMU_CORPUS5", "../shared/ld5"), ("EMU_CORPUS5_LEAVES", "../shared/ld5/leaves")];
    for path in files.into_iter().flat_map(|(name, default)| corpus_files(name, default)) {
        let name = path.display().to_string();
        let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        let parsed = match ladder::parse_bytes(&name, &bytes, ladder::ParseOptions::default()) {
            Ok(parsed) => parsed,
            Err(errors) => {
                let errors: Vec<_> = errors.into_iter().filter(diag::Diagnostic::is_error).collect();
                assert!(errors.iter().all(|e| e.code == "LD021"), "{name}: {errors:?}");
                println!("{name}: {}", errors[0].cause);
                continue;
            }
        };
        let dialect = Some(parsed.program.dialect);
        let written = ladder::write_bytes(&parsed.program, parsed.encoding);
        let options = ladder::ParseOptions { dialect };
        let again = ladder::parse_bytes(&name, &written, options).unwrap_or_else(|e| panic!("{name}, written: {e:?}"));
        assert_eq!(ladder::write_bytes(&again.program, again.encoding), written, "{name}");
        let elements = |p: &ladder::LadderProgram| {
            p.elements().map(|ProgramElement { id, element: e, .. }| (id, e.clone())).collect::<Vec<_>>()
        };
        assert_eq!(elements(&again.program), elements(&parsed.program), "{name}");
        assert_eq!((&again.program.settings, &again.program.style), (&parsed.program.settings, &parsed.program.style));
        if parsed.warnings.iter().all(|note| note.code != ladder::REWRITTEN) {
            let text = |bytes: &[u8]| diag::text::to_display_text(&diag::text::decode_text(bytes)).into_owned();
            assert_eq!(words(&text(&written)), words(&text(&bytes)), "{name}");
        } else {
            println!(
                "{name}: written otherwise: {:?}",
                parsed.warnings.iter().find(|n| n.code == ladder::REWRITTEN).map(|n| &n.cause)
            );
        }
    }
}
