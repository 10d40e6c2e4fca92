//! The traits that every chip implements and every tool uses.

use crate::chip::Chip;
use crate::lint::Lint;
use crate::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use crate::state::SnapshotDamaged;

/// Why a chip is reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ResetCause {
    /// Supply voltage came up.
    #[default]
    PowerOn,
    /// The reset pin.
    External,
    /// The watchdog.
    Watchdog,
    /// The supply dipped.
    BrownOut,
}

/// Why a run ended. All of them leave the machine ready to run on, at an instruction boundary, or between two subcycles where a probe
/// has stopped it there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The cycle asked for was reached.
    Limit,
    /// Nothing enabled can wake or reset the chip, and nothing is on its way out.
    Halted,
    /// The word at the program counter is no instruction of this chip. It was not executed.
    Illegal {
        /// Program word address.
        pc: u32,
        /// The word found.
        word: u16,
    },
    /// The program did something that this model cannot carry out; the instruction was not executed.
    Fault {
        /// Program word address.
        pc: u32,
        /// What it was.
        fault: ProgramFault,
    },
    /// A trap set by [`Cpu::set_breakpoint`] was reached; its instruction was not executed yet.
    Breakpoint {
        /// Program word address.
        pc: u32,
    },
    /// The probe asked for a stop.
    Probe,
}

/// What a guest program can do that the model does not carry out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProgramFault {
    /// A memory cell of RAM was read before it was written (only with `--ram trap`).
    UninitialisedRead {
        /// The memory, as [`Chip::spaces`] names it.
        space: &'static str,
        /// Address in it.
        addr: u16,
    },
    /// A jump went out of its program, on a controller with a table of programs.
    JumpOutOfProgram {
        /// Where it went, in program words.
        target: u16,
    },
    /// A program cycle took longer than any that ends: the watchdog of a controller.
    CycleTooLong,
}

impl std::fmt::Display for ProgramFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ProgramFault::UninitialisedRead { space, addr } => {
                write!(f, "{space}:0x{addr:04x} was read before it was written")
            }
            ProgramFault::JumpOutOfProgram { target } => write!(f, "the jump to 0x{target:03x} leaves the program"),
            ProgramFault::CycleTooLong => f.write_str("the program cycle has no end: the watchdog has stopped it"),
        }
    }
}

/// Half of a machine cycle of a machine that fetches and executes one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subcycle {
    /// The instruction has come from program memory; the program counter has gone on.
    Fetch,
    /// It was executed.
    Execute,
}

/// What RAM holds after power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RamInit {
    /// Bytes drawn from a seed, as silicon leaves them undefined.
    Random(u64),
    /// Zeros.
    Zero,
}

/// A chip as a value: `Clone` is the snapshot within a process, [`Cpu::save`] that for a file. Same inputs, same bytes, for ever.
pub trait Cpu: Clone {
    /// The chip's row of data.
    fn chip(&self) -> &'static Chip;
    /// Oscillator clocks per machine cycle: 1 on AVR.
    fn clocks_per_cycle(&self) -> u32;
    /// Resets the chip for the given reason. Counting of cycles goes on.
    fn reset(&mut self, cause: ResetCause);
    /// Machine cycles since power-up.
    fn cycle(&self) -> u64;
    /// Instructions executed since power-up, interrupt entries not counted.
    fn instructions(&self) -> u64;
    /// Program counter in program words.
    fn pc(&self) -> u32;
    /// Sets the program counter, in program words; wraps within program memory.
    fn set_pc(&mut self, pc: u32);
    /// Value of the register `name` (as listed in [`Chip::cpu_regs`]); `None` where there is none.
    fn reg(&self, name: &str) -> Option<u32>;
    /// Puts the values of all registers into `into`, in the order of [`Chip::cpu_regs`]: what reads them at every instruction asks for
    /// none by name.
    fn read_regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.chip().cpu_regs.iter().map(|name| self.reg(name).unwrap_or(0)));
    }
    /// Sets a register; false where there is none of that name.
    fn set_reg(&mut self, name: &str, value: u32) -> bool;
    /// Reads one byte of a memory space without any side effect; `None` outside of it.
    fn peek(&self, space: &str, addr: u32) -> Option<u8>;
    /// Writes one byte of a memory space at once; false outside of it. A register of the chip does what it does when a program
    /// writes it (a one in a flag register clears the flag, PINx toggles).
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool;
    /// Writes the bit `bit` (0 to 7) of a byte as [`Cpu::poke`] does, and does with the others what an instruction on single bits does:
    /// on an 8051 ports keep their latches, on an AVR flags stay that a one clears, a PIC16 reads all and writes them back. False
    /// outside of the memory.
    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        rewrite_bit(self, space, addr, bit, value)
    }
    /// Sets or clears a breakpoint at the program word `pc`. It changes nothing that a program could see; a clone has the
    /// traps that were set when it was made.
    fn set_breakpoint(&mut self, pc: u32, on: bool);
    /// The chip has this pin, as it is configured.
    fn has_pin(&self, pin: PinId) -> bool {
        self.chip().has_pin(pin)
    }
    /// The pins that are worth showing: all that the chip has, but of a machine whose program leaves its hundreds of channels open those
    /// alone that the program names.
    fn pins_to_show(&self) -> Vec<PinId> {
        (0..self.chip().pins.len() as PinId).filter(|pin| self.has_pin(*pin)).collect()
    }
    /// Level of a pin now.
    fn pin_level(&self, pin: PinId) -> PinLevel;
    /// The byte whose stop bit the first serial port is sending, where the program has been told already that it is sent: it may
    /// end on that. None on chips that tell it after the stop bit.
    fn byte_in_stop_bit(&self) -> Option<u8> {
        None
    }
    /// Drives a pin from outside at `at` (at once when that has passed), or puts a resistor on it; the last of these counts.
    fn drive(&mut self, at: CycleTime, pin: PinId, level: PinLevel);
    /// Puts a voltage, in millivolts, on a pin from outside at `at` (at once when that has passed). False on machines that know
    /// levels only.
    fn drive_volts(&mut self, at: CycleTime, pin: PinId, millivolts: u32) -> bool {
        let _ = (at, pin, millivolts);
        false
    }
    /// Sets the supply, in millivolts, from `at` on (at once when that has passed). False on machines that know no supply.
    fn set_supply(&mut self, at: CycleTime, millivolts: u32) -> bool {
        let _ = (at, millivolts);
        false
    }
    /// Where the byte of RAM is kept that the program reaches at `addr` of the memory [`Chip::ram_space`]: an address of that memory,
    /// below 64 K, the same for all mirrors. None where there is no RAM.
    fn canonical_ram_address(&self, addr: u32) -> Option<u32> {
        let chip = self.chip();
        let first = u32::from(chip.ram_start);
        (first..first + u32::from(chip.ram_len)).contains(&addr).then_some(addr)
    }
    /// All that a program or the world outside could ever see of the machine, as bytes for [`Cpu::restore`]: equal machines give equal
    /// ones. Program memory is among it where the program has changed it; traps, logs and what the machine was built of are not.
    fn save(&self) -> Vec<u8>;
    /// Makes this the machine that was saved. It is to be one of the same chip, image and options; its traps stay.
    ///
    /// # Errors
    /// The bytes are no state of such a machine, which is as it was then.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotDamaged>;
    /// Return addresses, as program words, of a stack that lies in no memory space, the one pushed last first; its places that hold
    /// none are among them. Empty where there is no such stack.
    fn return_stack(&self) -> Vec<u32> {
        Vec::new()
    }
    /// Where several sources share a vector, the flags that are set and enabled now, by their names in the data sheet: those that
    /// interrupt, or would. Empty on chips whose vectors tell the source.
    fn interrupt_flags(&self) -> Vec<&'static str> {
        Vec::new()
    }
    /// How deep the stack is now: a call makes it greater, a return smaller, by whatever it takes. 0 where there is no stack.
    fn stack_depth(&self) -> u32 {
        0
    }
    /// No instruction comes now: the core sleeps, or is held. A family that tells of its rest by [`StopReason::Halted`] alone says false.
    fn is_asleep(&self) -> bool {
        false
    }
    /// With `on` time passes up to the limit of a run even where nothing can wake the chip: [`StopReason::Halted`] does not come. No part of the
    /// machine that a program could see, nor of its saved state.
    fn set_run_while_halted(&mut self, on: bool);
    /// Only something from outside can still change what the program does, though it does not count as halted: it waits for a pin in a
    /// loop, or sleeps with its receiver open. Asked of a copy, which it moves. A family that calls all of that halted never waits.
    fn is_blocked_on_input(&mut self) -> bool {
        false
    }
    /// Runs until machine cycle `until` (at most [`LAST_CYCLE`]) is reached or something stops it; always to an instruction
    /// boundary. A run cut in two by its limit gives the same machine. Where it has halted in a jump to itself, another run executes
    /// that jump once more.
    fn run<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason;
    /// Executes one instruction, or one interrupt entry, or sleeps to the next deadline.
    fn step<P: Probe>(&mut self, probe: &mut P) -> StopReason {
        self.step_until(LAST_CYCLE, probe)
    }
    /// The same, but sleeps no further than to the cycle `until`; an instruction that spans it ends where it ends.
    fn step_until<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason;
}

/// What a bus access asks of the core, a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BusEffect(pub u32);

impl BusEffect {
    /// Nothing.
    pub const NONE: BusEffect = BusEffect(0);
    /// Deadlines, pending interrupts or enables may have moved: look before the next instruction.
    pub const RECHECK: BusEffect = BusEffect(1);
    /// Hold interrupts for one instruction.
    pub const HOLD_INTERRUPTS: BusEffect = BusEffect(2);

    /// True when `other` is asked for.
    #[must_use]
    pub const fn contains(self, other: BusEffect) -> bool {
        self.0 & other.0 != 0
    }
}

/// A moment that never comes.
pub const NEVER: u64 = u64::MAX;

/// The last cycle to which a machine runs: 2^62, some 9,000 years at 16 MHz.
pub const LAST_CYCLE: u64 = 1 << 62;

/// What a core sees of its chip. Plain RAM is not behind it. `now` is the machine cycle in which the access falls; a
/// write takes effect at the edge that ends that cycle. Every access first runs what is due at its own cycle.
pub trait Bus: Clone {
    /// Reads a register as the program does, with side effects.
    fn read(&mut self, reg: u16, now: u64) -> (u8, BusEffect);
    /// Reads a register as an instruction does that modifies and writes it back: where that makes a difference, the latch
    /// of a port instead of its pins.
    fn read_latch(&mut self, reg: u16, now: u64) -> (u8, BusEffect) {
        self.read(reg, now)
    }
    /// Reads a register without side effects.
    fn peek(&self, reg: u16, now: u64) -> u8;
    /// Writes a register.
    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect;
    /// Writes only the bits of `mask`, as single-bit instructions do.
    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect;
    /// Runs what is due up to `now` and returns the next deadline, [`NEVER`] where there is none.
    fn fire(&mut self, now: u64) -> u64;
    /// How long a read of `reg` keeps giving the same value without side effects if the program does nothing: a cycle
    /// after `now`, or `now` itself when nothing is promised.
    fn steady_until(&self, reg: u16, now: u64) -> u64;
    /// The interrupt that would be taken at `now`, by its vector number.
    fn pending_interrupt(&self, now: u64) -> Option<u8>;
    /// The core takes that interrupt.
    fn acknowledge_interrupt(&mut self, vector: u8, now: u64);
    /// True when an enabled source could still interrupt or reset the chip.
    fn can_wake(&self, interrupts_enabled: bool) -> bool;
    /// True when something is still on its way: a byte being sent, a drive queued.
    fn is_busy(&self) -> bool;
}

/// Reads a byte and writes it back with another value of one bit: [`Cpu::poke_bit`] where nothing else is a part of it.
pub fn rewrite_bit<C: Cpu>(cpu: &mut C, space: &str, addr: u32, bit: u8, value: bool) -> bool {
    let mask = 1 << (bit & 7);
    let old = cpu.peek(space, addr);
    old.is_some_and(|old| cpu.poke(space, addr, if value { old | mask } else { old & !mask }))
}

/// Looks at a run. The constants switch the hooks on at compile time; `()` looks at nothing and costs nothing.
pub trait Probe {
    /// [`Probe::on_instruction`] is called.
    const INSN: bool = false;
    /// [`Probe::on_instruction`] is called at every turn of a loop that only waits. Where it need not be, turns that are like the one before are
    /// jumped over, and a turn that is not is seen.
    const EVERY_ITERATION: bool = Self::INSN;
    /// [`Probe::on_data_access`] is called.
    const DATA: bool = false;
    /// [`Probe::on_branch`], [`Probe::on_flow_start`] and [`Probe::on_flow_end`] are called.
    const FLOW: bool = false;
    /// [`Probe::on_data_access`] is called for reads too. Where it need not be, turns of a loop that only waits are jumped over.
    const DATA_READS: bool = Self::DATA;
    /// [`Probe::on_event`] is called, and the chip logs edges and bytes.
    const EVENTS: bool = false;
    /// [`Probe::on_lint`] is called, on machines that have diagnostics.
    const LINT: bool = false;
    /// [`Probe::on_subcycle`] is called, on machines that have subcycles.
    const SUBCYCLE: bool = false;

    /// Before the instruction at program word `pc` starts at machine cycle `at`. True stops the run before it.
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        let _ = (at, pc);
        false
    }
    /// An access to data memory (registers of the chip included) in machine cycle `at`; `space` is the position of the
    /// memory in [`Chip::spaces`]. True stops the run at the end of the instruction.
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let _ = (at, space, addr, value, write);
        false
    }
    /// An instruction makes the program go on at the program word `to` in place of `next`, the one behind it, if `taken`. One that
    /// goes on to `next` may be told, or not. Turns of a loop that only waits may be jumped over unseen.
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        let _ = (next, to, taken);
    }
    /// The program goes on at the program word `pc`, and no instruction has led it there: a run begins, an interrupt is entered, or
    /// the chip was reset.
    fn on_flow_start(&mut self, pc: u32) {
        let _ = pc;
    }
    /// The program does not go on at the program word `pc`, where it stands: the run ends, or [`Probe::on_flow_start`] tells where it does.
    fn on_flow_end(&mut self, pc: u32) {
        let _ = pc;
    }
    /// An interrupt is entered; `at` is the first cycle of its entry.
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        let _ = (at, vector);
    }
    /// Something left the chip or reached a pin. True stops the run at the next instruction boundary. Events come in order of
    /// cycles, and of time within a cycle, but for what a reset or a drive by hand adds to the cycle at whose boundary it comes.
    fn on_event(&mut self, event: ChipEvent) -> bool {
        let _ = event;
        false
    }
    /// The instruction at program word `pc`, in machine cycle `at`, does what is seldom meant.
    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        let _ = (at, pc, lint);
    }
    /// A subcycle of the instruction `word` at program word `pc` is over at `at`. True stops the run there, also between fetch and
    /// execution; it goes on from there.
    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        let _ = (at, phase, pc, word);
        false
    }
}

impl Probe for () {}

/// Two probes at once; nest for more.
impl<A: Probe, B: Probe> Probe for (A, B) {
    const INSN: bool = A::INSN || B::INSN;
    const EVERY_ITERATION: bool = A::EVERY_ITERATION || B::EVERY_ITERATION;
    const DATA: bool = A::DATA || B::DATA;
    const FLOW: bool = A::FLOW || B::FLOW;
    const DATA_READS: bool = A::DATA_READS || B::DATA_READS;
    const EVENTS: bool = A::EVENTS || B::EVENTS;
    const LINT: bool = A::LINT || B::LINT;
    const SUBCYCLE: bool = A::SUBCYCLE || B::SUBCYCLE;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.0.on_instruction(at, pc) | self.1.on_instruction(at, pc)
    }
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        self.0.on_data_access(at, space, addr, value, write) | self.1.on_data_access(at, space, addr, value, write)
    }
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.0.on_branch(next, to, taken);
        self.1.on_branch(next, to, taken);
    }
    fn on_flow_start(&mut self, pc: u32) {
        self.0.on_flow_start(pc);
        self.1.on_flow_start(pc);
    }
    fn on_flow_end(&mut self, pc: u32) {
        self.0.on_flow_end(pc);
        self.1.on_flow_end(pc);
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.0.on_interrupt(at, vector);
        self.1.on_interrupt(at, vector);
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.0.on_event(event) | self.1.on_event(event)
    }
    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        self.0.on_lint(at, pc, lint);
        self.1.on_lint(at, pc, lint);
    }
    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.0.on_subcycle(at, phase, pc, word) | self.1.on_subcycle(at, phase, pc, word)
    }
}

impl<P: Probe> Probe for &mut P {
    const INSN: bool = P::INSN;
    const EVERY_ITERATION: bool = P::EVERY_ITERATION;
    const DATA: bool = P::DATA;
    const FLOW: bool = P::FLOW;
    const DATA_READS: bool = P::DATA_READS;
    const EVENTS: bool = P::EVENTS;
    const LINT: bool = P::LINT;
    const SUBCYCLE: bool = P::SUBCYCLE;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        (**self).on_instruction(at, pc)
    }
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        (**self).on_data_access(at, space, addr, value, write)
    }
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        (**self).on_branch(next, to, taken);
    }
    fn on_flow_start(&mut self, pc: u32) {
        (**self).on_flow_start(pc);
    }
    fn on_flow_end(&mut self, pc: u32) {
        (**self).on_flow_end(pc);
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        (**self).on_interrupt(at, vector);
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        (**self).on_event(event)
    }
    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        (**self).on_lint(at, pc, lint);
    }
    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        (**self).on_subcycle(at, phase, pc, word)
    }
}
