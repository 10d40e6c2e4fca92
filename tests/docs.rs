//! Every command of the README, of `docs/cli.md`, of the full-screen pages and of the tutorials runs as
//! typed.
//!
//! A `console` block is a list of `$ emu ..` lines, each followed by its output (standard output, then
//! standard error). A line of `...` matches any number of lines. A `sh` block has one command per line, and
//! those of `emu` are run: the exit code must be 0, or the code in the comment of the line (`# exit code 1`).
//! Blocks of one page share a folder in which `examples` is that of the repository. `EMU_BLESS=1` rewrites
//! the pages, except blocks with `...`, and the pictures of `docs/pictures`.

mod docs {
    pub mod picture;
}

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Splits a simple command line as a shell does: spaces, quotes around words, a comment at the end.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.chars() {
        match (quote, c) {
            (Some(q), _) if c == q => quote = None,
            (Some(_), _) => words.last_mut().expect("a word").push(c),
            (None, '\'' | '"') => quote = Some(c),
            (None, ' ') => words.push(String::new()),
            (None, '#') if words.last().is_some_and(String::is_empty) => break,
            (None, _) => words.last_mut().expect("a word").push(c),
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

/// Runs a command of `emu` in a folder. Returns its output and its exit code.
fn run(line: &str, dir: &Path) -> (String, Option<i32>) {
    let words = words(line);
    assert_eq!(words[0], "emu", "pages run emu only: {line}");
    let output = Command::new(env!("CARGO_BIN_EXE_emu"))
        .args(&words[1..])
        .current_dir(dir)
        .env("NO_COLOR", "1")
        .env_remove("CLICOLOR_FORCE")
        .output()
        .expect("emu runs");
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text).lines().map(|l| format!("{}\n", l.trim_end())).collect();
    (text, output.status.code())
}

/// Returns true if `found` matches `wanted`, in which a line of `...` matches any number of lines.
fn fits(wanted: &[&str], found: &[&str]) -> bool {
    match wanted.split_first() {
        None => found.is_empty(),
        Some((&"...", rest)) => (0..=found.len()).any(|skip| fits(rest, &found[skip..])),
        Some((line, rest)) => found.first() == Some(line) && fits(rest, &found[1..]),
    }
}

/// Copies a folder with all its contents.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder").flatten() {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).expect("a copy");
        }
    }
}

/// Creates an empty folder with a copy of the repository's `examples`.
fn folder(name: &str) -> PathBuf {
    let dir = emu_test_support::empty_test_folder!(format!("page-{name}"));
    copy(&root().join("examples"), &dir.join("examples"));
    dir
}

/// Returns the pages whose commands run.
fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> =
        ["README.md", "docs/cli.md", "docs/watch.md", "docs/tui.md"].iter().map(|page| root().join(page)).collect();
    pages.extend(fs::read_dir(root().join("docs/tutorials")).expect("tutorials").flatten().map(|e| e.path()));
    pages.sort();
    pages
}

/// Returns the command of `emu` in a line of a `sh` block and its expected exit code, or `None` for other
/// programs.
fn shell_command(line: &str) -> Option<(String, i32)> {
    let line = line.replacen("cargo run --release -- ", "emu ", 1);
    if !line.starts_with("emu ") {
        return None;
    }
    let code = line
        .split_once("# exit code ")
        .and_then(|(_, code)| code.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok());
    Some((line, code.unwrap_or(0)))
}

/// The result of replaying a page: its text with the actual output, the number of commands, and the
/// differences.
struct Replayed {
    text: String,
    commands: usize,
    faults: Vec<String>,
}

fn replay(page: &Path) -> Replayed {
    let dir = folder(&page.file_stem().unwrap_or_default().to_string_lossy());
    let text = fs::read_to_string(page).expect("a page");
    let mut found = Replayed { text: String::new(), commands: 0, faults: Vec::new() };
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        found.text += &format!("{line}\n");
        match line {
            "```console" => {
                while let Some(command) = lines.next_if(|l| l.starts_with("$ ")) {
                    let mut wanted = Vec::new();
                    while let Some(line) = lines.next_if(|l| !l.starts_with("$ ") && *l != "```") {
                        wanted.push(line);
                    }
                    found.console(command, &wanted, page, &dir);
                }
            }
            "```sh" => {
                while let Some(line) = lines.next_if(|l| *l != "```") {
                    found.text += &format!("{line}\n");
                    found.shell(line, page, &dir);
                }
            }
            _ => {}
        }
    }
    found
}

impl Replayed {
    /// Runs a line `$ emu ..` and compares its output.
    fn console(&mut self, command: &str, wanted: &[&str], page: &Path, dir: &Path) {
        self.commands += 1;
        let (printed, _) = run(&command[2..], dir);
        self.text += &format!("{command}\n");
        if wanted.contains(&"...") {
            wanted.iter().for_each(|l| self.text += &format!("{l}\n"));
        } else {
            self.text += &printed;
        }
        if !fits(wanted, &printed.lines().collect::<Vec<_>>()) {
            self.faults.push(format!("{}: {command}\nprints\n{printed}", page.display()));
        }
    }

    /// Runs a line of a `sh` block that begins with `emu` and compares its exit code.
    fn shell(&mut self, line: &str, page: &Path, dir: &Path) {
        let Some((command, wanted)) = shell_command(line) else { return };
        self.commands += 1;
        let (printed, code) = run(&command, dir);
        if code != Some(wanted) {
            self.faults
                .push(format!("{}: {line}\nexit code {code:?}, wanted {wanted}; prints\n{printed}", page.display()));
        }
    }
}

#[test]
fn every_command_of_the_pages_runs_as_typed() {
    let mut faults = Vec::new();
    for page in pages() {
        let found = replay(&page);
        assert!(found.commands > 0, "no command in {}", page.display());
        faults.extend(found.faults);
        if std::env::var_os("EMU_BLESS").is_some() {
            fs::write(&page, found.text).expect("the page can be written");
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Commands of other programs, which build the inputs of the tutorials.
#[test]
#[ignore = "needs sdcc, avr-gcc and gpasm"]
fn every_command_of_other_tools_runs_as_typed() {
    let tools = ["sdcc", "avr-gcc", "gpasm"];
    let mut run = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).expect("a page");
        let dir = folder(&format!("tools-{}", page.file_stem().unwrap_or_default().to_string_lossy()));
        for line in text.split("```sh\n").skip(1).flat_map(|block| block.lines().take_while(|l| *l != "```")) {
            let words = words(line);
            if words.first().is_some_and(|tool| tools.contains(&tool.as_str())) {
                let output =
                    Command::new(&words[0]).args(&words[1..]).current_dir(&dir).output().expect("the tool runs");
                assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
                run += 1;
            }
        }
    }
    assert!(run >= tools.len(), "only {run} commands of other tools");
}

/// The README stays short; evidence belongs on the pages that it links to.
#[test]
fn the_readme_is_short() {
    let lines = fs::read_to_string(root().join("README.md")).expect("the README").lines().count();
    assert!(lines <= 130, "{lines} lines");
}

/// Every link from one page to another leads to a file.
#[test]
fn links_between_pages_lead_somewhere() {
    let mut pages: Vec<PathBuf> =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].iter().map(|p| root().join(p)).collect();
    let mut folders = vec![root().join("docs")];
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(&folder).expect("a folder of pages").flatten().map(|e| e.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    let mut dead = Vec::new();
    for page in pages {
        let text = fs::read_to_string(&page).expect("a page");
        let links = text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link);
        for link in links.filter(|link| !link.contains("://") && !link.contains(' ') && !link.starts_with('#')) {
            let file = link.split('#').next().unwrap_or(link);
            if !page.parent().expect("a folder").join(file).exists() {
                dead.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

/// The pictures of the README equal the output of `emu draw` and `emu wave`.
#[test]
fn pictures_are_what_emu_draws() {
    let dir = folder("pictures");
    let (drawing, _) = run("emu draw examples/welder.ld", &dir);
    let ladder =
        docs::picture::svg(&drawing, "The ladder of examples/welder.ld: a wire feed that leads the arc by a second");
    run("emu sim examples/welder.ld --scans 320 --at 21:Xtrigger=1 --at 181:Xtrigger=0 --vcd welder.vcd", &dir);
    run("emu wave welder.vcd --only Xtrigger --only Ymotor --only Yarc --width 800 --svg waveform.svg", &dir);
    let waveform = fs::read_to_string(dir.join("waveform.svg")).expect("emu wave writes a picture");
    for (name, picture) in [("welder.svg", ladder), ("welder-waveform.svg", waveform)] {
        let path = root().join("docs/pictures").join(name);
        if std::env::var_os("EMU_BLESS").is_some() {
            fs::write(&path, &picture).expect("the picture can be written");
        }
        let stored = fs::read_to_string(&path).unwrap_or_default();
        assert!(stored == picture, "docs/pictures/{name} is not what emu draws; EMU_BLESS=1 writes it");
    }
}
