//! Coverage of a ladder program by a check, as data for the report.

use serde::Serialize;

/// The classes of program items that coverage counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CoverageClass {
    /// Contacts: pass and block power on a true rung.
    Contacts,
    /// Branches of parallel groups: true and false at the end of the branch.
    Branches,
    /// Coils: store 0 and 1; set and reset coils: act on a true rung, rest on a false one.
    Coils,
    /// Comparisons: true and false on a true rung.
    Compares,
    /// Timers: run, expire, and are reset (RTO: hold their value on a false rung).
    Timers,
    /// Counters: count, wrap, are at and below their limit.
    Counters,
    /// OSR and OSF: fire on an edge, and stay quiet without one.
    OneShots,
    /// Master relays: have a true and a false rung.
    MasterRelays,
    /// MOVE, arithmetic and RES: act on a true rung, rest on a false one.
    Actions,
    /// LOOK_UP_TABLE and PIECEWISE_LINEAR: the index is inside and outside of the table, and in each segment.
    Tables,
    /// SHIFT_REGISTER: shifts on a true rung, rests on a false one.
    ShiftRegisters,
    /// UART_SEND, UART_RECV and FORMATTED_STRING: with a byte sent or received, and without one.
    Serial,
    /// READ_ADC and SET_PWM: act and rest; PERSIST: writes and rests.
    Peripherals,
}

impl CoverageClass {
    /// The name of the class in the plural, such as `contacts`.
    #[must_use]
    pub fn name(self) -> &'static str {
        CoverageClass::ALL_CLASSES.iter().find(|(class, ..)| *class == self).map_or("", |(_, name, _)| name)
    }

    /// All classes with their name and the word for full coverage, in the order of the report.
    #[rustfmt::skip]
    const ALL_CLASSES: [(CoverageClass, &'static str, &'static str); 13] = [
        (CoverageClass::Contacts,     "contacts",      "both ways"),
        (CoverageClass::Branches,     "branches",      "both ways"),
        (CoverageClass::Coils,        "coils",         "both values"),
        (CoverageClass::Compares,     "compares",      "both ways"),
        (CoverageClass::Timers,       "timers",        "expired and reset"),
        (CoverageClass::Counters,     "counters",      "in all states"),
        (CoverageClass::OneShots,     "one-shots",     "fired"),
        (CoverageClass::MasterRelays, "master relays", "both ways"),
        (CoverageClass::Actions,      "actions",       "both ways"),
        (CoverageClass::Tables,         "tables",          "in all parts"),
        (CoverageClass::ShiftRegisters, "shift registers", "shifted"),
        (CoverageClass::Serial,         "serial",          "with bytes and without"),
        (CoverageClass::Peripherals,    "peripherals",     "used"),
    ];
}

/// Coverage of one class.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ClassCoverage {
    /// The class.
    pub class: CoverageClass,
    /// How many items of `total` did everything that counts.
    pub covered: u32,
    /// How many items can do everything that counts, as far as is known.
    pub total: u32,
    /// How many further items cannot do everything that counts, such as a contact after OPEN or a coil on a
    /// rung that is always true. They are not part of `total`; [`LadderCoverage::missing`] lists what was not
    /// seen of them.
    pub impossible: u32,
}

/// An outcome of an element or branch that was not seen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingOutcome {
    /// Number of the rung, from 1.
    pub rung: u32,
    /// Number of the element within the rung, from 1; for a branch, its first element.
    pub element: u32,
    /// The element as `.ld` text.
    pub element_text: String,
    /// The class of the element or branch.
    pub class: CoverageClass,
    /// The outcome that was not seen.
    pub what: String,
    /// Why the outcome cannot occur; `None` if it may occur.
    pub impossible: Option<String>,
}

/// Coverage of a program by a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LadderCoverage {
    /// True if every outcome that is not known to be impossible was seen.
    pub full: bool,
    /// Coverage per class, for the classes that the program uses.
    pub classes: Vec<ClassCoverage>,
    /// The outcomes that were not seen, in program order.
    pub missing: Vec<MissingOutcome>,
}

impl LadderCoverage {
    /// Builds the coverage. `items` are the elements and branches, each with true if all outcomes were seen,
    /// false if not, `None` if one of them is impossible.
    pub(crate) fn new(
        items: impl Iterator<Item = (CoverageClass, Option<bool>)>,
        mut missing: Vec<MissingOutcome>,
    ) -> LadderCoverage {
        let items: Vec<_> = items.collect();
        let classes = CoverageClass::ALL_CLASSES.iter().filter_map(|&(class, _, _)| {
            let count = |wanted: &dyn Fn(Option<bool>) -> bool| {
                items.iter().filter(|(c, seen)| *c == class && wanted(*seen)).count() as u32
            };
            let row = ClassCoverage {
                class,
                covered: count(&|seen| seen == Some(true)),
                total: count(&|seen| seen.is_some()),
                impossible: count(&|seen| seen.is_none()),
            };
            (row.total + row.impossible > 0).then_some(row)
        });
        let classes = classes.collect();
        missing.sort_by_key(|m| (m.rung, m.element));
        LadderCoverage { full: missing.iter().all(|m| m.impossible.is_some()), classes, missing }
    }

    /// The coverage of all classes as one line of text.
    #[must_use]
    pub fn summary_line(&self) -> String {
        let class = |row: &ClassCoverage| {
            let (name, how) = CoverageClass::ALL_CLASSES
                .iter()
                .find(|(class, ..)| *class == row.class)
                .map_or(("", ""), |&(_, n, h)| (n, h));
            let more = if row.impossible > 0 { format!(" ({} more cannot)", row.impossible) } else { String::new() };
            format!("{name} {}/{} {how}{more}", row.covered, row.total)
        };
        let rows: Vec<String> = self.classes.iter().map(class).collect();
        let all = if rows.is_empty() { "nothing to cover".to_owned() } else { rows.join(", ") };
        format!("coverage: {all}\n")
    }

    /// One line of text per outcome that was not seen.
    #[must_use]
    pub fn missing_lines(&self) -> String {
        let line = |missing: &MissingOutcome| {
            let MissingOutcome { rung, element, element_text, what, .. } = missing;
            let branch = if missing.class == CoverageClass::Branches { "branch at " } else { "" };
            let why = match &missing.impossible {
                Some(why) => format!("impossible, {why}"),
                None => "not seen".to_owned(),
            };
            format!("  {branch}rung {rung}, element {element} `{element_text}` {what}: {why}\n")
        };
        self.missing.iter().map(line).collect()
    }
}
