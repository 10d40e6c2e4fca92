//! The documentation page, the schema and the examples agree with the format that the parser accepts.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use scenario::{KEYS, STEP_KEYS, parse};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn text(file: &str) -> String {
    fs::read_to_string(root().join(file)).expect(file)
}

fn read(what: &str, text: &str) {
    if let Err(faults) = parse(what, text) {
        panic!("{what}: {}\n{text}", faults[0]);
    }
}

#[test]
fn the_examples_are_read() {
    let mut read_some = 0;
    for folder in ["examples", "examples/avr"] {
        for entry in fs::read_dir(root().join(folder)).expect(folder) {
            let path = entry.expect("an entry").path();
            // emu.toml lists tests; it is no scenario.
            let is_manifest = path.file_name().is_some_and(|name| name == "emu.toml");
            if path.extension().is_some_and(|ending| ending == "toml") && !is_manifest {
                read(&path.display().to_string(), &fs::read_to_string(&path).expect("an example"));
                read_some += 1;
            }
        }
    }
    assert!(read_some >= 3);
}

/// Each row of the page's tables has an example; every piece in backquotes is a line of a step or of the
/// header.
#[test]
fn the_page_is_read() {
    let page = text("docs/scenario.md");
    for block in page.split("```toml\n").skip(1) {
        read("a block of the page", block.split("```").next().unwrap_or_default());
    }
    let mut reported = BTreeSet::new();
    for row in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").collect();
        let key = cells[0].trim().trim_matches('`');
        reported.insert(key.to_owned());
        let pieces: Vec<&str> = cells[2].split('`').skip(1).step_by(2).filter(|piece| piece.contains(" = ")).collect();
        assert!(!pieces.is_empty(), "{row}");
        if KEYS.contains(&key) {
            read(row, &pieces.join("\n"));
        } else {
            let verb = match key {
                "every" => "toggle = \"Xa\"\n",
                "between" => "never = { Xa = 1 }\n",
                _ => "",
            };
            read(row, &format!("[[step]]\n{verb}{}", pieces.join("\n")));
        }
    }
    let all = KEYS.iter().copied().filter(|key| *key != "step");
    let verbs = STEP_KEYS.iter().filter(|key| key.is_action).map(|key| key.name);
    let missing: Vec<_> =
        all.chain(verbs).chain(["at", "after", "every", "between"]).filter(|key| !reported.contains(*key)).collect();
    assert!(missing.is_empty(), "no row for {missing:?}");
}

#[test]
fn the_schema_has_the_keys_that_are_read() {
    let schema: serde_json::Value = serde_json::from_str(&text("docs/scenario.schema.json")).expect("JSON");
    let keys = |of: &serde_json::Value| -> BTreeSet<String> {
        of["properties"].as_object().expect("properties").keys().cloned().collect()
    };
    let known: BTreeSet<String> = KEYS.iter().map(|key| (*key).to_owned()).collect();
    assert_eq!(keys(&schema), known);
    let known: BTreeSet<String> = STEP_KEYS.iter().map(|key| key.name.to_owned()).collect();
    assert_eq!(keys(&schema["$defs"]["step"]), known);
}

/// Rows are `text | code, line and column of each fault`.
#[test]
fn faults_have_their_places() {
    let rows = [
        ("limit = 5", "SCN004 1:9"),
        ("limit = \"5\"", "SCN004 1:9"),
        ("a = [", "SCN001 1:6"),
        ("stp = 1", "SCN002 1:1"),
        ("set = { Xa = 1 }", "SCN002 1:1"),
        ("step = 1", "SCN003 1:8"),
        ("[[step]]", "SCN005 1:1"),
        ("[[step]]\nset = { Xa = 1.5 }", "SCN003 2:14"),
        ("[[step]]\nset = {}", "SCN003 2:7"),
        ("[[step]]\nset = { Xa = 1 }\nlog = \"x\"", "SCN005 3:1"),
        ("[[step]]\npulse = { Xa = 1 }", "SCN005 2:1"),
        ("[[step]]\npulse = { Xa = 2 }\nfor = \"1s\"", "SCN003 2:16"),
        ("[[step]]\nramp = { A = 1 }\nover = \"1s\"", "SCN003 2:14"),
        ("[[step]]\nrepeat = 0\nsteps = []", "SCN003 2:10"),
        ("[[step]]\nrepeat = 2", "SCN005 2:1"),
        ("[[step]]\nlog = \"\"", "SCN003 2:7"),
        ("[[step]]\nlog = \"x\"\nwithin = \"1s\"", "SCN005 3:1"),
        ("[[step]]\nlog = \"x\"\ntimes = 2", "SCN005 3:9"),
        ("[[step]]\nlog = \"x\"\nevery = \"0s\"", "SCN004 3:9"),
        ("[[step]]\nexpect = { Xa = \"7..3\" }", "SCN003 2:17"),
        ("[[step]]\nexpect = { Xa = \"> 9223372036854775807\" }", "SCN003 2:17"),
        ("[[step]]\nuart-send = [256]", "SCN003 2:13"),
        ("[[step]]\npower-cycle = false", "SCN003 2:15"),
        ("[[step]]\nat = \"1s\"\nafter = \"1s\"", "SCN005 3:9"),
        ("[[step]]\nexpect = { Xa = 1 }\nbetween = [\"1s\"]", "SCN003 3:11"),
        ("[[step]]\nexpect = { Xa = 1 }\nbetween = [\"1s\", \"2s\"]\nevery = \"1s\"", "SCN005 4:9"),
        ("[[step]]\n\"öl\" = 1\nfoo = 2", "SCN002 2:1, SCN002 3:1"),
    ];
    for (text, wanted) in rows {
        let faults = parse("x", text).err().unwrap_or_default();
        let mut reported: Vec<_> =
            faults.iter().map(|f| format!("{} {}:{}", f.code, f.pos.line, f.pos.column)).collect();
        let mut wanted: Vec<_> = wanted.split(", ").map(str::to_owned).collect();
        reported.sort();
        wanted.sort();
        assert_eq!(reported, wanted, "{text}");
    }
}
