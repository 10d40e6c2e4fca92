//! Reads `emu.toml`, the list of the tests of a project. `docs/test.md` describes it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use diag::{Diagnostic, Pos, Severity, nearest};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::shared::codes::MANIFEST;
use crate::verbs::test::cases::TestCase;

/// Name of the file.
pub const FILE_NAME: &str = "emu.toml";

/// The verbs that a test can name. Each has a table of flags for all its tests, too.
const VERBS: [&str; 3] = ["run", "sim", "check"];

/// A value with its position.
type LocatedValue<'a> = Spanned<DeValue<'a>>;

/// The flags of a table, in the order of their names: the arguments of each.
type Flags = BTreeMap<String, Vec<String>>;

/// Reads the tests of an `emu.toml`. `file` is its name for messages and `folder` the folder with its files.
///
/// # Errors
/// All faults of the file, as CLI016.
pub fn read_manifest(file: &str, folder: Option<&Path>, text: &str) -> Result<Vec<TestCase>, Vec<Diagnostic>> {
    let mut reader = ManifestReader { file, text, faults: Vec::new() };
    let cases = match DeTable::parse(text) {
        Ok(table) => reader.read(table.get_ref(), folder),
        Err(error) => {
            let cause = format!("this is not TOML: {}", error.message().lines().next().unwrap_or_default());
            reader.report(error.span().map_or(0, |span| span.start), cause, "docs/test.md has examples");
            Vec::new()
        }
    };
    if reader.faults.is_empty() { Ok(cases) } else { Err(reader.faults) }
}

struct ManifestReader<'t> {
    file: &'t str,
    text: &'t str,
    faults: Vec<Diagnostic>,
}

impl ManifestReader<'_> {
    /// Reports a fault at a byte offset.
    fn report(&mut self, at: usize, cause: impl Into<String>, hint: impl Into<String>) {
        let before = self.text.get(..at).unwrap_or_default();
        let line = before.matches('\n').count() as u32 + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() as u32 + 1;
        let pos = Pos::new(line, column, 1);
        self.faults.push(Diagnostic::new(Severity::Error, MANIFEST, self.file, pos, cause, hint));
    }

    fn read(&mut self, table: &DeTable<'_>, folder: Option<&Path>) -> Vec<TestCase> {
        let mut common: BTreeMap<&str, Flags> = BTreeMap::new();
        let mut tests: &[LocatedValue<'_>] = &[];
        for (key, value) in table {
            let name: &str = key.get_ref();
            match (VERBS.iter().find(|verb| **verb == name), value.get_ref()) {
                (Some(verb), DeValue::Table(flags)) => _ = common.insert(verb, self.flags(flags)),
                (None, DeValue::Array(list)) if name == "test" => tests = list,
                _ => {
                    let near = nearest(name, VERBS.into_iter().chain(["test"]));
                    let hint = near.map_or(String::new(), |near| format!("did you mean {near}? "));
                    let hint = format!("{hint}write [[test]] for a test, and [run], [sim] or [check] for common flags");
                    self.report(key.span().start, format!("`{name}` is not a table of emu.toml"), hint);
                }
            }
        }
        let mut cases: Vec<TestCase> = Vec::new();
        for test in tests {
            let DeValue::Table(entries) = test.get_ref() else {
                self.report(test.span().start, "a test is not a table", "write [[test]] and keys below it");
                continue;
            };
            let Some(case) = self.test(entries, test.span().start, &common, folder) else { continue };
            if cases.iter().any(|other| other.name == case.name) {
                let cause = format!("two tests have the name `{}`", case.name);
                self.report(test.span().start, cause, "give one of them another name: name = \"..\"");
            }
            cases.push(case);
        }
        cases
    }

    fn test(
        &mut self,
        entries: &DeTable<'_>,
        at: usize,
        common: &BTreeMap<&str, Flags>,
        folder: Option<&Path>,
    ) -> Option<TestCase> {
        let faults_before = self.faults.len();
        let (mut name, mut exit_code, mut verb) = (None, 0, None);
        let mut own = Flags::new();
        for (key, value) in entries {
            let key_name: &str = key.get_ref();
            match (key_name, value.get_ref()) {
                ("name", DeValue::String(text)) if !text.is_empty() => name = Some(text.to_string()),
                ("exit", DeValue::Integer(number)) => match number.as_str().parse::<u8>() {
                    Ok(code) => exit_code = code,
                    Err(_) => self.report(value.span().start, "an exit code is a number from 0 to 255", "0 is success"),
                },
                ("name" | "exit", _) => {
                    let cause = format!("`{key_name}` has a value of the wrong type");
                    self.report(value.span().start, cause, "write name = \"text\" and exit = 0");
                }
                _ if VERBS.contains(&key_name) => {
                    let files = self.texts(value);
                    if let Some((other, _)) = verb.replace((key_name.to_owned(), files)) {
                        let cause = format!("a test has one command, but `{other}` and `{key_name}` are two");
                        self.report(key.span().start, cause, "make two tests of it");
                    }
                }
                _ => _ = own.insert(key_name.to_owned(), self.arguments(key_name, value)),
            }
        }
        let Some((verb, files)) = verb else {
            let hint = "add run = \"IMAGE\", check = \"PROGRAM\" or sim = \"PROGRAM\"";
            self.report(at, "a test has no command", hint);
            return None;
        };
        if self.faults.len() > faults_before {
            return None;
        }
        let mut flags = common.get(verb.as_str()).cloned().unwrap_or_default();
        flags.extend(own);
        let name = name.unwrap_or_else(|| default_name(&verb, &files, &flags));
        let arguments = [verb.clone()].into_iter().chain(files.clone()).chain(flags.into_values().flatten()).collect();
        let line = self.text.get(..at).unwrap_or_default().matches('\n').count() as u32 + 1;
        let folder = folder.map(PathBuf::from);
        Some(TestCase { name, file: self.file.to_owned(), line, folder, arguments, exit_code })
    }

    /// Returns the arguments of all keys of a table.
    fn flags(&mut self, table: &DeTable<'_>) -> Flags {
        table.iter().map(|(key, value)| (key.get_ref().to_string(), self.arguments(key.get_ref(), value))).collect()
    }

    /// Returns the arguments of a key: `mcu = "8051"` is `--mcu=8051`, a list repeats the flag, `true` is the
    /// flag alone and `false` is nothing.
    fn arguments(&mut self, key: &str, value: &LocatedValue<'_>) -> Vec<String> {
        match value.get_ref() {
            DeValue::Boolean(true) => vec![format!("--{key}")],
            DeValue::Boolean(false) => Vec::new(),
            _ => self.texts(value).into_iter().map(|text| format!("--{key}={text}")).collect(),
        }
    }

    /// Returns a text, a number, or a list of them.
    fn texts(&mut self, value: &LocatedValue<'_>) -> Vec<String> {
        match value.get_ref() {
            DeValue::String(text) => vec![text.to_string()],
            DeValue::Integer(number) => vec![number.as_str().to_owned()],
            DeValue::Float(number) => vec![number.as_str().to_owned()],
            DeValue::Array(list) => list.iter().flat_map(|item| self.texts(item)).collect(),
            DeValue::Boolean(_) | DeValue::Datetime(_) | DeValue::Table(_) => {
                let hint = "write \"text\", a number, or a list of them: pin = [\"Xa=PD2\", \"Yb=PB5\"]";
                self.report(value.span().start, "a flag takes a text, a number, or a list of them", hint);
                Vec::new()
            }
        }
    }
}

/// Returns the name of a test that has none: its verb, files and scenario.
fn default_name(verb: &str, files: &[String], flags: &Flags) -> String {
    let scenario = flags.get("scenario").into_iter().flatten().filter_map(|flag| flag.split_once('='));
    let words: Vec<&str> = files.iter().map(String::as_str).chain(scenario.map(|(_, file)| file)).collect();
    format!("{verb} {}", words.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The commands of a manifest, or its faults as `line: cause`.
    fn outcome(text: &str) -> Vec<String> {
        match read_manifest("emu.toml", None, text) {
            Ok(cases) => cases.iter().map(|case| format!("{}: {}", case.name, case.command())).collect(),
            Err(faults) => faults.iter().map(|fault| format!("{}: {}", fault.pos.line, fault.cause)).collect(),
        }
    }

    #[test]
    fn manifests_give_commands_or_faults() {
        for (text, wanted) in [
            ("", vec![]),
            (
                "[sim]\nscans = 3\n[[test]]\nsim = 'a b.ld'\nset = ['x=1', 'y=2']\nwave = true",
                vec!["sim a b.ld: emu sim 'a b.ld' --scans=3 --set=x=1 --set=y=2 --wave"],
            ),
            (
                "[check]\nmcu = '8051'\n[[test]]\ncheck = ['a.ld', 'b.ld']\nmcu = false\nseed = 7",
                vec!["check a.ld b.ld: emu check a.ld b.ld --seed=7"],
            ),
            ("[[test]]\nrun = 'a.hex'\nscenario = 's.toml'", vec!["run a.hex s.toml: emu run a.hex --scenario=s.toml"]),
            ("[chek]\nmcu = 1", vec!["1: `chek` is not a table of emu.toml"]),
            ("test = 5", vec!["1: `test` is not a table of emu.toml"]),
            ("test = [5]", vec!["1: a test is not a table"]),
            ("[[test]]\nname = 5\nsim = 'a.ld'", vec!["2: `name` has a value of the wrong type"]),
            ("[[test]]\nscans = 5", vec!["1: a test has no command"]),
            ("[[test]]\nrun = 'a'\nsim = 'b'", vec!["3: a test has one command, but `run` and `sim` are two"]),
            ("[[test]]\nsim = 'a'\nset = { a = 1 }", vec!["3: a flag takes a text, a number, or a list of them"]),
            ("[[test]]\nsim = 'a'\nexit = 300", vec!["3: an exit code is a number from 0 to 255"]),
            ("[[test]]\nsim = 'a'\n[[test]]\nsim = 'a'", vec!["3: two tests have the name `sim a`"]),
            ("[[test]\n", vec!["1: this is not TOML: unclosed array table, expected `]`"]),
        ] {
            assert_eq!(outcome(text), wanted, "{text}");
        }
    }
}
