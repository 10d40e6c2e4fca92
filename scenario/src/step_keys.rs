//! The keys of a scenario, one row each: the parser, the schema and the messages use these tables.

/// A key of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepKey {
    /// The name of the key.
    pub name: &'static str,
    /// True if the key is an action; a step has at most one action.
    pub is_action: bool,
    /// Keys that may be combined with this action, in addition to those that all actions allow.
    pub allowed_with: &'static [&'static str],
}

/// The top-level keys of the file.
pub const KEYS: &[&str] = &["program", "mcu", "limit", "baud", "step"];

const fn action_key(name: &'static str, with: &'static [&'static str]) -> StepKey {
    StepKey { name, is_action: true, allowed_with: with }
}

const fn modifier_key(name: &'static str) -> StepKey {
    StepKey { name, is_action: false, allowed_with: &[] }
}

/// The keys of a repeated step.
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
