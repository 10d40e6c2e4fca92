//! What of a program a check has exercised, for the report.

use serde::Serialize;

/// Kinds of things that count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CoverageClass {
    /// Contacts: pass and block a true rung.
    Contacts,
    /// Branches of parallel groups: true and false at their end.
    Branches,
    /// Coils: store both values; set and reset coils: act and rest.
    Coils,
    /// Comparisons: true and false on a true rung.
    Compares,
    /// Timers: run, expire, are reset (RTO: hold on a false rung).
    Timers,
    /// Counters: count, wrap, stand at and below their limit.
    Counters,
    /// OSR and OSF: fire, and stay quiet without an edge.
    OneShots,
    /// Master relays: with a true and a false rung.
    MasterRelays,
    /// MOVE, arithmetic and RES: act and rest.
    Actions,
    /// LOOK_UP_TABLE and PIECEWISE_LINEAR: inside and outside of the table, each segment.
    Tables,
    /// SHIFT_REGISTER: shifts, and rests.
    ShiftRegisters,
    /// UART_SEND, UART_RECV, FORMATTED_STRING: a byte goes or comes, and none.
    Serial,
    /// READ_ADC and SET_PWM act and rest; PERSIST writes and rests.
    Peripherals,
}

impl CoverageClass {
    /// Its name in the plural, such as `contacts`.
    #[must_use]
    pub fn name(self) -> &'static str {
        CoverageClass::ALL_CLASSES.iter().find(|(class, ..)| *class == self).map_or("", |(_, name, _)| name)
    }

    /// All classes with their name and what covering one means, in the order of the report.
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

/// How much of one class was exercised.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ClassCoverage {
    /// Which class.
    pub class: CoverageClass,
    /// How many of `total` did everything that counts.
    pub covered: u32,
    /// How many can do everything that counts, as far as is known.
    pub total: u32,
    /// How many more there are, that cannot do everything that counts: a contact behind OPEN, a coil on a rung that is
    /// always true. What they can do is not counted here; [`LadderCoverage::missing`] names what of it was not seen.
    pub impossible: u32,
}

/// Something that was not seen.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MissingOutcome {
    /// Rung, from 1.
    pub rung: u32,
    /// Element within the rung, from 1; of a branch its first.
    pub element: u32,
    /// That element as `.ld` text.
    pub element_text: String,
    /// What it is.
    pub class: CoverageClass,
    /// What it was not seen doing.
    pub what: String,
    /// Why it cannot ever do that; nothing where it might.
    pub impossible: Option<String>,
}

/// The coverage of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LadderCoverage {
    /// Everything that is not known to be impossible was seen.
    pub full: bool,
    /// By class, those that the program has.
    pub classes: Vec<ClassCoverage>,
    /// What was not seen, in the order of the program.
    pub missing: Vec<MissingOutcome>,
}

impl LadderCoverage {
    /// `items` are the things of the program, each with true for all seen, false for not, nothing for "cannot do all".
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

    /// One line for the classes.
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

    /// One line for each thing that was not seen.
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
