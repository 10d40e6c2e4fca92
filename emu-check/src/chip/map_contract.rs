//! Computes without the compiler what program and options require of an image, and compares it with the
//! compiler's map.

use emu_core::chip::Chip;
use ladder::{Element, LadderProgram, ProgramElement, SymbolKind};
use ladder_compile::{ImageMap, PinAssignment, SpecialPin};

use crate::CheckOptions;
use crate::chip::deviation::Deviation;
use crate::chip::families::{FamilyTiming, family_timing, find_chip_with_package};

/// The timing of a scan: its period, and the limits of its pacing timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScanPace {
    /// Clock in Hz.
    pub clock_hz: u64,
    /// Machine cycles per scan, as the reduced fraction `num / den`.
    pub num: u128,
    /// Denominator of the machine cycles per scan.
    pub den: u128,
    /// Machine cycles per timer tick: the smallest with which the period fits.
    pub tick_cycles: u64,
    /// Maximum machine cycles from a timer match to the start of its scan.
    pub poll_cycles: u64,
    /// Clocks per machine cycle.
    pub clocks_per_cycle: u64,
}

impl ScanPace {
    /// The timing of the program on a chip, at the clock of `options` or else of the program; `None` if
    /// period or clock is 0.
    pub(crate) fn new(program: &LadderProgram, options: &CheckOptions, chip: &Chip) -> Option<ScanPace> {
        let FamilyTiming {
            clocks_per_cycle: clocks,
            tick_cycles: ticks,
            max_period_ticks: most_ticks,
            poll_cycles,
            poll_cycles_with_rounds: poll_with_rounds,
        } = family_timing(chip, uses_first_ccp(program, options, chip));
        let clock_hz = ladder_compile::clock_hz(program, chip, options.clock_hz);
        let num = u128::from(clock_hz) * u128::from(program.settings.cycle_us);
        let den = 1_000_000 * u128::from(clocks);
        if num == 0 {
            return None;
        }
        // Euclid's algorithm: `divisor` becomes the greatest common divisor.
        let (mut divisor, mut rest) = (num, den);
        while rest != 0 {
            (divisor, rest) = (rest, divisor % rest);
        }
        let (num, den) = (num / divisor, den / divisor);
        let fits = |tick: &u64| num.div_ceil(den * u128::from(*tick)) <= most_ticks;
        let tick = ticks.iter().copied().find(fits).or(ticks.last().copied()).unwrap_or(1);
        let needs_rounds = num.div_ceil(den * u128::from(tick)) > 1 << 16;
        Some(ScanPace {
            clock_hz,
            num,
            den,
            tick_cycles: tick,
            poll_cycles: if needs_rounds { poll_with_rounds } else { poll_cycles },
            clocks_per_cycle: clocks,
        })
    }

    /// Machine cycles per scan, as an integer or a fraction.
    pub(crate) fn period(&self) -> String {
        ratio_text(self.num, self.den)
    }
}

fn ratio_text(num: u128, den: u128) -> String {
    if den == 1 { num.to_string() } else { format!("{num}/{den}") }
}

/// The deviations of the map from what the program and the options require.
pub(crate) fn map_deviations(
    program: &LadderProgram,
    options: &CheckOptions,
    pace: &ScanPace,
    (map, chip): (&ImageMap, &Chip),
) -> Vec<Deviation> {
    let mut deviations = Vec::new();
    if !map.mcu.eq_ignore_ascii_case(chip.name) {
        deviations.push(Deviation::new(format!("the chip {}", chip.name), map.mcu.clone()));
    }
    if map.clock_hz != pace.clock_hz {
        deviations.push(Deviation::new(format!("a clock of {} Hz", pace.clock_hz), format!("{} Hz", map.clock_hz)));
    }
    let (num, den) = (u128::from(map.cycle.num), u128::from(map.cycle.den));
    if den == 0 || num.checked_mul(pace.den) != pace.num.checked_mul(den) {
        let of = format!("({} us at {} Hz)", program.settings.cycle_us, pace.clock_hz);
        deviations.push(Deviation::new(
            format!("a period of {} cycles {of}", pace.period()),
            format!("{} cycles", ratio_text(num, den)),
        ));
    }
    // A coarser tick is correct if the period is a whole number of ticks.
    let is_multiple = pace.den == 1 && map.tick != 0 && pace.num.is_multiple_of(map.tick.into());
    if u64::from(map.tick) > pace.tick_cycles && !is_multiple {
        let wanted = format!("a tick of the timer of at most {} cycles", pace.tick_cycles);
        deviations.push(Deviation::new(wanted, format!("{} cycles", map.tick)));
    }
    if u64::from(map.poll_cycles) > pace.poll_cycles {
        let wanted = format!("at most {} cycles from a match to the start of its scan", pace.poll_cycles);
        deviations.push(Deviation::new(wanted, format!("{} cycles", map.poll_cycles)));
    }
    check_pins(program, options, (map, chip), &mut deviations);
    check_special_pins(program, options, pace, (map, chip), &mut deviations);
    deviations
}

/// Checks the pins of peripherals and the EEPROM: the baud rate of the serial line, the pins of analog
/// symbols, the frequency of the PWM output, and the cells of PERSIST.
fn check_special_pins(
    program: &LadderProgram,
    options: &CheckOptions,
    pace: &ScanPace,
    (map, chip): (&ImageMap, &Chip),
    deviations: &mut Vec<Deviation>,
) {
    let mut names: Vec<&str> = map.pins.iter().map(|pin| pin.pin.as_str()).collect();
    for special in &map.specials {
        let (SpecialPin::Transmit { pin, .. }
        | SpecialPin::Receive { pin, .. }
        | SpecialPin::Analog { pin, .. }
        | SpecialPin::I2c { pin, .. }
        | SpecialPin::Spi { pin, .. }
        | SpecialPin::Pwm { pin, .. }) = special;
        if names.iter().any(|name| name.eq_ignore_ascii_case(pin)) {
            deviations.push(Deviation::new(format!("one job for the pin {pin}"), "several"));
        }
        names.push(pin);
        let rate = program.settings.baud.unwrap_or(0);
        match special {
            SpecialPin::Transmit { baud, .. } | SpecialPin::Receive { baud, .. } if *baud != rate => {
                deviations.push(Deviation::new(format!("a serial line of {rate} bits per second"), format!("{baud}")));
            }
            SpecialPin::Analog { pin, name } => {
                if let Some(wanted) =
                    requested_pin(program, options, chip, name).filter(|wanted| !wanted.eq_ignore_ascii_case(pin))
                {
                    deviations.push(Deviation::new(format!("{name} at {wanted}"), format!("at {pin}")));
                }
            }
            SpecialPin::Pwm { pin, name, hertz, period, steps } => {
                let outputs = program.pwm_outputs();
                let output = outputs.iter().find(|output| output.name == *name);
                let requested = output.and_then(|output| output.hertz).map(u64::from);
                let wanted = name.as_deref().and_then(|name| requested_pin(program, options, chip, name));
                if let Some(wanted) = wanted.filter(|wanted| !wanted.eq_ignore_ascii_case(pin)) {
                    deviations.push(Deviation::new(format!("a PWM output at {wanted}"), format!("at {pin}")));
                }
                if requested != Some(*hertz) {
                    deviations.push(Deviation::new(
                        format!("a PWM output of {} Hz", requested.unwrap_or(0)),
                        format!("{hertz} Hz"),
                    ));
                }
                // The period must be clock / hertz clocks, within 5 %.
                let clocks = u128::from(period.num) * u128::from(pace.clocks_per_cycle) * u128::from(*hertz);
                let wanted = u128::from(pace.clock_hz) * u128::from(period.den);
                if period.den == 0 || clocks.abs_diff(wanted) * 20 > wanted || *steps < MIN_PWM_STEPS {
                    let wanted = format!("PWM of {hertz} Hz within 5 %, of {MIN_PWM_STEPS} steps or more");
                    let (num, den) = (u128::from(period.num), u128::from(period.den));
                    deviations.push(Deviation::new(
                        wanted,
                        format!("a period of {} cycles, {steps} steps", ratio_text(num, den)),
                    ));
                }
            }
            _ => {}
        }
    }
    let mut addr = 0;
    let mut cells = map.eeprom.iter();
    for ProgramElement { element, .. } in program.elements() {
        let Element::Persist { name } = element else { continue };
        let bytes = program.symbols().iter().find(|s| s.name == *name).map_or(2, |s| s.bytes);
        let wanted = (name.as_str(), addr, bytes);
        let found = cells.next().map(|cells| (cells.name.as_str(), cells.addr, cells.bytes));
        if found != Some(wanted) {
            let text = |(name, addr, bytes): (&str, u16, u8)| format!("{bytes} cells from {addr} on for {name}");
            deviations.push(Deviation::new(text(wanted), found.map_or_else(|| "none".to_owned(), text)));
        }
        addr += u16::from(bytes);
    }
}

/// Minimum number of steps of the duty cycle; a coarser PWM output is refused.
const MIN_PWM_STEPS: u32 = 16;

/// Returns true if a PWM output of the program takes the first CCP module of a PIC16, which otherwise paces
/// the scans: on chips with one module, with several outputs, and at the pin of that module.
fn uses_first_ccp(program: &LadderProgram, options: &CheckOptions, chip: &Chip) -> bool {
    let outputs = program.pwm_outputs();
    let is_at_first = |name: &str| requested_pin(program, options, chip, name) == Some("RC2");
    match &outputs[..] {
        [] => false,
        [output] => chip.reg("CCP2CON").is_none() || output.name.as_deref().is_some_and(is_at_first),
        _ => true,
    }
}

/// Checks the pins: each input and output has exactly one, no pin has two symbols, and the requested
/// assignments are kept.
fn check_pins(
    program: &LadderProgram,
    options: &CheckOptions,
    (map, chip): (&ImageMap, &Chip),
    deviations: &mut Vec<Deviation>,
) {
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
            deviations
                .push(Deviation::new(format!("one pin for {name}"), format!("{} pins {}", pins.len(), pins.join(" "))));
        }
        if let Some(other) = found.iter().find(|p| p.direction != direction) {
            deviations.push(Deviation::new(format!("{name} as `{direction}`"), format!("`{}`", other.direction)));
        }
        if let Some(wanted) = requested_pin(program, options, chip, name)
            && pins.iter().any(|pin| !pin.eq_ignore_ascii_case(wanted))
        {
            deviations.push(Deviation::new(format!("{name} at {wanted}"), format!("at {}", pins.join(" "))));
        }
    }
    for (n, pin) in map.pins.iter().enumerate() {
        if !symbols.iter().any(|s| s.name == pin.name && matches!(s.kind, SymbolKind::Input | SymbolKind::Output)) {
            deviations.push(Deviation::new(
                "pins for inputs and outputs only".to_owned(),
                format!("{} for `{}`", pin.pin, pin.name),
            ));
        }
        let earlier = map.pins.iter().take(n).find(|p| p.pin.eq_ignore_ascii_case(&pin.pin) && p.name != pin.name);
        if let Some(other) = earlier {
            deviations.push(Deviation::new(
                format!("a pin of its own for {}", pin.name),
                format!("{} as {}", pin.pin, other.name),
            ));
        }
    }
}

/// The pin requested for a symbol: by `--pin`, else by the `IO LIST` if that is for a chip with the same
/// pins.
pub(crate) fn requested_pin<'a>(
    program: &'a LadderProgram,
    options: &'a CheckOptions,
    chip: &Chip,
    name: &str,
) -> Option<&'a str> {
    if let Some(PinAssignment { pin, .. }) = options.pins.iter().find(|given| given.spelled_in(program).symbol == name)
    {
        return Some(pin);
    }
    let micro = program.settings.micro.as_deref()?;
    let named = find_chip_with_package(ladder::chip_of(micro)?)?;
    let entry = program.io.iter().rfind(|e| e.name == name && e.pin != 0)?;
    ladder::package_pin(micro, entry.pin).filter(|_| named.pins == chip.pins)
}
