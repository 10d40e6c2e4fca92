//! What the program and the command line ask for, worked out without the compiler, and where its map says otherwise.

use emu_core::chip::Chip;
use ladder::{Program, SymbolKind};
use ladder_compile::Map;

use crate::Options;
use crate::family::{Facts, facts};

/// The time of one scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pace {
    /// Clock in Hz.
    pub clock_hz: u64,
    /// Machine cycles of a scan, a reduced fraction.
    pub num: u128,
    pub den: u128,
    /// Cycles per tick of the timer, the finest with which a period fits.
    pub tick: u64,
    /// Most machine cycles from a match to the start of its scan.
    pub poll: u64,
    /// Clocks of a machine cycle.
    pub clocks: u64,
}

impl Pace {
    /// The program's cycle at its clock, or at the one that is asked for, on a chip; nothing where that is no time.
    pub fn new(program: &Program, options: &Options, chip: &Chip) -> Option<Pace> {
        let Facts { clocks, ticks, most_ticks, poll } = facts(chip);
        let clock_hz = options.clock_hz.unwrap_or(program.settings.crystal_hz);
        let num = u128::from(clock_hz) * u128::from(program.settings.cycle_us);
        let den = 1_000_000 * u128::from(clocks);
        if num == 0 {
            return None;
        }
        let (mut a, mut b) = (num, den);
        while b != 0 {
            (a, b) = (b, a % b);
        }
        let (num, den) = (num / a, den / a);
        let fits = |tick: &u64| num.div_ceil(den * u128::from(*tick)) <= most_ticks;
        let tick = ticks.iter().copied().find(fits).or(ticks.last().copied()).unwrap_or(1);
        Some(Pace { clock_hz, num, den, tick, poll, clocks })
    }

    /// Machine cycles of a scan, as a number or a fraction.
    pub fn period(&self) -> String {
        ratio(self.num, self.den)
    }
}

fn ratio(num: u128, den: u128) -> String {
    if den == 1 { num.to_string() } else { format!("{num}/{den}") }
}

/// Where the map says otherwise: what is asked for, and what it says.
pub(crate) fn disagreements(
    program: &Program,
    options: &Options,
    pace: &Pace,
    (map, chip): (&Map, &Chip),
) -> Vec<(String, String)> {
    let mut told = Vec::new();
    if !map.mcu.eq_ignore_ascii_case(chip.name) {
        told.push((format!("the chip {}", chip.name), map.mcu.clone()));
    }
    if map.clock_hz != pace.clock_hz {
        told.push((format!("a clock of {} Hz", pace.clock_hz), format!("{} Hz", map.clock_hz)));
    }
    let (num, den) = (u128::from(map.cycle.num), u128::from(map.cycle.den));
    if den == 0 || num.checked_mul(pace.den) != pace.num.checked_mul(den) {
        let of = format!("({} us at {} Hz)", program.settings.cycle_us, pace.clock_hz);
        told.push((format!("a period of {} cycles {of}", pace.period()), format!("{} cycles", ratio(num, den))));
    }
    if u64::from(map.tick) > pace.tick {
        let wanted = format!("a tick of the timer of at most {} cycles", pace.tick);
        told.push((wanted, format!("{} cycles", map.tick)));
    }
    if u64::from(map.poll_cycles) > pace.poll {
        let wanted = format!("at most {} cycles from a match to the start of its scan", pace.poll);
        told.push((wanted, format!("{} cycles", map.poll_cycles)));
    }
    pins(program, options, (map, chip), &mut told);
    told
}

/// Pins: each input and output has one, no pin has two symbols, and those that were asked for are where they should be.
fn pins(program: &Program, options: &Options, (map, chip): (&Map, &Chip), told: &mut Vec<(String, String)>) {
    let symbols = program.symbols();
    for symbol in &symbols {
        let direction = match symbol.kind {
            SymbolKind::Input => "in",
            SymbolKind::Output => "out",
            _ => continue,
        };
        let name = symbol.name.as_str();
        let found: Vec<_> = map.pins.iter().filter(|p| p.name == name).collect();
        let pins: Vec<&str> = found.iter().map(|p| p.pin.as_str()).collect();
        if found.len() != 1 {
            told.push((format!("one pin for {name}"), format!("{} pins {}", pins.len(), pins.join(" "))));
        }
        if let Some(other) = found.iter().find(|p| p.direction != direction) {
            told.push((format!("{name} as `{direction}`"), format!("`{}`", other.direction)));
        }
        if let Some(wanted) = wanted(program, options, chip, name)
            && pins.iter().any(|pin| !pin.eq_ignore_ascii_case(wanted))
        {
            told.push((format!("{name} at {wanted}"), format!("at {}", pins.join(" "))));
        }
    }
    for (n, pin) in map.pins.iter().enumerate() {
        if !symbols.iter().any(|s| s.name == pin.name && matches!(s.kind, SymbolKind::Input | SymbolKind::Output)) {
            told.push(("pins for inputs and outputs only".to_owned(), format!("{} for `{}`", pin.pin, pin.name)));
        }
        let earlier = map.pins.iter().take(n).find(|p| p.pin.eq_ignore_ascii_case(&pin.pin) && p.name != pin.name);
        if let Some(other) = earlier {
            told.push((format!("a pin of its own for {}", pin.name), format!("{} as {}", pin.pin, other.name)));
        }
    }
}

/// The pin that was asked for: by `--pin`, else by the `IO LIST` where that is for a chip with the same pins.
fn wanted<'a>(program: &'a Program, options: &'a Options, chip: &Chip, name: &str) -> Option<&'a str> {
    if let Some((_, pin)) = options.pins.iter().find(|(symbol, _)| symbol == name) {
        return Some(pin);
    }
    let micro = program.settings.micro.as_deref()?;
    let named = ladder::chip_of(micro).and_then(emu_avr::chips::chip)?;
    let entry = program.io.iter().rfind(|e| e.name == name && e.pin != 0)?;
    ladder::package_pin(micro, entry.pin).filter(|_| named.pins == chip.pins)
}
