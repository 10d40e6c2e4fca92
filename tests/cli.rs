//! Tests of the command line with transcripts: `tests/cli/*.txt`.
//!
//! ```text
//! # a comment                     | a line of standard output
//! $ emu chips                     ! a line of standard error
//! < a line of standard input      = exit code
//! ```
//! `|...` and `!...` match any number of lines. Every file runs in a separate folder that starts as a copy of
//! `tests/cli/in`; `$ cat FILE` and `$ ls` examine the folder. With EMU_BLESS=1 in the environment the
//! transcripts are rewritten (except those with `...`); review them before committing.

mod cli {
    pub mod transcript;
}

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use emu_core::chip::Chip;
use emu_core::rng::Rng;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn text_files(folder: &str, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).expect("the folder of the tests");
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == ending));
    files.sort();
    assert!(!files.is_empty(), "no .{ending} in {folder}");
    files
}

/// Creates an empty folder with the input files.
fn folder(name: &str) -> PathBuf {
    let folder = emu_test_support::empty_test_folder!(format!("cli-{name}"));
    for entry in fs::read_dir(root().join("tests/cli/in")).expect("the inputs") {
        let from = entry.expect("an entry").path();
        fs::copy(&from, folder.join(from.file_name().expect("a name"))).expect("a copy");
    }
    folder
}

fn emu(folder: &Path, args: &[String], input: &[u8]) -> Output {
    run(folder, args, input, false)
}

/// Runs `emu`. With `peers`, the PATH has compilers of other projects; without, it is empty, so that every
/// machine prints the same.
fn run(folder: &Path, args: &[String], input: &[u8], peers: bool) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    for name in ["NO_COLOR", "CLICOLOR_FORCE", "COLUMNS"] {
        command.env_remove(name);
    }
    if !peers {
        command.env("PATH", "");
    }
    let piped =
        command.args(args).current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = piped.spawn().expect("emu starts");
    // A verb that does not read its input closes it early, which is no failure.
    _ = std::io::Write::write_all(&mut child.stdin.take().expect("standard input"), input);
    child.wait_with_output().expect("emu ends")
}

#[test]
fn transcripts() {
    replayed("tests/cli", false);
}

#[test]
#[ignore = "needs gcc, avr-gcc and sdcc"]
fn transcripts_with_peers() {
    replayed("tests/cli/peers", true);
}

fn replayed(texts: &str, peers: bool) {
    let bless = std::env::var_os("EMU_BLESS").is_some();
    let mut wrong = Vec::new();
    for file in text_files(texts, "txt") {
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        let folder = folder(&name);
        let wanted = fs::read_to_string(&file).expect("a transcript");
        let found = cli::transcript::replay(&wanted, &mut |args, input| run(&folder, args, input, peers), &folder);
        if found.differs.is_empty() {
            continue;
        }
        if bless {
            fs::write(&file, found.text).expect("the transcript is written");
        }
        if !bless || found.by_hand {
            wrong.extend(found.differs.into_iter().map(|d| format!("{name}.txt: {d}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The HEX files of the transcripts equal the output of our assembler and writer for the sources next to
/// them.
#[test]
fn images_are_what_their_sources_say() {
    let families: [(&str, &'static Chip); 3] = [
        ("s", &emu_avr::chips::ATMEGA328P),
        ("a51", emu_8051::chips::chip("8052").expect("a chip")),
        ("p16", &emu_pic16::chips::PIC16F873.chip),
    ];
    let sources =
        families.iter().flat_map(|family| text_files("tests/cli/in", family.0).into_iter().map(move |s| (s, family)));
    for (source, &(_, chip)) in sources {
        let text = fs::read_to_string(&source).expect("a source");
        let image = emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{}: {e}", source.display()));
        let segments: Vec<_> =
            image.segments.iter().map(|s| emu_core::image::HexSegment { addr: s.addr, bytes: &s.bytes }).collect();
        let hex = emu_core::image::write_hex(&segments);
        let file = source.with_extension("hex");
        if std::env::var_os("EMU_BLESS").is_some() {
            fs::write(&file, &hex).expect("the image is written");
        }
        assert_eq!(fs::read_to_string(&file).expect("an image"), hex, "{}", file.display());
    }
}

/// Every faulty image of the loader's tests, with every verb that takes images, gives its code, exit code 3,
/// and nothing on standard output. Each line is a case: file, code.
#[test]
fn faulty_images_give_their_code_and_exit_3() {
    let folder = root().join("emu-core/tests/image");
    for line in include_str!("cli/images.table").lines().filter(|l| !l.starts_with('#')) {
        let (file, code) = line.split_once(' ').expect("file and code");
        for verb in ["run", "disasm"] {
            let args = [verb, file, "--mcu", "atmega328p"].map(str::to_owned);
            let out = emu(&folder, &args, b"");
            let messages = String::from_utf8_lossy(&out.stderr);
            assert_eq!(out.status.code(), Some(3), "{verb} {line}: {messages}");
            assert!(messages.contains(&format!("[{code}] error: ")), "{verb} {line}: {messages}");
            assert!(out.stdout.is_empty(), "{verb} {line}");
        }
        let args = ["run", file, "--mcu", "atmega328p", "--json"].map(str::to_owned);
        let out = emu(&folder, &args, b"");
        let document: serde_json::Value = serde_json::from_slice(&out.stdout).expect("a JSON document");
        let errors = document["errors"].as_array().expect("errors");
        assert_eq!((out.status.code(), &document["schema"]), (Some(3), &serde_json::json!(1)), "{line}");
        assert!(errors.iter().any(|e| e["code"] == code), "{line}: {document}");
    }
}

/// Verbs whose examples need another program, so that `tests/docs.rs` cannot run them.
const SERVERS: &[&str] = &["dap", "lockstep"];

/// Every flag that `--help` lists is on a page, and every verb has a row and an example in docs/cli.md, and
/// an example in its help.
#[test]
fn every_verb_and_flag_is_documented() {
    let page = fs::read_to_string(root().join("docs/cli.md")).expect("docs/cli.md");
    let pages: String = text_files("docs", "md").iter().map(|p| fs::read_to_string(p).expect("a page")).collect();
    let help_of = |args: &[&str]| {
        let args: Vec<String> = args.iter().copied().chain(["--help"]).map(str::to_owned).collect();
        String::from_utf8(emu(&root(), &args, b"").stdout).expect("the help is text")
    };
    let all = help_of(&[]);
    let list = all.split_once("Commands:\n").and_then(|(_, rest)| rest.split_once("\n\n")).expect("a list of verbs").0;
    let verbs = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    let verbs: Vec<&str> = verbs.filter(|verb| !["", "help"].contains(verb)).collect();
    assert!(verbs.contains(&"run") && verbs.contains(&"man"), "{verbs:?}");
    let mut missing = Vec::new();
    for verb in verbs {
        let help = help_of(&[verb]);
        if !help.contains("Example") {
            missing.push(format!("emu {verb} --help has no example"));
        }
        if !page.contains(&format!("`emu {verb}")) {
            missing.push(format!("docs/cli.md has no row for emu {verb}"));
        }
        if !page.contains(&format!("\nemu {verb}")) && !SERVERS.contains(&verb) {
            missing.push(format!("docs/cli.md has no example of emu {verb}"));
        }
        let flags = help
            .lines()
            .filter_map(|l| l.split_whitespace().find(|w| w.starts_with("--")))
            .map(|w| w.trim_end_matches(|c: char| !c.is_ascii_alphanumeric()));
        let flags = flags.filter(|f| !["--help", "--version"].contains(f) && !pages.contains(f));
        missing.extend(flags.map(|flag| format!("no page of docs has the flag {flag} of emu {verb}")));
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// A result that nobody reads is no failure. The verb waits for its input until the pipe is closed.
#[test]
fn a_closed_pipe_is_no_failure() {
    for verb in [&["draw", "-"][..], &["sim", "-", "--json"], &["compile", "-", "--mcu", "atmega328p"]] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
        let piped = command.args(verb).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = piped.spawn().expect("emu starts");
        drop(child.stdout.take());
        let program = include_bytes!("cli/in/blinker.ld");
        std::io::Write::write_all(&mut child.stdin.take().expect("standard input"), program).expect("it is read");
        let out = child.wait_with_output().expect("emu ends");
        assert_eq!((out.status.code(), String::from_utf8_lossy(&out.stderr).as_ref()), (Some(0), ""), "{verb:?}");
    }
}

/// A damaged file is run or refused, without any other outcome.
#[test]
fn damaged_files_never_break_emu() {
    let folder = folder("damaged");
    for seed in 0..60u64 {
        let mut rng = Rng::new(seed);
        let program = seed % 2 == 0;
        let mut bytes = fs::read(folder.join(if program { "blinker.ld" } else { "hello.hex" })).expect("an input");
        for _ in 0..=rng.below(3) {
            let at = rng.below(bytes.len() as u64) as usize;
            match rng.below(3) {
                0 => bytes[at] = rng.next_u64() as u8,
                1 => _ = bytes.remove(at),
                _ => bytes.insert(at, b"\r\n\t: 0FZ\x00\xc3"[rng.below(10) as usize]),
            }
        }
        let args: &[&str] = match (program, seed % 3) {
            (true, 0) => &["sim", "-", "--scans", "3"],
            (true, 1) => &["compile", "-", "--mcu", "atmega328p"],
            (true, _) => &["draw", "-"],
            (false, 0) => &["disasm", "-"],
            (false, 1) => &["run", "-", "--mcu", "at89s52", "--for", "1ms"],
            (false, _) => &["run", "-", "--mcu", "atmega328p", "--for", "1ms"],
        };
        let args: Vec<String> = args.iter().map(|&a| a.to_owned()).collect();
        let out = emu(&folder, &args, &bytes);
        let messages = String::from_utf8_lossy(&out.stderr);
        assert!(matches!(out.status.code(), Some(0 | 3 | 4)), "seed {seed}: {:?} {messages}", out.status);
        assert_eq!(out.status.code() == Some(3), messages.contains("] error: "), "seed {seed}: {messages}");
    }
}

/// A damaged ELF file is accepted or refused. If only its source lines are damaged, it is accepted with a
/// warning.
#[test]
fn damaged_elf_files_never_break_emu() {
    let folder = folder("damaged-elf");
    let whole = fs::read(folder.join("lines.elf")).expect("an input");
    let (mut refused, mut warned) = (0, 0);
    for seed in 0..60u64 {
        let mut rng = Rng::new(seed);
        let mut bytes = whole.clone();
        for _ in 0..=rng.below(3) {
            let at = rng.below(bytes.len() as u64) as usize;
            bytes[at] ^= 1 << rng.below(8);
        }
        let args: &[&str] = match seed % 3 {
            0 => &["disasm", "-", "--source"],
            1 => &["disasm", "-", "--source", "--json"],
            _ => &["run", "-", "--mcu", "atmega328p", "--lint", "--cycles", "200"],
        };
        let args: Vec<String> = args.iter().map(|&a| a.to_owned()).collect();
        let out = emu(&folder, &args, &bytes);
        let messages = String::from_utf8_lossy(&out.stderr);
        assert!(matches!(out.status.code(), Some(0 | 3 | 4)), "seed {seed}: {:?} {messages}", out.status);
        assert_eq!(
            out.status.code() == Some(3),
            messages.contains("] error: ") || out.stdout.starts_with(b"{\n  \"schema\": 1,\n  \"errors\""),
            "seed {seed}: {messages}"
        );
        refused += u32::from(out.status.code() == Some(3));
        warned += u32::from(messages.contains("warning[ELF012]: "));
    }
    assert!(refused > 0 && warned > 0, "{refused} {warned}");
}
