//! Computes the configuration words that an image needs.

use emu_pic16::chips::{ConfigLayout, OscillatorMode, Pic16Part};

/// Returns the configuration words: byte address in the HEX file, and bytes.
#[must_use]
pub fn config_words(part: &Pic16Part, clock_hz: u64) -> Vec<(u32, Vec<u8>)> {
    let config = &part.config;
    let wanted = oscillator(clock_hz).0;
    let (mask, kinds) = config.fosc;
    let code = kinds.iter().position(|&kind| kind == wanted).unwrap_or(0);
    let erased = config.erased.first().copied().unwrap_or(0x3FFF);
    let timer = if config.pwrte.1 { config.pwrte.0 } else { 0 };
    let first =
        erased & !(mask | config.wdte | config.pwrte.0 | config.lvp) | ConfigLayout::deposit_bits(code, mask) | timer;
    let second = config.erased.get(1).map(|erased| erased & !(config.fcmen | config.ieso));
    let all = config.words.iter().zip([Some(first), second]);
    all.filter_map(|(addr, word)| Some((u32::from(*addr) * 2, word?.to_le_bytes().to_vec()))).collect()
}

/// Oscillator mode for a clock frequency (DS30292, 12.2), and its name.
fn oscillator(clock_hz: u64) -> (OscillatorMode, &'static str) {
    match clock_hz {
        0..=200_000 => (OscillatorMode::Lp, "LP"),
        200_001..=4_000_000 => (OscillatorMode::Xt, "XT"),
        _ => (OscillatorMode::Hs, "HS"),
    }
}

/// Describes the configuration for users, one line per setting.
#[must_use]
pub fn config_lines(part: &Pic16Part, clock_hz: u64) -> Vec<String> {
    let mut lines: Vec<String> = config_words(part, clock_hz)
        .iter()
        .filter_map(|(addr, bytes)| {
            let word = u16::from_le_bytes([*bytes.first()?, *bytes.get(1)?]);
            Some(format!("word {:04X}h = {word:04X}h, in the HEX file", addr / 2))
        })
        .collect();
    lines.push(format!("FOSC = {}: crystal of {clock_hz} Hz at OSC1 and OSC2", oscillator(clock_hz).1));
    lines.push("WDTE = 0: the watchdog is off".to_owned());
    lines.push("PWRTE = 0, BOREN = 1: starts late enough, and again after a brown-out".to_owned());
    lines.push("LVP = 0: the pin PGM is a port".to_owned());
    if part.config.mclre != 0 {
        lines.push("MCLRE = 1: pin 4 resets".to_owned());
    }
    if part.config.fcmen != 0 {
        lines.push("FCMEN = 0, IESO = 0: no other clock is ever used".to_owned());
    }
    lines.push("nothing is protected".to_owned());
    lines
}
