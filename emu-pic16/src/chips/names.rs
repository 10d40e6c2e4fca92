//! Named constants of each chip in the spelling of the headers of gputils
//! ([`Chip::constants`](emu_core::chip::Chip::constants)): register bits, register pairs, destinations, and
//! values for the configuration words.
//!
//! A configuration value has all bits of its word set, except the bits that it clears, so that values can be
//! combined with `&`. It is computed from the masks of the row ([`ConfigLayout`]). A chip accepts every
//! spelling that any header of the family has for a feature of the chip; `tests/headers.rs` reads all
//! headers.

use emu_core::NamedConstant;
use emu_core::pins::PinId;

use super::{ALIASES, ConfigLayout, NO_PIN, OscillatorMode, Pic16Part, part};

/// All bits of a program word.
const ERASED_WORD: u16 = 0x3FFF;

/// Mask of DEBUG, which every chip has that can write its own program memory.
const DEBUG_BIT: u16 = 1 << 11;

/// A configuration value and the function that computes it.
struct ConfigName {
    /// Its spellings, separated by blanks.
    names: &'static str,
    /// Computes the value for a chip; None if the chip does not have it.
    value: fn(&Pic16Part) -> Option<u16>,
}

/// Makes a row of [`CONFIG_NAMES`].
const fn named(names: &'static str, value: fn(&Pic16Part) -> Option<u16>) -> ConfigName {
    ConfigName { names, value }
}

/// Configuration values that each depend on one feature.
#[rustfmt::skip]
const CONFIG_NAMES: &[ConfigName] = &[
    named("_FOSC_LP _LP_OSC",           |part| oscillator(part, OscillatorMode::Lp, 0)),
    named("_FOSC_XT _XT_OSC",           |part| oscillator(part, OscillatorMode::Xt, 0)),
    named("_FOSC_HS _HS_OSC",           |part| oscillator(part, OscillatorMode::Hs, 0)),
    named("_FOSC_EC _FOSC_ECIO _EXTCLK _EXTCLK_OSC", |part| oscillator(part, OscillatorMode::Ec, 0x40)),
    named("_FOSC_INTOSCIO _INTRC_OSC_NOCLKOUT _INTOSC_OSC_NOCLKOUT _INTRC_IO", |part| oscillator(part, OscillatorMode::Internal, 0xC0)),
    named("_FOSC_INTOSCCLK _INTRC_OSC_CLKOUT _INTOSC_OSC_CLKOUT _INTRC_CLKOUT", |part| oscillator(part, OscillatorMode::Internal, 0x80)),
    named("_FOSC_ERIO _ER_OSC_NOCLKOUT _FOSC_EXTRCIO _RC_OSC_NOCLKOUT _EXTRC_IO", |part| oscillator(part, OscillatorMode::Rc, 0x40)),
    named("_FOSC_ERCLK _ER_OSC_CLKOUT _FOSC_EXTRCCLK _RC_OSC_CLKOUT _EXTRC_CLKOUT", |part| clock_out(part, true)),
    named("_FOSC_EXTRC _FOSC_RC _RC_OSC", |part| clock_out(part, false)),
    named("_WDTE_OFF _WDT_OFF",         |part| with_bits_clear(part.config.wdte)),
    named("_WDTE_ON _WDT_ON",           |part| with_bits_set(part.config.wdte)),
    named("_PWRTE_OFF",                 |part| power_up(part, false)),
    named("_PWRTE_ON",                  |part| power_up(part, true)),
    named("_BOREN_OFF _BODEN_OFF",      |part| with_bits_clear(part.config.boren)),
    named("_BOREN_ON _BODEN_ON",        |part| with_bits_set(part.config.boren)),
    named("_MCLRE_OFF _MCLR_OFF",       |part| with_bits_clear(part.config.mclre)),
    named("_MCLRE_ON _MCLR_ON",         |part| with_bits_set(part.config.mclre)),
    named("_LVP_OFF",                   |part| with_bits_clear(part.config.lvp)),
    named("_LVP_ON",                    |part| with_bits_set(part.config.lvp)),
    named("_CPD_ON _DATA_CP_ON DATA_CP_ON", |part| with_bits_clear(part.config.cpd)),
    named("_CPD_OFF _DATA_CP_OFF DATA_CP_OFF", |part| with_bits_set(part.config.cpd)),
    named("_FCMEN_OFF",                 |part| with_bits_clear(part.config.fcmen)),
    named("_FCMEN_ON",                  |part| with_bits_set(part.config.fcmen)),
    named("_IESO_OFF",                  |part| with_bits_clear(part.config.ieso)),
    named("_IESO_ON",                   |part| with_bits_set(part.config.ieso)),
    named("_DEBUG_ON",                  |part| with_bits_clear(debug(part))),
    named("_DEBUG_OFF",                 |part| with_bits_set(debug(part))),
    named("_CCPMX_RB0 _CCP1_RB0",       |part| ccp1(part, "RB0")),
    named("_CCPMX_RB2 _CCP1_RB2",       |part| ccp1(part, "RB2")),
    named("_CCPMX_RB3 _CCP1_RB3",       |part| ccp1(part, "RB3")),
    named("_CP_OFF",                    |part| with_bits_set(part.config.cp)),
    named("_CP_ON _CP_ALL _CP_All",     |part| with_bits_clear(part.config.cp)),
    named("_CP_HALF",                   |part| protected(part, words(part) / 2)),
    named("_CP_UPPER_256",              |part| protected(part, words(part).checked_sub(256)?)),
    // Only the 16F628 has a field that protects quarters, written twice (DS40300, register 14-1).
    named("_CP_75",                     |part| (part.config.cp == 0x3C00).then_some(0x17FF)),
    named("_CP_50",                     |part| (part.config.cp == 0x3C00).then_some(0x2BFF)),
    named("_WRT_OFF _WRT_ENABLE_OFF",   |part| writable_from(part, words(part), 0)),
    named("_WRT_PROTECT_OFF",           |part| writable_from(part, words(part), 0).filter(|_| has_several_words(part))),
    named("_WRT_ON _WRT_ENABLE_ON",     |part| writable_from(part, 0, 0).filter(|_| !has_several_words(part))),
    named("_WRT_ALL",                   |part| writable_from(part, 0, words(part))),
    named("_WRT_PROTECT_ALL",           |part| protects(part, words(part))),
    named("_WRT_HALF",                  |part| protects(part, words(part) / 2)),
    named("_WRT_1FOURTH",               |part| protects(part, words(part) / 4)),
    named("_WRT_256 _WRT_PROTECT_256",  |part| protects(part, 256)),
    named("_WRT_512 _WRT_ENABLE_512",   |part| protects(part, 512)),
    named("_WRT_1024 _WRT_ENABLE_1024", |part| protects(part, 1024)),
    named("_WRT_1536 _WRT_ENABLE_1536", |part| protects(part, 1536)),
    named("_WRT_2048 _WRT_PROTECT_2048", |part| protects(part, 2048)),
    named("_CONFIG _CONFIG1",           |part| part.config.words.first().copied()),
    named("_CONFIG2",                   |part| part.config.words.get(1).copied()),
    named("_DEVID1",                    |part| part.device_id.map(|_| 0x2006)),
    named("_IDLOC0",                    |_| Some(0x2000)),
    named("_IDLOC1",                    |_| Some(0x2001)),
    named("_IDLOC2",                    |_| Some(0x2002)),
    named("_IDLOC3",                    |_| Some(0x2003)),
];

/// Returns the named constants of the chip `name`; empty for a chip of another crate.
pub(super) fn names_of_chip(name: &str) -> Vec<NamedConstant> {
    let Some(part) = part(name) else { return Vec::new() };
    let constant = |name, value: u16| NamedConstant { name, value: i32::from(value) };
    let mut all = vec![constant("W", 0), constant("F", 1)];
    all.extend(part.bits.iter().map(|bit| constant(bit.name, bit.bit.into())));
    all.extend(ALIASES.iter().filter_map(|&(name, sfr)| Some(constant(name, part.addr(sfr)?))));
    let values = CONFIG_NAMES.iter().filter_map(|row| Some((row.names, (row.value)(part)?)));
    all.extend(values.flat_map(|(names, value)| names.split(' ').map(move |name| constant(name, value))));
    all
}

/// Returns the value with the bits under `mask` clear; None if the chip has no such bits.
fn with_bits_clear(mask: u16) -> Option<u16> {
    (mask != 0).then_some(ERASED_WORD & !mask)
}

/// Returns the value with the bits under `mask` set; None if the chip has no such bits.
fn with_bits_set(mask: u16) -> Option<u16> {
    (mask != 0).then_some(ERASED_WORD)
}

fn words(part: &Pic16Part) -> u16 {
    (part.chip.on_chip_flash_bytes / 2) as u16
}

/// Returns the value of the bits under `mask` for the last matching index in the list. If several values have
/// the same meaning, the data sheets name the last one.
fn option_word<T>(mask: u16, list: &[T], fits: impl Fn(usize, &T) -> bool) -> Option<u16> {
    let place = (0..list.len()).zip(list).rfind(|&(i, value)| fits(i, value))?.0;
    Some(ERASED_WORD & !mask | ConfigLayout::deposit_bits(place, mask))
}

/// Reports whether the oscillator can leave its pins to port A.
fn shares_pins(part: &Pic16Part) -> bool {
    !part.config.osc_ports.is_empty()
}

fn oscillator(part: &Pic16Part, wanted: OscillatorMode, ports: u8) -> Option<u16> {
    let (mask, list) = part.config.fosc;
    let ports_of = |i: usize| part.config.osc_ports.get(i).copied();
    option_word(mask, list, |i, &osc| osc == wanted && ports_of(i).is_none_or(|its| its == ports))
        .filter(|_| ports == 0 || shares_pins(part))
}

/// RC oscillator with the clock on a pin. The headers use this name only on chips where the pin could be a
/// port.
fn clock_out(part: &Pic16Part, shared: bool) -> Option<u16> {
    oscillator(part, OscillatorMode::Rc, 0).filter(|_| shares_pins(part) == shared)
}

fn power_up(part: &Pic16Part, runs: bool) -> Option<u16> {
    let (mask, when_on) = part.config.pwrte;
    if runs == when_on { with_bits_set(mask) } else { with_bits_clear(mask) }
}

fn debug(part: &Pic16Part) -> u16 {
    if part.config.wrt.0 == 0 { 0 } else { DEBUG_BIT }
}

fn ccp1(part: &Pic16Part, pin: &str) -> Option<u16> {
    let (mask, one, zero) = part.config.ccpmx;
    let is = |id: PinId| id != NO_PIN && part.chip.pins.get(usize::from(id)).is_some_and(|row| row.name == pin);
    if is(one) { with_bits_set(mask) } else { with_bits_clear(mask).filter(|_| is(zero)) }
}

/// CP protects all words from `from` on; the field is twice in the word.
fn protected(part: &Pic16Part, from: u16) -> Option<u16> {
    let (mask, list) = part.config.cp_first;
    let first = option_word(mask, list, |_, &first| first == from)?;
    Some(first & !(mask << 8) | (first & mask) << 8)
}

/// Reports whether WRT is a field of several bits, not a single bit that permits writing.
fn has_several_words(part: &Pic16Part) -> bool {
    part.config.wrt.0.count_ones() > 1
}

/// Returns the value that lets the program write from a word on: `one` if WRT is a single bit, `number` if it
/// is a field.
fn writable_from(part: &Pic16Part, one: u16, number: u16) -> Option<u16> {
    let (mask, list) = part.config.wrt;
    let wanted = if has_several_words(part) { number } else { one };
    option_word(mask, list, |_, &first| first.min(words(part)) == wanted)
}

/// Returns the value of a WRT field that protects `count` words.
fn protects(part: &Pic16Part, count: u16) -> Option<u16> {
    writable_from(part, 0, count).filter(|_| has_several_words(part))
}
