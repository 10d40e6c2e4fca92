//! Rules of the code base that the compiler does not check: dependencies between crates, length of files, no
//! unsafe code, a list of unmodelled features in each chip crate, and error enums.

#[path = "tidy/signatures.rs"]
mod signatures;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// `crate: crates it may use`. Dev-dependencies are not restricted, because tests may use everything.
const ARROWS: &str = "
diag:
emu-core:       diag
emu-asm:        diag emu-core
emu-avr:        emu-core
emu-8051:       emu-core
emu-pic16:      emu-core
emu-ap101:      diag emu-core
emu-debug:      diag emu-core scenario
scenario:       diag
emu-gdb:        emu-core emu-debug
ladder:         diag
ladder-eval:    ladder
ladder-compile: ladder diag emu-core emu-avr emu-8051 emu-pic16 emu-ap101
ladder-view:    diag emu-core emu-debug ladder ladder-eval ladder-compile
emu-dap:        emu-core emu-debug ladder ladder-view
emu-check:      ladder diag emu-core emu-avr emu-8051 emu-pic16 emu-ap101 emu-debug ladder-eval ladder-compile scenario
emu:            ladder diag emu-core emu-asm emu-avr emu-8051 emu-pic16 emu-ap101 emu-debug emu-gdb ladder-eval ladder-compile emu-check ladder-view scenario emu-dap emu-tui
emu-tui:        ladder ladder-eval
test-support:   emu-core
test-machines:  emu-core emu-avr emu-8051 emu-pic16 emu-ap101 emu-debug
fuzz:           emu emu-core emu-asm emu-avr emu-8051 emu-pic16 emu-ap101 emu-debug emu-gdb emu-dap ladder ladder-eval ladder-compile ladder-view scenario
";

/// The parts of the emulators that the compiler may name: tables, chip data and images, never a machine.
#[rustfmt::skip]
const COMPILER_MAY_NAME: &[&str] = &[
    "emu_core::table", "emu_core::chip", "emu_core::image", "emu_core::Chip",
    "emu_avr::isa", "emu_8051::isa", "emu_pic16::isa", "emu_ap101::isa",
    "emu_avr::chips", "emu_8051::chips", "emu_pic16::chips", "emu_ap101::chips",
    // Parts of chip rows: prescalers, names of registers, and the configuration of AP101 with its areas.
    "emu_avr::periph::timers::ClockTap", "emu_pic16::periph::map::Sfr", "emu_ap101::config", "emu_ap101::operands",
];

/// Crates of the tree that are not members of the workspace, each with the reason.
const OUTSIDE: &[(&str, &str)] =
    &[("fuzz/libfuzzer", "the macro of libfuzzer-sys expands to unsafe code; it is built by fuzz/run.sh alone")];

/// Maximum number of lines per file.
const LONGEST: usize = 500;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the crates of the workspace and their folders, from its Cargo.toml.
fn crates() -> Vec<(String, PathBuf)> {
    let text = fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let table: toml::Table = text.parse().expect("Cargo.toml is TOML");
    let members = table["workspace"]["members"].as_array().expect("members");
    let mut list: Vec<_> =
        members.iter().filter_map(|m| m.as_str()).map(|name| (name.to_owned(), root().join(name))).collect();
    list.push(("emu".into(), root()));
    list
}

fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(dir) else { return };
    for entry in entries.flatten() {
        let path = entry.path();
        let name = entry.file_name().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

#[test]
fn arrows_between_crates() {
    let allowed: BTreeMap<&str, Vec<&str>> = ARROWS
        .lines()
        .filter_map(|l| l.split_once(':'))
        .map(|(name, uses)| (name.trim(), uses.split_whitespace().collect()))
        .collect();
    let mut wrong = Vec::new();
    for (name, dir) in crates() {
        let text = fs::read_to_string(dir.join("Cargo.toml")).expect("Cargo.toml of a crate");
        let table: toml::Table = text.parse().expect("Cargo.toml is TOML");
        let uses = table.get("dependencies").and_then(toml::Value::as_table);
        let Some(may) = allowed.get(name.as_str()) else {
            wrong.push(format!("{name}: not in the list of arrows"));
            continue;
        };
        for used in uses.into_iter().flat_map(|t| t.keys()) {
            let ours = ["diag", "scenario", "emu"].contains(&used.as_str())
                || used.starts_with("emu-")
                || used.starts_with("ladder");
            if ours && !may.contains(&used.as_str()) {
                wrong.push(format!("{name} -> {used}"));
            }
        }
    }
    assert!(wrong.is_empty(), "arrows that the design does not draw: {wrong:#?}");
}

/// What `cargo package --workspace` needs: every published package has the common prefix, which no other
/// crate of the registry has, and the folder's name as the name of its library; dev-dependencies on crates of
/// the workspace have no version, so that cargo leaves them out and they form no cycle.
#[test]
fn packages_can_be_published() {
    let mut wrong = Vec::new();
    for (folder, dir) in crates() {
        let text = fs::read_to_string(dir.join("Cargo.toml")).expect("Cargo.toml of a crate");
        let table: toml::Table = text.parse().expect("Cargo.toml is TOML");
        let package = table["package"].as_table().expect("package");
        if package.get("publish").and_then(toml::Value::as_bool) == Some(false) {
            continue;
        }
        let suffix = folder.strip_prefix("emu").unwrap_or(&folder).trim_start_matches('-');
        let name = if suffix.is_empty() { "plcemu".to_owned() } else { format!("plcemu-{suffix}") };
        if package["name"].as_str() != Some(&name) {
            wrong.push(format!("{folder}: its package is not {name}"));
        }
        if table["lib"]["name"].as_str() != Some(&folder.replace('-', "_")) {
            wrong.push(format!("{folder}: its library is not {}", folder.replace('-', "_")));
        }
        let dev = table.get("dev-dependencies").and_then(toml::Value::as_table);
        for (used, how) in dev.into_iter().flatten().filter(|(used, _)| dir_of(used).exists()) {
            if how.get("path").is_none() || how.get("version").is_some() {
                wrong.push(format!("{folder}: the dev-dependency {used} is not by path alone"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the folder that a crate of the workspace with this name would have.
fn dir_of(name: &str) -> PathBuf {
    root().join(name).join("Cargo.toml")
}

#[test]
fn the_compiler_sees_tables_only() {
    let mut files = Vec::new();
    rust_files(&root().join("ladder-compile/src"), &mut files);
    assert!(!files.is_empty());
    let mut wrong = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).expect("source");
        // Tests after the first `#[cfg(test)]` may run what was compiled.
        let text = text.split("#[cfg(test)]").next().unwrap_or("");
        for (n, line) in text.lines().enumerate().filter(|(_, l)| !l.trim_start().starts_with("//")) {
            let names = ["emu_core::", "emu_avr::", "emu_8051::", "emu_pic16::", "emu_ap101::"];
            for (at, _) in names.iter().flat_map(|name| line.match_indices(name)) {
                if !COMPILER_MAY_NAME.iter().any(|ok| line[at..].starts_with(ok)) {
                    wrong.push(format!("{}:{}: {}", file.display(), n + 1, line.trim()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "the compiler may use tables and chip data only: {wrong:#?}");
}

#[test]
fn files_fit_in_the_head() {
    let mut files = Vec::new();
    rust_files(&root(), &mut files);
    let long: Vec<String> = files
        .iter()
        .filter_map(|f| {
            let lines = fs::read_to_string(f).expect("source").lines().count();
            (lines > LONGEST).then(|| format!("{}: {lines} lines", f.display()))
        })
        .collect();
    assert!(long.is_empty(), "longer than {LONGEST} lines: {long:#?}");
}

/// Public type names that may exist in more than two crates: each is qualified with its crate where two of
/// them meet.
const NAMES_OF_MANY_CRATES: &[&str] = &["Options", "Error", "Chip"];

/// Returns the name of the public type that a line defines, also through `define_isa!` and `operands!`.
fn public_type(line: &str) -> Option<&str> {
    let (line, words) = (line.trim_start(), ["struct ", "enum ", "trait ", "type ", "union "]);
    let plain = line.strip_prefix("pub ").and_then(|rest| words.iter().find_map(|word| rest.strip_prefix(word)));
    let kinds = line.split_once("emu_core::define_isa { ").map(|(_, rest)| rest);
    let operand = Some(line).filter(|line| line.contains(") true \"") || line.contains(") false \""));
    let name = plain.or(kinds).or(operand)?.split(|c: char| !c.is_alphanumeric() && c != '_').next();
    name.filter(|name| name.starts_with(char::is_uppercase))
}

/// A type name must be clear where it is used, without its path.
#[test]
fn public_type_names_are_of_at_most_two_crates() {
    assert_eq!(public_type("avr_table!(emu_core::define_isa { AvrOpKind; });"), Some("AvrOpKind"));
    assert_eq!(public_type("    Rel(u16) true \"target\""), Some("Rel"));
    let mut homes: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (name, dir) in crates() {
        let mut files = Vec::new();
        rust_files(&dir.join("src"), &mut files);
        for file in files {
            for public in fs::read_to_string(&file).expect("source").lines().filter_map(public_type) {
                let list = homes.entry(public.to_owned()).or_default();
                if !list.contains(&name) {
                    list.push(name.clone());
                }
            }
        }
    }
    assert!(homes.len() > 400, "public types are found: {}", homes.len());
    homes.retain(|name, list| list.len() > 2 && !NAMES_OF_MANY_CRATES.contains(&name.as_str()));
    assert!(homes.is_empty(), "public type names in more than two crates: {homes:#?}");
}

/// Counts the types `Result<_, String>` and `Result<_, &str>` in a source, with any type for `_`, also across
/// several lines.
fn count_text_errors(source: &str) -> usize {
    let is_text = |error: &&str| *error == "String" || error.starts_with('&') && error.ends_with("str");
    let code: String = source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    code.split("Result<").skip(1).filter(|behind| type_arguments(behind).last().is_some_and(is_text)).count()
}

/// Returns the arguments of a generic type from a text that starts after `<`, up to its `>`. Empty if there
/// are fewer than two.
fn type_arguments(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (1, 0, Vec::new());
    for (at, c) in text.char_indices() {
        match c {
            '<' | '(' | '[' => depth += 1,
            '>' if text[..at].ends_with('-') => {}
            '>' | ')' | ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 || depth == 1 && c == ',' {
            found.push(text[start..at].trim());
            start = at + 1;
        }
        if depth == 0 {
            found.retain(|argument| !argument.is_empty());
            return if found.len() > 1 { found } else { Vec::new() };
        }
    }
    Vec::new()
}

#[test]
fn errors_of_libraries_are_enums() {
    for (source, count) in [
        ("fn f(n: Result<u8, ()>) -> Result<Vec<(u8, u8)>,\n    String,\n> {}", 1),
        ("type A = Result<dyn Fn() -> u8, String>; type B = Result<A, Result<u8, String>>;", 2),
        ("type A = Result<String, fmt::Error>; type B = fmt::Result<String>; type C = Map<u8, String>;", 0),
        ("type A<'a> = Result<Option<&'a str>, &'static str>; type B<'a> = Result<u8, &'a str>;", 2),
        ("type A<'a> = Result<&'a str, fmt::Error>; type B = Result<u8, &'static Structure>;", 0),
        ("// Result<u8, String>", 0),
    ] {
        assert_eq!(count_text_errors(source), count, "{source}");
    }
    for (name, dir) in crates().into_iter().filter(|(name, _)| name != "emu") {
        let mut files = Vec::new();
        rust_files(&dir.join("src"), &mut files);
        assert!(!files.is_empty(), "{name} has sources");
        let count: usize = files.iter().map(|file| count_text_errors(&fs::read_to_string(file).expect("source"))).sum();
        assert_eq!(
            count, 0,
            "{name} has types Result<_, String> or Result<_, &str>: a new error is a variant of its error enum"
        );
    }
}

/// Words and phrases that plain English does not need, each with its replacement.
const BANNED_PHRASES: &[(&str, &str)] = &[
    ("told", "is reported, reports, prints"),
    ("tells of", "reports"),
    ("goes before", "overrides"),
    ("wrong usage", "usage error"),
    ("seldom meant", "suspicious"),
    ("mend", "fix"),
    ("mends", "fixes"),
    ("mended", "fixed"),
    ("how the house stands", "architecture"),
    ("a turn of a loop", "an iteration"),
    ("comes round", "repeats"),
    ("random lives", "random executions"),
    ("random walks", "random executions"),
    ("gdb's words", "gdb commands"),
    ("the program's own figures", "the program's statistics"),
    ("what stands in", "what is in"),
    ("for ever", "without end"),
];

/// Files that may contain banned phrases or long comments, by the start of their path, each with the reason.
const PROSE_EXCEPTIONS: &[(&str, &str)] = &[("tests/tidy.rs", "contains the list of banned phrases")];

/// Maximum number of columns of a line with a comment only.
const COMMENT_COLUMNS: usize = 110;

/// Returns whether `text` contains `phrase` as whole words. `text` must be in lower case.
fn has_phrase(text: &str, phrase: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(phrase).any(|(at, _)| {
        !text[..at].chars().next_back().is_some_and(is_word)
            && !text[at + phrase.len()..].chars().next().is_some_and(is_word)
    })
}

/// Returns the files with prose and their paths from the root: sources, pages, and tables of tests.
fn prose_files() -> Vec<(String, String)> {
    fn visit(dir: &Path, out: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                visit(&path, out);
            } else if [".rs", ".md", ".txt", ".c", ".h", ".s", ".S", ".toml"].iter().any(|end| name.ends_with(end)) {
                out.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    visit(&root(), &mut paths);
    let relative =
        |path: &Path| path.strip_prefix(root()).expect("below the root").to_string_lossy().replace('\\', "/");
    // A few inputs of tests are not UTF-8.
    paths.iter().filter_map(|path| Some((relative(path), fs::read_to_string(path).ok()?))).collect()
}

#[test]
fn prose_uses_the_words_of_the_field() {
    assert!(has_phrase("it is told.", "told") && has_phrase("told", "told"));
    assert!(!has_phrase("untold", "told") && !has_phrase("told_you", "told"));
    let files = prose_files();
    assert!(files.len() > 1000, "files with prose are found: {}", files.len());
    let mut wrong = Vec::new();
    for (path, text) in &files {
        if PROSE_EXCEPTIONS.iter().any(|(start, _)| path.starts_with(start)) {
            continue;
        }
        for (n, line) in text.lines().enumerate() {
            let line = line.to_lowercase();
            let found = BANNED_PHRASES.iter().find(|(phrase, _)| has_phrase(&line, phrase));
            wrong.extend(found.map(|(phrase, better)| format!("{path}:{}: `{phrase}`: write {better}", n + 1)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for (start, why) in PROSE_EXCEPTIONS {
        assert!(files.iter().any(|(path, _)| path.starts_with(start)), "no file {start}, remove the exception: {why}");
    }
}

#[test]
fn comments_fit_in_their_columns() {
    let mut wrong = Vec::new();
    for (path, text) in prose_files().into_iter().filter(|(path, _)| path.ends_with(".rs")) {
        if PROSE_EXCEPTIONS.iter().any(|(start, _)| path.starts_with(start)) {
            continue;
        }
        let comments = text.lines().enumerate().filter(|(_, line)| line.trim_start().starts_with("//"));
        let long = comments.filter(|(_, line)| line.chars().count() > COMMENT_COLUMNS);
        wrong.extend(long.map(|(n, _)| format!("{path}:{}", n + 1)));
    }
    assert!(wrong.is_empty(), "comments over {COMMENT_COLUMNS} columns:\n{}", wrong.join("\n"));
}

#[test]
fn unsafe_code_is_forbidden() {
    for (name, dir) in crates() {
        let programs = fs::read_dir(dir.join("src/bin")).into_iter().flatten().flatten().map(|entry| entry.path());
        let roots =
            [dir.join("src/lib.rs"), dir.join("src/main.rs")].into_iter().filter(|p| p.exists()).chain(programs);
        let texts: Vec<String> = roots.map(|root| fs::read_to_string(root).expect("source")).collect();
        assert!(!texts.is_empty(), "{name} has no root file");
        let forbids = |text: &String| text.contains("#![forbid(unsafe_code)]");
        assert!(texts.iter().all(forbids), "{name} does not forbid unsafe code in all of its programs and libraries");
    }
}

/// A crate outside the workspace does not escape the rules: such crates are listed, have one small file, and
/// contain no unsafe code of their own.
#[test]
fn crates_outside_of_the_workspace_are_listed() {
    fn manifests(dir: &Path, out: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                manifests(&path, out);
            } else if name == "Cargo.toml" {
                out.extend(path.parent().map(Path::to_path_buf));
            }
        }
    }
    let mut found = Vec::new();
    manifests(&root(), &mut found);
    let members: Vec<PathBuf> = crates().into_iter().map(|(_, dir)| dir).collect();
    found.retain(|dir| !members.contains(dir));
    found.sort();
    assert_eq!(found, OUTSIDE.iter().map(|(dir, _)| root().join(dir)).collect::<Vec<_>>());
    for dir in found {
        let mut files = Vec::new();
        rust_files(&dir, &mut files);
        assert_eq!(files.len(), 1, "{}: one file", dir.display());
        let text = fs::read_to_string(&files[0]).expect("source");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        assert!(code.clone().count() < 30 && !code.clone().any(|line| line.contains("unsafe")), "{}", dir.display());
    }
}

#[test]
fn chips_say_what_is_not_modelled() {
    for (name, dir) in crates().into_iter().filter(|(_, d)| d.join("src/isa.rs").exists()) {
        let quirks = fs::read_to_string(dir.join("QUIRKS.md")).unwrap_or_default();
        assert!(quirks.lines().count() > 5, "{name} has no QUIRKS.md");
    }
}

/// Code that reads ladder elements must not forget a new one: a wildcard arm says above it why the other
/// elements do not matter.
#[test]
fn arms_for_all_other_elements_say_why() {
    let mut silent = Vec::new();
    for (_, dir) in crates() {
        let mut files = Vec::new();
        rust_files(&dir.join("src"), &mut files);
        for file in files {
            let text = fs::read_to_string(&file).expect("source");
            let lines: Vec<&str> = text.lines().collect();
            let indent = |line: &str| line.len() - line.trim_start().len();
            for (n, line) in lines.iter().enumerate().filter(|(_, line)| line.trim_start().starts_with("_ =>")) {
                let before = lines[..n].iter().rev().filter(|other| !other.trim().is_empty());
                let arms =
                    before.take_while(|other| indent(other) >= indent(line)).filter(|o| indent(o) == indent(line));
                let elements =
                    arms.filter(|arm| arm.trim_start().trim_start_matches("| ").starts_with("Element::")).count();
                let why = lines[n.saturating_sub(1)].trim_start().starts_with("// ");
                if elements > 1 && !why {
                    silent.push(format!("{}:{}", file.display(), n + 1));
                }
            }
        }
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}

/// Filters that match no test would make a command of CONTRIBUTING.md pass without testing anything.
#[test]
fn commands_for_contributors_run_tests_that_exist() {
    let page = fs::read_to_string(root().join("CONTRIBUTING.md")).expect("CONTRIBUTING.md");
    let manifest = |dir: &Path| fs::read_to_string(dir.join("Cargo.toml")).expect("Cargo.toml");
    let folder = |package: &str| {
        let mut all = crates().into_iter().map(|(_, dir)| dir);
        all.find(|dir| manifest(dir).contains(&format!("\nname = \"{package}\"\n")))
            .unwrap_or_else(|| panic!("{package}"))
    };
    let page = page.replace('\n', " ");
    let commands = page.split('`').filter(|text| text.starts_with("cargo test ") || text.starts_with("cargo bless "));
    let commands: Vec<&str> =
        commands.filter(|command| command.contains(" -p ") && !command.contains("PART")).collect();
    assert!(commands.len() > 25, "{commands:#?}");
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().skip(2).collect();
        let (mut dir, mut filters) = (root(), Vec::new());
        let mut values = words.iter().copied();
        while let Some(word) = values.next() {
            match word {
                "-p" => dir = folder(values.next().unwrap_or_default()),
                "--test" => {
                    let name = values.next().unwrap_or_default();
                    let places = [format!("tests/{name}.rs"), format!("tests/{name}/main.rs")];
                    let exists = manifest(&dir).contains(&format!("name = \"{name}\""))
                        || places.iter().any(|place| dir.join(place).exists());
                    assert!(exists, "{command}: there is no test file {name}");
                }
                _ if word.starts_with('-') => {}
                _ => filters.push(word),
            }
        }
        let mut files = Vec::new();
        rust_files(&dir.join(if words.contains(&"--lib") { "src" } else { "tests" }), &mut files);
        let has = |filter: &str| {
            files.iter().any(|file| {
                let stem = file.file_stem().is_some_and(|stem| stem.to_string_lossy().contains(filter));
                let text = fs::read_to_string(file).expect("source");
                stem || text.lines().any(|line| line.trim_start().starts_with("fn ") && line.contains(filter))
            })
        };
        filters.retain(|filter| !has(filter));
        assert!(filters.is_empty(), "{command}: no test has {filters:?} in its name");
    }
}

/// What several verbs share does not use one of them; otherwise most of `src` would be one circle of modules.
#[test]
fn shared_modules_use_no_verb() {
    let mut wrong = Vec::new();
    for (path, text) in prose_files().into_iter().filter(|(path, _)| path.starts_with("src/shared/")) {
        let uses = text.lines().filter(|line| line.contains("crate::verbs") || line.contains("crate::args"));
        wrong.extend(uses.map(|line| format!("{path}: {}", line.trim())));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
