//! Searches for states that do not survive [`Cpu::save`] and [`Cpu::restore`], for the tests of the cores.
//!
//! For each seed, a core provides a machine with a random program of register writes. The search applies
//! random inputs to the machine and runs it in three ways: uncut; cut into short runs; and cut at the same
//! cycles, with the state saved there and restored into a machine that has executed something else. All three
//! machines must stay equal, byte for byte. A difference is a panic that names chip and seed.
//!
//! `EMU_STATE_PROGRAMS` sets the number of programs per chip, `EMU_STATE_SEED` the seed of the first one.

use std::fmt::Debug;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use crate::slices::{RandomInput, SlicePlan, pick_random};
use emu_core::cpu::{Cpu, ResetCause, StopReason};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;

/// Cycles of the longest run between two cuts.
const MAX_PROGRAM_CYCLES: u64 = 900;

/// Number of cuts between two inputs; the rest then runs in one piece.
const CUTS_PER_PROGRAM: u64 = 16;

/// Seed of the first program of each chip, unless the environment sets it.
const SEED: u64 = 0x57A7_E5EE;

/// Reads a number, decimal or `0x` hexadecimal, from an environment variable; `otherwise` is the default.
///
/// # Panics
/// The variable contains something else.
fn env_number(name: &str, otherwise: u64) -> u64 {
    let Ok(text) = std::env::var(name) else { return otherwise };
    let (digits, radix) = text.strip_prefix("0x").map_or((&*text, 10), |digits| (digits, 16));
    u64::from_str_radix(digits, radix).unwrap_or_else(|_| panic!("{name} is not a number: {text}"))
}

/// Draws a random byte. About half of them are boundary values with at most one bit set or clear.
pub fn boundary_byte(rng: &mut Rng) -> u8 {
    let bit = 1 << rng.below(8);
    match rng.below(8) {
        0 => 0,
        1 => 0xFF,
        2 => bit,
        3 => !bit,
        _ => rng.next_u64() as u8,
    }
}

/// Queues random drives of `pins` within `span` cycles: single edges, edges close together, clocks and serial
/// frames. On machines that model them, voltages and dips of the supply are included.
pub fn queue_random_drives<C: Cpu>(cpu: &mut C, pins: &[PinId], span: u64, rng: &mut Rng) {
    if pins.is_empty() {
        return;
    }
    let moment = |cycle: u64, rng: &mut Rng| CycleTime { cycle, phase: rng.below(4) as u8 };
    let level = |rng: &mut Rng| {
        pick_random(rng, &[PinLevel::Low, PinLevel::High, PinLevel::Low, PinLevel::High, PinLevel::Float])
    };
    for _ in 0..rng.below(10) {
        let (pin, mut at) = (pick_random(rng, pins), rng.below(span));
        match rng.below(8) {
            0..=2 => cpu.drive(moment(at, rng), pin, level(rng)),
            3 => {
                for _ in 0..2 + rng.below(6) {
                    cpu.drive(moment(at, rng), pick_random(rng, pins), level(rng));
                    at += rng.below(4);
                }
            }
            4 | 5 => {
                // Start bit, eight or nine data bits, stop bit; or a clock of half that frequency.
                let (bit, word) = (pick_random(rng, &[1, 2, 4, 8, 13, 16, 52, 104]), rng.next_u64() | 0x600);
                let word = if rng.one_in(3) { 0x5555 } else { word << 1 };
                for n in 0..pick_random(rng, &[11, 12, 18, 33]) {
                    cpu.drive(moment(at + n * bit, rng), pin, PinLevel::from_bit(word >> n & 1 == 1));
                }
            }
            6 => {
                _ = cpu.drive_volts(moment(at, rng), pin, pick_random(rng, &[0, 1, 1_250, 2_500, 2_501, 4_999, 5_000]))
            }
            _ => {
                let low = pick_random(rng, &[0, 600, 3_000, 3_900, 4_100]);
                if rng.one_in(3) && cpu.set_supply(moment(at, rng), low) {
                    cpu.set_supply(moment(at + rng.below(400), rng), 5_000);
                }
            }
        }
    }
}

/// Makes a plan for a machine that already has its program: random drives, and inputs from outside between
/// runs.
pub fn random_slice_plan<C: Cpu>(mut start: C, pins: &[PinId], span: u64, rng: &mut Rng) -> SlicePlan<C> {
    queue_random_drives(&mut start, pins, span, rng);
    let chip = start.chip();
    let act = |rng: &mut Rng| match rng.below(8) {
        0..=2 => RandomInput::Poke(chip.reg_space, pick_random(rng, chip.regs).addr.into(), boundary_byte(rng)),
        3 if !pins.is_empty() => RandomInput::Drive(
            pick_random(rng, pins),
            pick_random(rng, &[PinLevel::Low, PinLevel::High, PinLevel::Float]),
        ),
        4 => RandomInput::Reset(pick_random(
            rng,
            &[ResetCause::PowerOn, ResetCause::External, ResetCause::Watchdog, ResetCause::BrownOut],
        )),
        _ => RandomInput::Nothing,
    };
    let mut acts: Vec<(u64, RandomInput)> = (0..rng.below(4)).map(|_| (rng.below(span), act(rng))).collect();
    acts.sort_by_key(|act| act.0);
    acts.push((span, RandomInput::Nothing));
    let what = format!("{acts:x?}");
    SlicePlan { description: what, start, inputs: acts, breakpoint_candidates: Vec::new() }
}

/// Prints the seed of the search when a test ends in a panic, whatever panics.
struct PanicContext<'a>(&'a str, u64);

impl Drop for PanicContext<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            eprintln!("{}: again with EMU_STATE_PROGRAMS=1 EMU_STATE_SEED={:#x}", self.0, self.1);
        }
    }
}

/// Runs `programs` plans, or as many as the environment sets, for each of `chips` (name, and the argument of
/// `plan`). All cores of the host share the work. Prints a summary for each chip.
///
/// # Panics
/// A state is rejected, or machines differ that must be equal.
pub fn search_restore_faults<C: Cpu + Debug, T: Sync>(
    chips: &[(&str, T)],
    programs: u64,
    plan: impl Fn(&T, &mut Rng) -> SlicePlan<C> + Sync,
) {
    let (programs, first) = (env_number("EMU_STATE_PROGRAMS", programs), env_number("EMU_STATE_SEED", SEED));
    for (name, chip) in chips {
        let (next, cuts, cycles) = (AtomicU64::new(0), AtomicU64::new(0), AtomicU64::new(0));
        let work = || {
            loop {
                let n = next.fetch_add(1, Ordering::Relaxed);
                if n >= programs {
                    return;
                }
                let seed = first.wrapping_add(n);
                let _whereabouts = PanicContext(name, seed);
                // Neighbouring seeds give unrelated programs, and each chip has its own.
                let mut rng = Rng::new(name.bytes().fold(seed, |sum, byte| Rng::new(sum ^ u64::from(byte)).next_u64()));
                let plan = plan(chip, &mut rng);
                let (cut, ran) = assert_restores_equal(&plan, &mut rng);
                cuts.fetch_add(cut, Ordering::Relaxed);
                cycles.fetch_add(ran, Ordering::Relaxed);
            }
        };
        thread::scope(|scope| {
            for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
                scope.spawn(work);
            }
        });
        let (cuts, cycles) = (cuts.into_inner(), cycles.into_inner());
        println!("{name}: seeds from {first:#x}, {programs} programs, {cuts} cuts, {cycles} cycles");
        assert!(cuts >= programs, "{name}: machines stop before anything is cut");
    }
}

/// Runs a plan uncut, cut, and restored at each cut. Returns the number of cuts and the cycles of the run.
fn assert_restores_equal<C: Cpu + Debug>(plan: &SlicePlan<C>, rng: &mut Rng) -> (u64, u64) {
    let (mut uncut, mut cut, mut restored) = (plan.start.clone(), plan.start.clone(), plan.start.clone());
    let mut other = plan.start.clone();
    let longest = pick_random(rng, &[1, 8, 60, 300, MAX_PROGRAM_CYCLES, MAX_PROGRAM_CYCLES]);
    let mut number = 0;
    for &(until, act) in &plan.inputs {
        let left = number + CUTS_PER_PROGRAM;
        let stop = loop {
            let to = if number < left { (cut.cycle() + 1 + rng.below(longest)).min(until) } else { until };
            let stops = [&mut cut, &mut restored].map(|cpu| cpu.run(to, &mut ()));
            let at = cut.cycle();
            assert_eq!(stops[0], stops[1], "a restored machine stops at {at} for another reason\n{}", plan.description);
            let bytes = restored.save();
            assert_same_bytes(plan, &cut.save(), &bytes, "a restored machine beside one that was not", at);
            run_elsewhere(&mut other, rng);
            assert_eq!(other.restore(&bytes), Ok(()), "the state of cycle {at} is refused\n{}", plan.description);
            assert_same_bytes(plan, &bytes, &other.save(), "a state that is saved again", at);
            std::mem::swap(&mut restored, &mut other);
            number += 1;
            if stops[0] != StopReason::Limit || at >= until {
                break stops[0];
            }
        };
        let at = cut.cycle();
        assert_eq!(
            uncut.run(until, &mut ()),
            stop,
            "a machine that was cut stops at {at} for another reason\n{}",
            plan.description
        );
        assert_same_bytes(plan, &uncut.save(), &cut.save(), "a machine that was cut beside one that was not", at);
        // Breakpoints are not part of a state.
        if !matches!(act, RandomInput::Trap(..)) {
            [&mut uncut, &mut cut, &mut restored].into_iter().for_each(|cpu| act.apply(cpu));
        }
    }
    (number, cut.cycle())
}

/// Lets a machine execute something else: other registers, another address, another program.
fn run_elsewhere<C: Cpu>(cpu: &mut C, rng: &mut Rng) {
    let chip = cpu.chip();
    let words = u64::from(chip.flash_bytes / chip.word_bytes.max(1));
    // Rarely, because making a private copy of a shared program takes the most time.
    if rng.one_in(30) {
        cpu.poke(chip.code_space, rng.below(0x100) as u32, boundary_byte(rng));
    }
    for _ in 0..rng.below(4) {
        match rng.below(4) {
            0 | 1 if !chip.regs.is_empty() => {
                _ = cpu.poke(chip.reg_space, pick_random(rng, chip.regs).addr.into(), boundary_byte(rng));
            }
            2 => cpu.set_pc(rng.below(words.min(0x80)) as u32),
            _ => cpu.drive(
                CycleTime::at(cpu.cycle() + rng.below(10)),
                rng.below(chip.pins.len() as u64) as PinId,
                PinLevel::High,
            ),
        }
    }
    let to = cpu.cycle() + rng.below(MAX_PROGRAM_CYCLES);
    cpu.run(to, &mut ());
}

/// Asserts that two states of the cycle `at` are the same bytes. If they are not, the message shows the
/// difference between machines restored from them.
fn assert_same_bytes<C: Cpu + Debug>(plan: &SlicePlan<C>, wanted: &[u8], found: &[u8], what: &str, at: u64) {
    if wanted == found {
        return;
    }
    let text = |bytes: &[u8]| {
        let mut cpu = plan.start.clone();
        cpu.restore(bytes).map_or_else(|refused| refused.to_string(), |()| format!("{cpu:?}"))
    };
    let (wanted, found) = (text(wanted), text(found));
    let same = wanted.bytes().zip(found.bytes()).take_while(|(wanted, found)| wanted == found).count();
    let near = |text: &str| {
        let bytes = text.as_bytes();
        String::from_utf8_lossy(&bytes[same.saturating_sub(300).min(bytes.len())..(same + 60).min(bytes.len())])
            .into_owned()
    };
    panic!("{what}, at cycle {at}\n{}\n.. {} ..\nis\n.. {} ..", plan.description, near(&wanted), near(&found));
}
