//! The traits that every chip implements and every tool uses: [`Cpu`] and [`Probe`].

pub use crate::bus::{Bus, BusEffect};
use crate::chip::Chip;
use crate::countdown::Countdown;
use crate::engine::RunState;
use crate::external_io::OutsideInput;
use crate::lint::Lint;
use crate::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use crate::state::{SnapshotDamaged, SnapshotState, load_state, save_state};

/// The source of a chip reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ResetCause {
    /// The supply voltage came up.
    #[default]
    PowerOn,
    /// The reset pin.
    External,
    /// The watchdog.
    Watchdog,
    /// The supply voltage fell below its limit.
    BrownOut,
}

/// Why a run ended. In every case the machine can continue from there. It is at an instruction boundary, or
/// between two subcycles if a probe stopped it there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The requested cycle was reached.
    Limit,
    /// Nothing that is enabled can wake or reset the chip, and no output is pending.
    Halted,
    /// The program cannot continue. The instruction was not executed.
    Error(ProgramError),
    /// A breakpoint set by [`Cpu::set_breakpoint`] was reached. Its instruction was not executed yet.
    Breakpoint {
        /// Program word address.
        pc: u32,
    },
    /// The probe requested a stop.
    Probe,
}

/// Why a program cannot continue. The instruction was not executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProgramError {
    /// The word at the program counter is not an instruction of this chip.
    Illegal {
        /// Program word address.
        pc: u32,
        /// The word there.
        word: u16,
    },
    /// The instruction did something that the model cannot execute.
    Fault {
        /// Program word address.
        pc: u32,
        /// What it did.
        fault: ProgramFault,
    },
}

/// An action of the emulated program that the model cannot execute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ProgramFault {
    /// A byte of RAM was read before it was written (only with `--ram trap`).
    UnwrittenRead {
        /// The memory, as [`Chip::spaces`] names it.
        space: &'static str,
        /// Address in that memory.
        addr: u16,
    },
    /// A jump left its program, on a controller with a table of programs.
    JumpOutOfProgram {
        /// Target of the jump, in program words.
        target: u16,
    },
    /// The watchdog of a controller stopped a program cycle that took too long.
    CycleTooLong,
}

impl std::fmt::Display for ProgramFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ProgramFault::UnwrittenRead { space, addr } => {
                write!(f, "{space}:0x{addr:04x} was read before it was written")
            }
            ProgramFault::JumpOutOfProgram { target } => write!(f, "the jump to 0x{target:03x} leaves the program"),
            ProgramFault::CycleTooLong => f.write_str("the program cycle has no end: the watchdog has stopped it"),
        }
    }
}

/// Half of a machine cycle, on a machine that fetches and then executes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Subcycle {
    /// The instruction was read from program memory and the program counter was incremented.
    Fetch,
    /// The instruction was executed.
    Execute,
}

/// Contents of RAM after power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RamInit {
    /// Random bytes from a seed, because RAM is undefined after power-up.
    Random(u64),
    /// Zeros.
    Zero,
}

/// The parts of every machine: the chip around the core, the cycle counter, and the settings of its runs. The
/// provided methods of [`Cpu`] need nothing else.
pub trait CpuParts: Clone + SnapshotState {
    /// The chip around the core.
    type Bus: Bus;
    /// The chip around the core.
    fn bus(&self) -> &Self::Bus;
    /// The chip around the core, for changes. After a change of what is due, the deadline of the clock must
    /// be set to now.
    fn bus_mut(&mut self) -> &mut Self::Bus;
    /// The cycle counter of the hot loop.
    fn clock(&self) -> &Countdown;
    /// The cycle counter of the hot loop, for changes.
    fn clock_mut(&mut self) -> &mut Countdown;
    /// Settings and data of the run.
    fn run_state(&mut self) -> &mut RunState;
}

/// A chip as a value. `Clone` makes a snapshot within the process, [`Cpu::save`] a snapshot as bytes. The
/// same inputs always give the same bytes.
pub trait Cpu: CpuParts {
    /// The data row of the chip.
    fn chip(&self) -> &'static Chip;
    /// Oscillator clocks per machine cycle: 1 on AVR.
    fn clocks_per_cycle(&self) -> u32;
    /// Resets the chip for the given reason. The cycle count continues.
    fn reset(&mut self, cause: ResetCause);
    /// Machine cycles since power-up.
    #[inline]
    fn cycle(&self) -> u64 {
        self.clock().now()
    }
    /// Instructions executed since power-up, without interrupt entries.
    #[inline]
    fn instructions(&self) -> u64 {
        self.clock().instructions()
    }
    /// Program counter in program words.
    fn pc(&self) -> u32;
    /// Sets the program counter, in program words. The value wraps within program memory.
    fn set_pc(&mut self, pc: u32);
    /// Value of the register `name` (one of [`Chip::cpu_regs`]), or `None` if there is no such register.
    fn reg(&self, name: &str) -> Option<u32>;
    /// Reads all registers into `into`, in the order of [`Chip::cpu_regs`]. It is for callers that read them
    /// at every instruction and must not look up names.
    fn read_regs(&self, into: &mut Vec<u32>) {
        into.clear();
        into.extend(self.chip().cpu_regs.iter().map(|name| self.reg(name).unwrap_or(0)));
    }
    /// Sets a register. Returns false if there is no register of that name.
    fn set_reg(&mut self, name: &str, value: u32) -> bool;
    /// Reads one byte of a memory space without side effects. Returns `None` outside of the space.
    fn peek(&self, space: &str, addr: u32) -> Option<u8>;
    /// Writes one byte of a memory space immediately. Returns false outside of the space. A register of the
    /// chip reacts as to a write of the program: a one in a flag register clears the flag, and a write of
    /// PINx toggles the pin.
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool;
    /// Writes the bit `bit` (0 to 7) of a byte as [`Cpu::poke`] does. The other bits are treated as by an
    /// instruction on single bits: on 8051 a port keeps its latches, on AVR flags that a one would clear stay
    /// set, and PIC16 reads the whole byte and writes it back. Returns false outside of the memory.
    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        rewrite_bit(self, space, addr, bit, value)
    }
    /// Sets or clears a breakpoint at the program word `pc`. This changes nothing that a program can see. A
    /// clone has the breakpoints that were set when it was made.
    fn set_breakpoint(&mut self, pc: u32, on: bool);
    /// Returns true if the chip has this pin in its present configuration.
    fn has_pin(&self, pin: PinId) -> bool {
        self.chip().has_pin(pin)
    }
    /// The pins that a tool should show. These are all pins of the chip. A machine that leaves hundreds of
    /// channels unused shows only those that its program names.
    fn pins_to_show(&self) -> Vec<PinId> {
        (0..self.chip().pins.len() as PinId).filter(|pin| self.has_pin(*pin)).collect()
    }
    /// Present level of a pin.
    fn pin_level(&self, pin: PinId) -> PinLevel {
        self.bus().level(pin)
    }
    /// The byte whose stop bit the first serial port is sending now, if the program already sees the byte as
    /// sent and so may end before the stop bit does. `None` on chips that report a byte after its stop bit.
    fn byte_in_stop_bit(&self) -> Option<u8> {
        self.bus().byte_in_stop_bit()
    }
    /// Drives a pin from outside at the time `at`, or connects a resistor to it. A time in the past means
    /// immediately. The last drive of a pin wins.
    fn drive(&mut self, at: CycleTime, pin: PinId, level: PinLevel) {
        queue_input(self, at, OutsideInput::Level(pin, level));
    }
    /// Applies a voltage, in millivolts, to a pin from outside at the time `at`; a time in the past means
    /// immediately. Returns false on machines that model levels only.
    fn drive_volts(&mut self, at: CycleTime, pin: PinId, millivolts: u32) -> bool {
        queue_input(self, at, OutsideInput::Volts(pin, millivolts))
    }
    /// Sets the supply voltage, in millivolts, from the time `at` on; a time in the past means immediately.
    /// Returns false on machines that do not model a supply.
    fn set_supply(&mut self, at: CycleTime, millivolts: u32) -> bool {
        queue_input(self, at, OutsideInput::Supply(millivolts))
    }
    /// Returns the address under which the model keeps the RAM byte that the program reaches at `addr` of
    /// [`Chip::ram_space`]. The result is an address of that memory, below 64 K, and is the same for all
    /// mirrors of the byte. `None` if `addr` is not RAM.
    fn canonical_ram_address(&self, addr: u32) -> Option<u32> {
        let chip = self.chip();
        let first = u32::from(chip.ram_start);
        (first..first + u32::from(chip.ram_len)).contains(&addr).then_some(addr)
    }
    /// Writes the whole state that a program or the outside can ever see, as bytes for [`Cpu::restore`].
    /// Equal machines give equal bytes. Program memory is included where the program changed it. Breakpoints,
    /// logs, and the chip, image and options of the machine are not included.
    fn save(&self) -> Vec<u8> {
        let mut copy = self.clone();
        let now = copy.cycle();
        copy.bus_mut().normalize(now);
        save_state(&mut copy)
    }
    /// Restores the state that [`Cpu::save`] wrote. The machine must have the same chip, image and options as
    /// the saved one; its breakpoints stay.
    ///
    /// # Errors
    /// The bytes are not a state of such a machine. The machine is unchanged then.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotDamaged> {
        let mut copy = self.clone();
        load_state(&mut copy, bytes)?;
        *self = copy;
        Ok(())
    }
    /// Return addresses, as program words, of a stack that is not in a memory space; the newest is first.
    /// Unused stack entries are included. Empty on chips without such a stack.
    fn return_stack(&self) -> Vec<u32> {
        Vec::new()
    }
    /// Where several sources share a vector: the flags that are set and enabled now, by their data-sheet
    /// names. These cause an interrupt, or would if interrupts were enabled. Empty on chips whose vectors
    /// identify the source.
    fn interrupt_flags(&self) -> Vec<&'static str> {
        Vec::new()
    }
    /// Present depth of the stack. A call increases it and a return decreases it, in a unit that
    /// depends on the family. 0 on chips without a stack.
    fn stack_depth(&self) -> u32 {
        0
    }
    /// Returns true if the core executes no instructions now, because it sleeps or the chip holds it. A
    /// family that reports this only by [`StopReason::Halted`] returns false.
    fn is_asleep(&self) -> bool {
        false
    }
    /// With `on`, a run continues to its limit even if nothing can wake the chip, so [`StopReason::Halted`]
    /// is never returned. The setting is neither visible to a program nor part of the saved state.
    fn set_run_while_halted(&mut self, on: bool) {
        self.run_state().run_while_halted = on;
    }
    /// Enables (the default) or disables skipping of what repeats: polling loops, or the cycles of a program
    /// that has settled. Results do not change, only the run time.
    fn set_skip_idle_loops(&mut self, on: bool) {
        self.run_state().skip_idle_loops = on;
    }
    /// Returns true if only an event from outside can change what the program does, although the machine does
    /// not count as halted: the program polls a pin, or sleeps with its receiver enabled. Call it on a copy,
    /// because it runs the machine. A family that reports all such states as halted returns false.
    fn is_blocked_on_input(&mut self) -> bool {
        false
    }
    /// Runs until machine cycle `until` (at most [`LAST_CYCLE`]) or until something stops the run, always up
    /// to an instruction boundary. A run that a limit cuts in two gives the same machine. If the machine
    /// halted in a jump to itself, the next run executes that jump once more.
    fn run<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason;
    /// Executes one instruction or one interrupt entry, or sleeps until the next deadline.
    fn step<P: Probe>(&mut self, probe: &mut P) -> StopReason {
        self.step_until(LAST_CYCLE, probe)
    }
    /// As [`Cpu::step`], but sleeps at most until the cycle `until`. An instruction that starts before
    /// `until` is executed to its end.
    fn step_until<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason;
}

/// The time of an event that never happens.
pub const NEVER: u64 = u64::MAX;

/// The last cycle up to which a machine runs: 2^62, about 9,000 years at 16 MHz.
pub const LAST_CYCLE: u64 = 1 << 62;

/// Passes an input from outside to the chip. Returns false if the machine does not model such inputs.
fn queue_input<C: Cpu>(cpu: &mut C, at: CycleTime, input: OutsideInput) -> bool {
    let now = cpu.cycle();
    cpu.clock_mut().expire();
    cpu.bus_mut().queue_input(at, now, input)
}

/// Reads a byte and writes it back with one bit changed. This is [`Cpu::poke_bit`] for memories without
/// special single-bit writes.
pub fn rewrite_bit<C: Cpu>(cpu: &mut C, space: &str, addr: u32, bit: u8, value: bool) -> bool {
    let mask = 1 << (bit & 7);
    let old = cpu.peek(space, addr);
    old.is_some_and(|old| cpu.poke(space, addr, if value { old | mask } else { old & !mask }))
}

/// Observes a run. The constants enable the hooks at compile time. The probe `()` observes nothing and costs
/// nothing.
pub trait Probe {
    /// Enables [`Probe::on_instruction`].
    const INSN: bool = false;
    /// Calls [`Probe::on_instruction`] in every iteration of a polling loop. Without it, iterations that
    /// equal the one before may be skipped; the others are reported.
    const EVERY_ITERATION: bool = Self::INSN;
    /// Enables [`Probe::on_data_access`].
    const DATA: bool = false;
    /// Enables [`Probe::on_branch`], [`Probe::on_flow_start`] and [`Probe::on_flow_end`].
    const FLOW: bool = false;
    /// Calls [`Probe::on_data_access`] for reads too. Without it, iterations of a polling loop may be
    /// skipped.
    const DATA_READS: bool = Self::DATA;
    /// Enables [`Probe::on_event`]; the chip then logs edges and bytes.
    const EVENTS: bool = false;
    /// Enables [`Probe::on_lint`], on machines that have lints.
    const LINT: bool = false;
    /// Enables [`Probe::on_subcycle`], on machines that have subcycles.
    const SUBCYCLE: bool = false;

    /// Called before the instruction at program word `pc` starts at machine cycle `at`. Returning true stops
    /// the run before the instruction.
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        let _ = (at, pc);
        false
    }
    /// Called for an access to data memory, including the registers of the chip, in machine cycle `at`.
    /// `space` is the position of the memory in [`Chip::spaces`]. Returning true stops the run at the end of
    /// the instruction.
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let _ = (at, space, addr, value, write);
        false
    }
    /// Called when an instruction continues at the program word `to`, if `taken`, instead of at `next`, the
    /// word after it. A call with `taken` false is optional. Skipped iterations of a polling loop are not
    /// reported.
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        let _ = (next, to, taken);
    }
    /// Called when the program continues at the program word `pc` without an instruction that leads there: a
    /// run starts, an interrupt is entered, or the chip was reset.
    fn on_flow_start(&mut self, pc: u32) {
        let _ = pc;
    }
    /// Called when the program does not continue at its present program word `pc`: the run ends, or
    /// [`Probe::on_flow_start`] reports where it continues.
    fn on_flow_end(&mut self, pc: u32) {
        let _ = pc;
    }
    /// Called when an interrupt is entered; `at` is the first cycle of the entry.
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        let _ = (at, vector);
    }
    /// Called when something leaves the chip or a pin changes. Returning true stops the run at the next
    /// instruction boundary. Events arrive in order of time. The exception are events of a reset, or of a pin
    /// that a user drives by hand: they are added to the cycle of the boundary where they happen.
    fn on_event(&mut self, event: ChipEvent) -> bool {
        let _ = event;
        false
    }
    /// Called when the instruction at program word `pc`, in machine cycle `at`, does something suspicious.
    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        let _ = (at, pc, lint);
    }
    /// Called at the end, `at`, of a subcycle of the instruction `word` at program word `pc`. Returning true
    /// stops the run there, even between fetch and execution; the next run continues from there.
    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        let _ = (at, phase, pc, word);
        false
    }
}

impl Probe for () {}

/// Two probes in one; nest pairs for more.
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
