//! The keys of a scenario, a row each: the parser, the schema and the messages read these.

/// A key and what it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepKey {
    /// Its name.
    pub name: &'static str,
    /// It is a verb: a step has at most one of these.
    pub is_action: bool,
    /// Keys that may stand beside it, of those that do not go with every verb.
    pub allowed_with: &'static [&'static str],
}

/// The keys of the file.
pub const KEYS: &[&str] = &["program", "mcu", "limit", "baud", "step"];

const fn action_key(name: &'static str, with: &'static [&'static str]) -> StepKey {
    StepKey { name, is_action: true, allowed_with: with }
}

const fn modifier_key(name: &'static str) -> StepKey {
    StepKey { name, is_action: false, allowed_with: &[] }
}

/// Keys of a step that is done again and again.
const REPETITION_KEYS: &[&str] = &["every", "times", "until"];

/// The keys of a step.
#[rustfmt::skip]
pub const STEP_KEYS: &[StepKey] = &[
    modifier_key("name"),
    modifier_key("at"),
    modifier_key("after"),
    modifier_key("every"),
    modifier_key("times"),
    modifier_key("until"),
    modifier_key("between"),
    modifier_key("for"),
    modifier_key("over"),
    modifier_key("grain"),
    modifier_key("within"),
    modifier_key("steps"),
    action_key("set",         REPETITION_KEYS),
    action_key("pulse",       &["every", "times", "until", "for"]),
    action_key("toggle",      REPETITION_KEYS),
    action_key("ramp",        &["over", "grain"]),
    action_key("uart-send",   REPETITION_KEYS),
    action_key("expect",      &["every", "times", "until", "between"]),
    action_key("expect-uart", &["within"]),
    action_key("wait",        &["within"]),
    action_key("never",       &["between"]),
    action_key("repeat",      &["steps"]),
    action_key("snapshot",    &[]),
    action_key("log",         REPETITION_KEYS),
    action_key("power-cycle", &[]),
];
