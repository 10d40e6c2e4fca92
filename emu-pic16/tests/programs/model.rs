//! A model of interrupts and standby by DS30292 12.10 to 12.13 and DS33023 chapter 8 that steps clock by
//! clock, with a core that has a dozen instructions. It shares nothing with the crate.
//!
//! The core is a pipeline of two stages: while an instruction executes, the next one is fetched. The
//! instruction fetched after a jump or a taken skip is discarded, and a cycle passes in which nothing
//! executes. An interrupt that is detected at Q1 of a cycle does the same to the two cycles after it,
//! whatever they would have executed.

/// Instructions of the model's core, one word each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Do {
    /// INCF of a byte of RAM.
    Count,
    /// BTFSS of a bit that is 1, or BTFSC: a skip that is taken, or one that is not.
    Skip(bool),
    Goto(usize),
    Call(usize),
    Return,
    Retfie,
    /// BSF or BCF of a bit of INTCON.
    Bit(u8, bool),
    /// A read of PORTB.
    Read,
    Sleep,
    Clrwdt,
}

/// Bit numbers of GIE, INTE, RBIE, INTF and RBIF in INTCON.
pub const GIE: u8 = 7;
const INTE: u8 = 4;
const RBIE: u8 = 3;
const INTF: u8 = 1;
const RBIF: u8 = 0;

/// A program, and the drives of port B pins: clock, pin, level.
#[derive(Debug, Clone)]
pub struct Setup {
    pub code: Vec<Do>,
    pub intcon: u8,
    /// INTEDG: true for the rising edge.
    pub rising: bool,
    /// Start-up time of the oscillator in clocks.
    pub crystal: u64,
    pub drives: Vec<(u64, u8, bool)>,
}

/// Visible results of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Seen {
    /// Instructions, by the cycle in which they start and their address.
    pub begun: Vec<(u64, u32)>,
    /// Number of interrupts.
    pub entries: usize,
    pub intcon: u8,
    pub counted: u8,
    /// TO and PD: 18h, or 10h after a sleep.
    pub to_pd: u8,
    /// Number of cycles in standby.
    pub slept: u64,
}

fn is(byte: u8, bit: u8) -> bool {
    byte >> bit & 1 == 1
}

fn wanted(intcon: u8) -> bool {
    is(intcon, INTE) && is(intcon, INTF) || is(intcon, RBIE) && is(intcon, RBIF)
}

pub fn run(setup: &Setup, cycles: u64) -> Seen {
    let mut seen = Seen { intcon: setup.intcon, to_pd: 0x18, ..Seen::default() };
    // Pins of port B, their last read value, and an edge that INT has detected since the last Q1.
    let (mut pins, mut read, mut edge) = (0u8, 0u8, false);
    let mut drives = setup.drives.iter().peekable();
    // Number of coming cycles in which nothing executes, and the address that executes after them.
    let (mut void, mut pc) = (0, 0);
    let (mut stack, mut sp) = ([0; 8], 0);
    // Clock at which the oscillator stops, and clock at which it runs again.
    let (mut sleeps, mut wakes) = (u64::MAX, u64::MAX);
    // The clock after the end shows what is sampled there.
    for clock in 0..=4 * cycles {
        while let Some(&&(_, pin, level)) = drives.peek().filter(|drive| drive.0 <= clock) {
            edge |= pin == 0 && level != is(pins, 0) && level == setup.rising;
            pins = pins & !(1 << pin) | u8::from(level) << pin;
            drives.next();
        }
        let asleep = sleeps <= clock;
        // Flags: at Q1, or at any time while nothing is clocked.
        if asleep || clock % 4 == 0 {
            seen.intcon |= u8::from(std::mem::take(&mut edge)) << INTF;
            seen.intcon |= u8::from((pins ^ read) & 0xF0 != 0) << RBIF;
        }
        if clock == 4 * cycles {
            break;
        }
        if asleep {
            if wakes == u64::MAX && wanted(seen.intcon) {
                wakes = clock + setup.crystal;
            }
            if wakes > clock || clock % 4 != 0 {
                seen.slept += u64::from(clock % 4 == 0);
                continue;
            }
            (sleeps, wakes) = (u64::MAX, u64::MAX);
        }
        if clock % 4 != 0 {
            continue;
        }
        let requested = is(seen.intcon, GIE) && wanted(seen.intcon);
        if void > 0 {
            void -= 1;
        } else {
            seen.begun.push((clock / 4, pc as u32));
            let op = setup.code.get(pc).copied().unwrap_or(Do::Count);
            pc += 1;
            let mut push = |to| {
                stack[sp % 8] = to;
                sp += 1;
            };
            match op {
                Do::Count => seen.counted = seen.counted.wrapping_add(1),
                Do::Skip(taken) if taken => (void, pc) = (1, pc + 1),
                Do::Skip(_) => {}
                Do::Goto(to) => (void, pc) = (1, to),
                Do::Call(to) => {
                    push(pc);
                    (void, pc) = (1, to);
                }
                Do::Return | Do::Retfie => {
                    sp += 7;
                    (void, pc) = (1, stack[sp % 8]);
                    if op == Do::Retfie {
                        seen.intcon |= 1 << GIE;
                    }
                }
                Do::Bit(bit, on) => seen.intcon = seen.intcon & !(1 << bit) | u8::from(on) << bit,
                Do::Read => read = pins,
                Do::Sleep if wanted(seen.intcon) => {}
                Do::Sleep => (sleeps, seen.to_pd) = (clock + 4, 0x10),
                Do::Clrwdt => seen.to_pd = 0x18,
            }
        }
        if requested {
            stack[sp % 8] = pc;
            sp += 1;
            seen.intcon &= !(1 << GIE);
            seen.entries += 1;
            (void, pc) = (2, 4);
        }
    }
    seen
}
