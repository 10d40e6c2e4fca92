//! Parses tables of names and values in braces, as in `set`, `ramp` and `expect`.

use toml::de::DeValue;

use super::{LocatedItem, QUOTES, ScenarioReader};
use crate::model::{Assignment, ConditionList, LocatedText, RampTarget, ScenarioValue, ValueCondition};
use crate::toml_values::{parse_comparison, parse_number};

impl ScenarioReader<'_> {
    /// The entries of a table in braces, in file order.
    fn read_entries<'i, 'd>(
        &mut self,
        verb: &str,
        item: &'i LocatedItem<'d>,
    ) -> Option<Vec<(LocatedText, &'i LocatedItem<'d>)>> {
        match item.get_ref() {
            DeValue::Table(table) if !table.is_empty() => {
                let mut entries: Vec<_> = table.iter().collect();
                entries.sort_by_key(|(key, _)| key.span().start);
                let mut out = Vec::new();
                for (key, item) in entries {
                    out.push((LocatedText { text: key.get_ref().to_string(), pos: self.pos(key.span()) }, item));
                }
                Some(out)
            }
            _ => {
                self.report_wrong_value(
                    item,
                    verb,
                    "names and values in braces",
                    &format!("as in {verb} = {{ Xstart = 1 }}"),
                );
                None
            }
        }
    }

    /// Parses assignments to names.
    pub(super) fn read_assignments(&mut self, verb: &str, item: &LocatedItem<'_>) -> Option<Vec<Assignment>> {
        let entries = self.read_entries(verb, item)?;
        let assigns = entries.into_iter().map(|(name, item)| {
            let value = self.read_value(&name.text, item)?;
            Some(Assignment { name, value, pos: self.pos(item.span()) })
        });
        // All entries are parsed before the first fault ends the step, so that every fault is reported.
        assigns.collect::<Vec<_>>().into_iter().collect()
    }

    /// Parses assignments of 0 and 1 only.
    pub(super) fn read_bit_assignments(&mut self, verb: &str, item: &LocatedItem<'_>) -> Option<Vec<Assignment>> {
        let entries = self.read_entries(verb, item)?;
        let assigns = self.read_assignments(verb, item)?;
        for ((_, item), assign) in entries.iter().zip(&assigns) {
            if !matches!(assign.value, ScenarioValue::Number(0 | 1)) {
                self.report_wrong_value(item, &assign.name.text, "0 or 1 in a pulse", "only bits have an opposite");
                return None;
            }
        }
        Some(assigns)
    }

    fn read_value(&mut self, name: &str, item: &LocatedItem<'_>) -> Option<ScenarioValue> {
        match item.get_ref() {
            DeValue::Integer(_) => parse_number(item).map(ScenarioValue::Number).or_else(|| {
                self.report_wrong_value(item, name, "a number of 64 bits", "write a smaller one");
                None
            }),
            DeValue::Boolean(bit) => Some(ScenarioValue::Number((*bit).into())),
            DeValue::String(text) => Some(ScenarioValue::Text(text.to_string())),
            _ => {
                let hint = match item.get_ref() {
                    DeValue::Table(_) => QUOTES,
                    _ => "a voltage is a text with its unit, as in \"1.25V\"",
                };
                self.report_wrong_value(item, name, "a whole number or a text", hint);
                None
            }
        }
    }

    /// Parses the names of a ramp with their first and last values.
    pub(super) fn read_ramp(&mut self, item: &LocatedItem<'_>) -> Option<Vec<RampTarget>> {
        let entries = self.read_entries("ramp", item)?;
        let mut out = Vec::new();
        for (name, item) in entries {
            let ends = match item.get_ref() {
                DeValue::Array(ends) if ends.len() == 2 => ends.first().zip(ends.get(1)),
                _ => None,
            };
            let Some((from, to)) = ends else {
                self.report_wrong_value(item, &name.text, "a first and a last value", "as in { Alevel = [0, 1023] }");
                return None;
            };
            let (from, to) = (self.read_value(&name.text, from)?, self.read_value(&name.text, to)?);
            out.push(RampTarget { name, from, to, pos: self.pos(item.span()) });
        }
        Some(out)
    }

    /// Parses conditions on names.
    pub(super) fn read_conditions(&mut self, verb: &str, item: &LocatedItem<'_>) -> Option<ConditionList> {
        let entries = self.read_entries(verb, item)?;
        let tests = entries.into_iter().map(|(name, item)| {
            let value = self.read_value(&name.text, item)?;
            let Some(compare) = parse_comparison(&value) else {
                let wanted = "a number or a comparison";
                self.report_wrong_value(
                    item,
                    &name.text,
                    wanted,
                    "as in 1, \"> 5\", \">= 5\", \"!= 0\", \"3..7\" or \"z\"",
                );
                return None;
            };
            let text = match &value {
                ScenarioValue::Number(number) => number.to_string(),
                ScenarioValue::Text(text) => text.trim().to_owned(),
            };
            Some(ValueCondition { name, comparison: compare, text, pos: self.pos(item.span()) })
        });
        tests.collect::<Vec<_>>().into_iter().collect()
    }
}
