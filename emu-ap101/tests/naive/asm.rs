//! The smallest assembler for the programs of these tests: labels before a colon, the sixteen instructions,
//! `.word`, `TIM`, and the directives that fill the configuration block.

use std::collections::BTreeMap;

use super::config::{BLOCK, Config, Entry, Record};
use super::decode::OPS;

/// Kinds and units of modules, indexed by their numbers in the block.
pub const KINDS: [&str; 8] = ["NONE", "TON", "TOF", "RTO", "TP", "CTU", "CTD", "CTC"];
pub const UNITS: [&str; 4] = ["cycle", "1ms", "10ms", "100ms"];

/// Assembles a program into the bytes of an image.
pub fn assemble(text: &str) -> Vec<Option<u8>> {
    let mut labels = BTreeMap::new();
    let mut words = Vec::new();
    // The second pass knows all labels.
    for _ in 0..2 {
        words = read(text, &mut labels);
    }
    let mut bytes = vec![None; 0x1300];
    for (at, word) in words {
        let [low, high] = u16::to_le_bytes(word);
        (bytes[2 * at], bytes[2 * at + 1]) = (Some(low), Some(high));
    }
    if let Some(config) = block(text, &labels) {
        for (at, byte) in config.write().into_iter().enumerate() {
            bytes[BLOCK + at] = Some(byte);
        }
    }
    bytes
}

fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(|line| line.split(';').next().unwrap_or("").trim()).filter(|line| !line.is_empty())
}

fn read(text: &str, labels: &mut BTreeMap<String, u16>) -> Vec<(usize, u16)> {
    let mut words = Vec::new();
    let mut here = 0;
    for line in lines(text) {
        let mut rest = line;
        if let Some((name, behind)) = line.split_once(':') {
            labels.insert(name.to_string(), here as u16);
            rest = behind.trim();
        }
        let (name, operand) = rest.split_once(' ').unwrap_or((rest, ""));
        let operand = operand.trim();
        let mut put = |word: u16| {
            words.push((here, word));
            here += 1;
        };
        match name {
            ".word" => put(u16::from_str_radix(operand.trim_start_matches("0x"), 16).expect("a word in hex")),
            // One line, two words (rule 12).
            "TIM" => {
                let (module, data) = operand.split_once(",#").expect("a module and data");
                put(0x2000 + address(module, labels) + 256);
                put(0xF000 + data.parse::<u16>().expect("data"));
            }
            "org" => here = usize::from(number(operand, labels)),
            _ => {
                if let Some(code) = OPS.iter().position(|op| op.0 == name) {
                    let mut word = (code as u16) * 4096 + address(operand, labels);
                    // A plain NOP is all ones (rule 2).
                    if name == "NOP" && operand.is_empty() {
                        word = 0xFFFF;
                    }
                    put(word);
                } else {
                    assert!(name.is_empty() || DIRECTIVES.contains(&name), "{line}");
                }
            }
        }
    }
    words
}

/// The eleven bits of an address, with the bit for its mode.
fn address(text: &str, labels: &BTreeMap<String, u16>) -> u16 {
    let (text, index) = match text.split_once(',') {
        Some((text, _)) => (text, 2048),
        None => (text, 0),
    };
    let zones = [('I', 0), ('E', 512), ('R', 1024), ('M', 1536)];
    let zone = zones.iter().find(|zone| text.strip_prefix(zone.0).is_some_and(|rest| rest.parse::<u16>().is_ok()));
    index + zone.map_or_else(|| number(text, labels), |zone| zone.1 + text[1..].parse::<u16>().expect("an address"))
}

fn number(text: &str, labels: &BTreeMap<String, u16>) -> u16 {
    if text.is_empty() { 0 } else { text.parse().unwrap_or_else(|_| labels.get(text).copied().unwrap_or(0)) }
}

const DIRECTIVES: [&str; 8] = ["clock", "inputs", "mode", "period", "channels", "program", "module", "org"];

/// The configuration given by the directives; `None` if there are none.
fn block(text: &str, labels: &BTreeMap<String, u16>) -> Option<Config> {
    let mut config = Config::none();
    let (mut any, mut programs) = (false, 0);
    for line in lines(text) {
        let (name, operand) = line.split_once(' ').unwrap_or((line, ""));
        let parts: Vec<&str> = operand.split(',').map(str::trim).collect();
        any |= DIRECTIVES.contains(&name) && name != "org";
        match name {
            "clock" => config.hz = operand.parse().expect("Hz"),
            "inputs" => config.live = operand == "live",
            "mode" => config.reconfigurable = operand == "reconfigurable",
            "period" => config.period = operand.trim_end_matches('c').parse().expect("cycles"),
            "channels" => {
                config.inputs = usize::from(number(parts[0], labels));
                config.outputs = usize::from(number(parts[1], labels));
            }
            "program" => {
                let (start, last) = (number(parts[0], labels), number(parts[1], labels));
                let rx = parts.get(2).map_or(0, |rx| number(rx, labels));
                let enabled = parts.get(3) != Some(&"off");
                config.programs[programs] = Entry { start, last, rx, present: true, enabled };
                programs += 1;
            }
            "module" => {
                let kind = KINDS.iter().position(|kind| *kind == parts[1]).expect("a kind") as u8;
                let unit = UNITS.iter().position(|unit| *unit == parts[2]).unwrap_or(0) as u8;
                let preset = parts.last().and_then(|preset| preset.parse().ok()).expect("a preset");
                config.modules[usize::from(number(&parts[0][1..], labels))] = Record { kind, unit, preset };
            }
            _ => {}
        }
    }
    any.then_some(config)
}
