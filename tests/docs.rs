//! Every `console` block of the README, of the pages of the full screens and of the tutorials is run, and prints what the page says.
//!
//! A block is a run of `$ emu ..` lines, each followed by what it prints (standard output, then standard error). A line of
//! `...` stands for any number of lines. Blocks of one page share a folder in which `examples` is that of the repository.
//! `EMU_BLESS=1` writes the pages anew, but for blocks with `...`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Splits a command line as a shell would split the simple ones of the pages: spaces, and quotes around words.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.chars() {
        match (quote, c) {
            (Some(q), _) if c == q => quote = None,
            (Some(_), _) => words.last_mut().expect("a word").push(c),
            (None, '\'' | '"') => quote = Some(c),
            (None, ' ') => words.push(String::new()),
            (None, _) => words.last_mut().expect("a word").push(c),
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

fn run(line: &str, dir: &Path) -> String {
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
    String::from_utf8_lossy(&text).lines().map(|l| format!("{}\n", l.trim_end())).collect()
}

/// True when `found` is `wanted`, where a wanted line of `...` stands for any lines.
fn fits(wanted: &[&str], found: &[&str]) -> bool {
    match wanted.split_first() {
        None => found.is_empty(),
        Some((&"...", rest)) => (0..=found.len()).any(|skip| fits(rest, &found[skip..])),
        Some((line, rest)) => found.first() == Some(line) && fits(rest, &found[1..]),
    }
}

/// Copies a folder with all that is in it.
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

#[test]
fn every_command_of_the_pages_prints_what_they_say() {
    let mut pages = vec![root().join("README.md"), root().join("docs/watch.md"), root().join("docs/tui.md")];
    if let Ok(entries) = fs::read_dir(root().join("docs/tutorials")) {
        pages.extend(entries.flatten().map(|e| e.path()));
    }
    pages.sort();
    let (mut commands, mut faults) = (0, Vec::new());
    for page in pages {
        let stem = page.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("page-{stem}"));
        let _ = fs::remove_dir_all(&dir);
        copy(&root().join("examples"), &dir.join("examples"));
        let text = fs::read_to_string(&page).expect("a page");
        let mut out = String::new();
        let mut lines = text.lines().peekable();
        while let Some(line) = lines.next() {
            out += line;
            out.push('\n');
            if line != "```console" {
                continue;
            }
            while let Some(command) = lines.next_if(|l| l.starts_with("$ ")) {
                let mut wanted = Vec::new();
                while let Some(line) = lines.next_if(|l| !l.starts_with("$ ") && *l != "```") {
                    wanted.push(line);
                }
                commands += 1;
                let found = run(&command[2..], &dir);
                let found_lines: Vec<&str> = found.lines().collect();
                out += &format!("{command}\n");
                if wanted.contains(&"...") {
                    wanted.iter().for_each(|l| out += &format!("{l}\n"));
                } else {
                    out += &found;
                }
                if !fits(&wanted, &found_lines) {
                    faults.push(format!("{}: {command}\nprints\n{found}", page.display()));
                }
            }
        }
        if std::env::var_os("EMU_BLESS").is_some() {
            fs::write(&page, out).expect("the page can be written");
        }
    }
    assert!(commands > 5, "only {commands} commands found");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
