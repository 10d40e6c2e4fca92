//! Named numbers of the chips, as the headers of gputils spell them ([`Chip::constants`](emu_core::chip::Chip::constants)): bits of
//! registers, register pairs, destinations, and values for the configuration words.
//!
//! A value has all bits of its word set but those that it stands for, so that values can be joined with `&`. It is worked out from
//! the masks of the row ([`Config`]); a chip knows every spelling that a header of the family has for what it has itself, and
//! `tests/headers.rs` reads them all.

use emu_core::pins::PinId;

use super::{ALIASES, Config, NO_PIN, Oscillator, Part, part};

/// All bits of a program word.
const ONES: u16 = 0x3FFF;

/// The debugger's bit, which every chip has that can write its own program memory.
const DEBUG: u16 = 1 << 11;

/// What a spelling stands for; the words between blanks are its spellings.
type Row = (&'static str, fn(&Part) -> Option<u16>);

/// Values that depend on one feature each.
#[rustfmt::skip]
const ROWS: &[Row] = &[
    ("_FOSC_LP _LP_OSC",           |part| oscillator(part, Oscillator::Lp, 0)),
    ("_FOSC_XT _XT_OSC",           |part| oscillator(part, Oscillator::Xt, 0)),
    ("_FOSC_HS _HS_OSC",           |part| oscillator(part, Oscillator::Hs, 0)),
    ("_FOSC_EC _FOSC_ECIO _EXTCLK _EXTCLK_OSC", |part| oscillator(part, Oscillator::Ec, 0x40)),
    ("_FOSC_INTOSCIO _INTRC_OSC_NOCLKOUT _INTOSC_OSC_NOCLKOUT _INTRC_IO", |part| oscillator(part, Oscillator::Internal, 0xC0)),
    ("_FOSC_INTOSCCLK _INTRC_OSC_CLKOUT _INTOSC_OSC_CLKOUT _INTRC_CLKOUT", |part| oscillator(part, Oscillator::Internal, 0x80)),
    ("_FOSC_ERIO _ER_OSC_NOCLKOUT _FOSC_EXTRCIO _RC_OSC_NOCLKOUT _EXTRC_IO", |part| oscillator(part, Oscillator::Rc, 0x40)),
    ("_FOSC_ERCLK _ER_OSC_CLKOUT _FOSC_EXTRCCLK _RC_OSC_CLKOUT _EXTRC_CLKOUT", |part| clock_out(part, true)),
    ("_FOSC_EXTRC _FOSC_RC _RC_OSC", |part| clock_out(part, false)),
    ("_WDTE_OFF _WDT_OFF",         |part| off(part.config.wdte)),
    ("_WDTE_ON _WDT_ON",           |part| on(part.config.wdte)),
    ("_PWRTE_OFF",                 |part| power_up(part, false)),
    ("_PWRTE_ON",                  |part| power_up(part, true)),
    ("_BOREN_OFF _BODEN_OFF",      |part| off(part.config.boren)),
    ("_BOREN_ON _BODEN_ON",        |part| on(part.config.boren)),
    ("_MCLRE_OFF _MCLR_OFF",       |part| off(part.config.mclre)),
    ("_MCLRE_ON _MCLR_ON",         |part| on(part.config.mclre)),
    ("_LVP_OFF",                   |part| off(part.config.lvp)),
    ("_LVP_ON",                    |part| on(part.config.lvp)),
    ("_CPD_ON _DATA_CP_ON DATA_CP_ON", |part| off(part.config.cpd)),
    ("_CPD_OFF _DATA_CP_OFF DATA_CP_OFF", |part| on(part.config.cpd)),
    ("_FCMEN_OFF",                 |part| off(part.config.fcmen)),
    ("_FCMEN_ON",                  |part| on(part.config.fcmen)),
    ("_IESO_OFF",                  |part| off(part.config.ieso)),
    ("_IESO_ON",                   |part| on(part.config.ieso)),
    ("_DEBUG_ON",                  |part| off(debug(part))),
    ("_DEBUG_OFF",                 |part| on(debug(part))),
    ("_CCPMX_RB0 _CCP1_RB0",       |part| ccp1(part, "RB0")),
    ("_CCPMX_RB2 _CCP1_RB2",       |part| ccp1(part, "RB2")),
    ("_CCPMX_RB3 _CCP1_RB3",       |part| ccp1(part, "RB3")),
    ("_CP_OFF",                    |part| on(part.config.cp)),
    ("_CP_ON _CP_ALL _CP_All",     |part| off(part.config.cp)),
    ("_CP_HALF",                   |part| protected(part, words(part) / 2)),
    ("_CP_UPPER_256",              |part| protected(part, words(part).checked_sub(256)?)),
    // The 16F628 alone has a field for two of its quarters, written twice (DS40300, register 14-1).
    ("_CP_75",                     |part| (part.config.cp == 0x3C00).then_some(0x17FF)),
    ("_CP_50",                     |part| (part.config.cp == 0x3C00).then_some(0x2BFF)),
    ("_WRT_OFF _WRT_ENABLE_OFF",   |part| writable_from(part, words(part), 0)),
    ("_WRT_PROTECT_OFF",           |part| writable_from(part, words(part), 0).filter(|_| several(part))),
    ("_WRT_ON _WRT_ENABLE_ON",     |part| writable_from(part, 0, 0).filter(|_| !several(part))),
    ("_WRT_ALL",                   |part| writable_from(part, 0, words(part))),
    ("_WRT_PROTECT_ALL",           |part| protects(part, words(part))),
    ("_WRT_HALF",                  |part| protects(part, words(part) / 2)),
    ("_WRT_1FOURTH",               |part| protects(part, words(part) / 4)),
    ("_WRT_256 _WRT_PROTECT_256",  |part| protects(part, 256)),
    ("_WRT_512 _WRT_ENABLE_512",   |part| protects(part, 512)),
    ("_WRT_1024 _WRT_ENABLE_1024", |part| protects(part, 1024)),
    ("_WRT_1536 _WRT_ENABLE_1536", |part| protects(part, 1536)),
    ("_WRT_2048 _WRT_PROTECT_2048", |part| protects(part, 2048)),
    ("_CONFIG _CONFIG1",           |part| part.config.words.first().copied()),
    ("_CONFIG2",                   |part| part.config.words.get(1).copied()),
    ("_DEVID1",                    |part| part.device_id.map(|_| 0x2006)),
    ("_IDLOC0",                    |_| Some(0x2000)),
    ("_IDLOC1",                    |_| Some(0x2001)),
    ("_IDLOC2",                    |_| Some(0x2002)),
    ("_IDLOC3",                    |_| Some(0x2003)),
];

/// Named numbers of the chip `name`; none for a chip that is not of this crate.
pub(super) fn of(name: &str) -> Vec<(&'static str, i32)> {
    let Some(part) = part(name) else { return Vec::new() };
    let mut all = vec![("W", 0), ("F", 1)];
    all.extend(part.bits.iter().map(|&(_, name, bit)| (name, i32::from(bit))));
    all.extend(ALIASES.iter().filter_map(|&(name, sfr)| Some((name, i32::from(part.addr(sfr)?)))));
    let values = ROWS.iter().filter_map(|&(names, value)| Some((names, i32::from(value(part)?))));
    all.extend(values.flat_map(|(names, value)| names.split(' ').map(move |name| (name, value))));
    all
}

/// The value in which the bits under `mask` are clear; nothing where the chip has no such bits.
fn off(mask: u16) -> Option<u16> {
    (mask != 0).then_some(ONES & !mask)
}

/// The value in which they are set.
fn on(mask: u16) -> Option<u16> {
    (mask != 0).then_some(ONES)
}

fn words(part: &Part) -> u16 {
    (part.chip.on_chip / 2) as u16
}

/// The last place in the list that fits, as the value of the bits under `mask`: where several values mean the same, the last is
/// the one that the sheets name.
fn place<T>(mask: u16, list: &[T], fits: impl Fn(usize, &T) -> bool) -> Option<u16> {
    let place = (0..list.len()).zip(list).rfind(|&(i, value)| fits(i, value))?.0;
    Some(ONES & !mask | Config::scatter(place, mask))
}

/// The oscillator may give its pins to port A.
fn shares_pins(part: &Part) -> bool {
    !part.config.osc_ports.is_empty()
}

fn oscillator(part: &Part, wanted: Oscillator, ports: u8) -> Option<u16> {
    let (mask, list) = part.config.fosc;
    let ports_of = |i: usize| part.config.osc_ports.get(i).copied();
    place(mask, list, |i, &osc| osc == wanted && ports_of(i).is_none_or(|its| its == ports))
        .filter(|_| ports == 0 || shares_pins(part))
}

/// Resistor and capacitor with the clock on a pin, which headers call so only where the pin could be a port.
fn clock_out(part: &Part, shared: bool) -> Option<u16> {
    oscillator(part, Oscillator::Rc, 0).filter(|_| shares_pins(part) == shared)
}

fn power_up(part: &Part, runs: bool) -> Option<u16> {
    let (mask, when_on) = part.config.pwrte;
    if runs == when_on { on(mask) } else { off(mask) }
}

fn debug(part: &Part) -> u16 {
    if part.config.wrt.0 == 0 { 0 } else { DEBUG }
}

fn ccp1(part: &Part, pin: &str) -> Option<u16> {
    let (mask, one, zero) = part.config.ccpmx;
    let is = |id: PinId| id != NO_PIN && part.chip.pins.get(usize::from(id)).is_some_and(|row| row.name == pin);
    if is(one) { on(mask) } else { off(mask).filter(|_| is(zero)) }
}

/// CP protects all words from this one on; it stands twice in the word.
fn protected(part: &Part, from: u16) -> Option<u16> {
    let (mask, list) = part.config.cp_first;
    let first = place(mask, list, |_, &first| first == from)?;
    Some(first & !(mask << 8) | (first & mask) << 8)
}

/// WRT is a number, and not a single bit that permits.
fn several(part: &Part) -> bool {
    part.config.wrt.0.count_ones() > 1
}

/// The program may write from this word on: `one` by a single bit, `number` by a number.
fn writable_from(part: &Part, one: u16, number: u16) -> Option<u16> {
    let (mask, list) = part.config.wrt;
    let wanted = if several(part) { number } else { one };
    place(mask, list, |_, &first| first.min(words(part)) == wanted)
}

/// WRT as a number protects so many words.
fn protects(part: &Part, count: u16) -> Option<u16> {
    writable_from(part, 0, count).filter(|_| several(part))
}
