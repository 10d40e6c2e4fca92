//! The active calls, and the state of the machine as seen from each of them.
//!
//! On an AVR, a frame records where the registers of its caller are saved. The compiler's description
//! (`.debug_frame`) holds between the prologue and the epilogue. If there is none, or if it does not lead to
//! a call, the stack is searched for the return address, and the prologue shows what was pushed below it.

use std::ops::Range;
use std::sync::Arc;

use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{
    AVR_DATA, BlockInfo, DebugInfo, FrameView, Mcs51Memory, SpaceAddress, TypeId, UnwoundFrame, VariableInfo,
};

use super::c_objects::ObjectExpr;
use super::c_type_queries::CTypeRef;
use super::call_flow::{CallInstruction, call_before};
use super::dyn_machine::DynMachine;
use super::expression::DebugExpression;
use super::session;

/// Maximum number of calls.
const MAX_CALLS: usize = 64;

/// Number of stack bytes that are searched for a return address.
const MAX_STACK_BYTES: u32 = 4096;

/// Number of registers of an AVR.
const REGISTERS: usize = 32;

/// Address of the low byte of DPTR (8051).
const DPL: u32 = 0x82;

/// Maximum number of prologue instructions that are examined.
const MAX_PROLOGUE: u32 = 64;

/// An active call, or the location of the machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CallFrame {
    /// The next program word in it: for a caller, the return address.
    pub word: u32,
    /// The program word of its current instruction: for a caller, the call.
    pub call_word: u32,
    /// Number of inlined functions left out of this frame: the function itself has the frames of all of them.
    pub inlined_skipped: usize,
    /// The stack pointer in this frame.
    pub sp: u32,
    /// On an AVR, the stack pointer after the frame has returned, if it is known.
    pub cfa: Option<u32>,
    /// On an AVR, the addresses in RAM of its saved registers; `None` for those that are still in the
    /// machine.
    pub saved_registers: [Option<u32>; REGISTERS],
}

/// The information on a program that finds the active calls of a machine.
#[derive(Debug, Clone, Default)]
pub struct CallStack {
    /// Functions, variables and types.
    pub info: Arc<DebugInfo>,
    /// Program words and names of the functions.
    functions: Arc<Vec<NamedFunction>>,
}

impl PartialEq for CallStack {
    fn eq(&self, other: &CallStack) -> bool {
        Arc::ptr_eq(&self.info, &other.info)
    }
}

impl Eq for CallStack {}

/// A frame on a machine.
pub(super) struct MachineFrame<'a> {
    pub machine: &'a dyn DynMachine,
    pub frame: &'a CallFrame,
}

impl FrameView for MachineFrame<'_> {
    fn pc_byte(&self) -> u32 {
        // A call may be the last instruction of its block, so the address of the call counts, not the return
        // address.
        let CallFrame { word, call_word: at, .. } = self.frame;
        let bytes = self.machine.chip().word_bytes;
        if word == at { word.saturating_mul(bytes) } else { word.saturating_mul(bytes).saturating_sub(1) }
    }

    fn register(&self, number: u16) -> Option<u32> {
        if self.machine.chip().family == ChipFamily::Mcs51 {
            return self.machine.reg(&format!("r{number}"));
        }
        match self.frame.saved_registers.get(usize::from(number)) {
            Some(Some(addr)) => self.machine.peek(self.machine.chip().ram_space, *addr).map(u32::from),
            Some(None) => self.machine.peek(self.machine.chip().ram_space, number.into()).map(u32::from),
            None => (usize::from(number) == REGISTERS).then_some(self.frame.sp),
        }
    }

    fn memory(&self, address: u32) -> Option<u8> {
        let SpaceAddress { space, addr } = memory_at(self.machine.chip(), address)?;
        self.machine.peek(space, addr)
    }

    fn cfa(&self) -> Option<u32> {
        self.frame.cfa
    }
}

/// A frame whose caller is known, for values at the time of the call.
pub(super) struct CalledFrame<'a> {
    pub calls: &'a CallStack,
    pub frame: MachineFrame<'a>,
}

impl FrameView for CalledFrame<'_> {
    fn pc_byte(&self) -> u32 {
        self.frame.pc_byte()
    }

    fn register(&self, number: u16) -> Option<u32> {
        self.frame.register(number)
    }

    fn memory(&self, address: u32) -> Option<u8> {
        self.frame.memory(address)
    }

    fn cfa(&self) -> Option<u32> {
        self.frame.cfa()
    }

    fn register_at_call(&self, number: u16) -> Option<u64> {
        let machine = self.frame.machine;
        let caller = self.calls.real_caller(machine, self.frame.frame)?;
        let return_byte = caller.word.saturating_mul(machine.chip().word_bytes);
        self.calls.info.value_at_call(return_byte, number, &MachineFrame { machine, frame: &caller })
    }
}

/// Returns the memory and the address there of an address of an ELF file.
pub(super) fn memory_at(chip: &Chip, address: u32) -> Option<SpaceAddress> {
    match address.checked_sub(AVR_DATA) {
        _ if chip.family == ChipFamily::Mcs51 => Some(Mcs51Memory::split(address)),
        Some(addr) if chip.family == ChipFamily::Avr && addr < 0x1_0000 => {
            Some(SpaceAddress { space: chip.ram_space, addr })
        }
        _ => {
            let window =
                chip.elf_spaces.iter().find(|space| (space.start..space.start + space.len).contains(&address))?;
            Some(SpaceAddress { space: window.name, addr: address - window.start })
        }
    }
}

/// Returns the memory and the address there of an address that only ELF files use: 0x800100 is in the data
/// memory of the AVR.
pub(super) fn linked_memory_at(chip: &Chip, address: u32) -> Option<SpaceAddress> {
    memory_at(chip, address).filter(|_| chip.family == ChipFamily::Avr && address >= AVR_DATA)
}

/// How to get from a frame of an AVR to the frame of its caller.
struct FrameUnwinding {
    unwound: UnwoundFrame,
    /// The return address.
    word: u32,
    /// Number of pushed bytes that the description of the frame does not include.
    undescribed: u32,
}

/// A function of a program.
#[derive(Debug, Clone)]
pub struct NamedFunction {
    /// The program words of the function.
    pub words: Range<u32>,
    /// The name.
    pub name: String,
}

/// The function of a frame.
#[derive(Debug, Clone)]
pub struct FrameName<'a> {
    /// The name of the function.
    pub function: &'a str,
    /// The file and line of the call, if the function was inlined.
    pub call: Option<&'a (String, u32)>,
}

/// The code that a service routine has interrupted.
#[derive(Debug, Clone, Copy)]
struct InterruptedCode {
    /// The program word to return to.
    pc: u32,
    /// The stack pointer there.
    sp: u32,
}

impl CallStack {
    /// Returns the call stack of a program; `functions` gives program words and names of its functions.
    #[must_use]
    pub fn new(info: Arc<DebugInfo>, functions: Vec<NamedFunction>) -> CallStack {
        CallStack { info, functions: Arc::new(functions) }
    }

    /// Returns words and name of the function at a program word.
    #[must_use]
    pub fn function(&self, word: u32) -> Option<&NamedFunction> {
        self.functions.iter().filter(|one| one.words.contains(&word)).max_by_key(|one| one.words.start)
    }

    /// Returns the result of a function that has just returned: a number of up to eight bytes, in r25
    /// downwards, with the first byte in a register of even number (AVR-GCC, "Calling convention"). SDCC for
    /// MCS-51 returns up to two bytes in DPL and DPH.
    #[must_use]
    pub fn result(&self, id: TypeId, chip: &Chip) -> Option<ObjectExpr> {
        let bytes = self.info.size(Some(id)).filter(|bytes| (1..=8).contains(bytes))?;
        let first = match chip.family {
            ChipFamily::Avr => 26 - bytes.next_multiple_of(2),
            ChipFamily::Mcs51 if bytes <= 2 => Mcs51Memory::SFR | DPL,
            _ => return None,
        };
        Some(ObjectExpr::at(self.clone(), DebugExpression::Number(first.into()), CTypeRef::new(Some(id))))
    }

    /// Returns the active calls, the innermost first; the first is the location of the machine.
    #[must_use]
    pub fn frames(&self, machine: &dyn DynMachine) -> Vec<CallFrame> {
        let mut found = Vec::new();
        let (mut here, mut level) = (Some(self.innermost_frame(machine)), 0);
        while let Some(frame) = here.take().filter(|_| found.len() <= MAX_CALLS) {
            here = self.caller_frame(machine, &frame, level);
            level += 1;
            let inlined = self.inlined(MachineFrame { machine, frame: &frame }.pc_byte()).len();
            found.extend((0..inlined).map(|left_out| CallFrame { inlined_skipped: left_out, ..frame.clone() }));
            found.push(CallFrame { inlined_skipped: inlined, ..frame });
        }
        found
    }

    /// Returns the frame that has called the function of a frame.
    fn real_caller(&self, machine: &dyn DynMachine, frame: &CallFrame) -> Option<CallFrame> {
        let frames = self.frames(machine);
        let own = frames.iter().position(|known| (known.word, known.sp) == (frame.word, frame.sp))?;
        frames.into_iter().skip(own).find(|known| (known.word, known.sp) != (frame.word, frame.sp))
    }

    /// Returns the value of a parameter when the function of a frame was called, if the debugging information
    /// describes it.
    pub(super) fn parameter_at_call(
        &self,
        machine: &dyn DynMachine,
        frame: &CallFrame,
        variable: &VariableInfo,
    ) -> Option<u64> {
        let function = self.info.function_at(MachineFrame { machine, frame }.pc_byte())?;
        let caller = self.real_caller(machine, frame)?;
        let return_byte = caller.word.saturating_mul(machine.chip().word_bytes);
        self.info.parameter_at_call(variable, function, return_byte, &MachineFrame { machine, frame: &caller })
    }

    /// Returns the frame at a level; 0 is the innermost.
    #[must_use]
    pub fn frame(&self, machine: &dyn DynMachine, level: usize) -> Option<CallFrame> {
        match level {
            0 => Some(self.innermost_frame(machine)),
            // Inlined functions are frames too.
            _ => self.frames(machine).into_iter().nth(level),
        }
    }

    /// Returns the inlined functions around a byte address, the innermost first.
    #[must_use]
    pub fn inlined(&self, byte: u32) -> Vec<&BlockInfo> {
        let around = self.info.function_at(byte).map_or(Vec::new(), |function| function.block.blocks_around(byte));
        around.into_iter().filter(|block| block.inlined.is_some()).collect()
    }

    /// Returns how many inlined functions begin at a byte address: a debugger that stops there may be before
    /// those calls.
    #[must_use]
    pub fn call_sites(&self, byte: u32) -> usize {
        let around = self.info.function_at(byte).map_or(Vec::new(), |function| function.block.blocks_around(byte));
        let begins = |block: &BlockInfo| {
            let first = block.ranges.iter().map(|range| range.start).min();
            first == Some(byte) || byte.checked_sub(1).is_some_and(|before| !block.has_code_at(before))
        };
        let inlined = around.into_iter().filter(|block| block.inlined.is_some());
        inlined.take_while(|block| begins(block)).count()
    }

    /// Returns the function name of a frame; if the function was inlined, also file and line of its call.
    #[must_use]
    pub fn frame_name(&self, machine: &dyn DynMachine, frame: &CallFrame) -> Option<FrameName<'_>> {
        let byte = MachineFrame { machine, frame }.pc_byte();
        let (function, inlined) = (self.info.function_at(byte)?, self.inlined(byte));
        let name =
            inlined.get(frame.inlined_skipped).and_then(|block| block.inlined.as_deref()).unwrap_or(&function.name);
        let call = frame.inlined_skipped.checked_sub(1).and_then(|at| inlined.get(at)).map(|block| &block.call_site);
        Some(FrameName { function: name, call })
    }

    fn innermost_frame(&self, machine: &dyn DynMachine) -> CallFrame {
        let (word, sp) = (machine.pc(), machine.reg("SP").unwrap_or(0));
        let mut frame =
            CallFrame { word, call_word: word, inlined_skipped: 0, sp, cfa: None, saved_registers: [None; REGISTERS] };
        if machine.chip().family == ChipFamily::Avr {
            frame.cfa = self.unwind_frame(machine, &frame).map(|unwinding| unwinding.unwound.cfa);
        }
        frame
    }

    /// Returns the frame that called this one, which is at `level`.
    fn caller_frame(&self, machine: &dyn DynMachine, frame: &CallFrame, level: usize) -> Option<CallFrame> {
        let call = |word: u32| call_before(machine, word);
        let outer = |(at, word): (u32, u32), sp| CallFrame {
            word,
            call_word: at,
            inlined_skipped: 0,
            sp,
            cfa: None,
            saved_registers: frame.saved_registers,
        };
        match machine.chip().family {
            ChipFamily::Avr => {
                // The caller is start-up code.
                if self.function(frame.call_word).is_some_and(|NamedFunction { name, .. }| name == "main") {
                    return None;
                }
                let FrameUnwinding { unwound, word, undescribed } = self.unwind_frame(machine, frame)?;
                // The code that a service routine has interrupted is not a call.
                let at = call(word).filter(|_| !self.is_service(frame)).map_or(word, |CallInstruction { at, .. }| at);
                let mut next = outer((at, word), unwound.cfa.saturating_add(undescribed));
                for (register, addr) in unwound.saved {
                    // r1 and r0 are pushed before the flags.
                    let addr = if register < 2 { addr.saturating_add(undescribed) } else { addr };
                    if let Some(place) = next.saved_registers.get_mut(usize::from(register)) {
                        *place = Some(addr);
                    }
                }
                next.cfa = self.unwind_frame(machine, &next).map(|unwinding| unwinding.unwound.cfa);
                Some(next)
            }
            ChipFamily::Mcs51 if let Some(InterruptedCode { pc: word, sp }) = self.interrupted_code(machine, frame) => {
                Some(outer((word, word), sp))
            }
            ChipFamily::Mcs51 => {
                let peek = |at: u32| machine.peek(machine.chip().ram_space, at).map(u32::from);
                (0x09..=frame.sp.min(0xFF)).rev().find_map(|at| {
                    let word = peek(at)? << 8 | peek(at - 1)?;
                    Some(outer((self.call_site(machine, frame, word)?, word), at.saturating_sub(2)))
                })
            }
            ChipFamily::Pic16 => {
                let stack = machine.return_stack().into_iter().take(machine.stack_depth() as usize);
                let mut calls = stack.filter_map(|word| Some((call(word)?.at, word)));
                Some(outer(calls.nth(level)?, 0))
            }
            ChipFamily::Ap101 => None,
        }
    }

    /// Returns the program word that a service routine of an 8051 has interrupted, and the stack pointer
    /// there; `None` if the frame is in no such routine. A vector of SDCC jumps to its routine, which begins
    /// with all its pushes and ends with their pops and RETI.
    fn interrupted_code(&self, machine: &dyn DynMachine, frame: &CallFrame) -> Option<InterruptedCode> {
        const LJMP: u16 = 0x02;
        const RETI: u16 = 0x32;
        const PUSH: u16 = 0xC0;
        const POP: u16 = 0xD0;
        let chip = machine.chip();
        let code = |at: u32| session::program_word_at(machine, at);
        // Start-up code of SDCC at the first vector jumps to `main`.
        let start = self.function(frame.call_word).filter(|NamedFunction { name, .. }| name != "main")?.words.start;
        let mut vectors = (1..chip.vectors.len() as u32)
            .map(|n| (n * chip.words_per_vector).saturating_sub(chip.later_vectors_back_words));
        vectors.find(|at| {
            *at == start || code(*at) == LJMP && u32::from(code(at + 1)) << 8 | u32::from(code(at + 2)) == start
        })?;
        let count = |mut at: u32, end: u32, wanted: u16| {
            let first = at;
            while at < end && code(at) == wanted {
                at += 2;
            }
            (at, (at - first) / 2)
        };
        let pushed = match count(frame.word, u32::MAX, POP) {
            (end, pops) if code(end) == RETI => pops,
            _ => count(start, frame.call_word, PUSH).1,
        };
        let peek = |at: u32| machine.peek(chip.ram_space, at).map(u32::from);
        let high = frame.sp.checked_sub(pushed)?;
        let low = high.checked_sub(1)?;
        Some(InterruptedCode { pc: peek(high)? << 8 | peek(low)?, sp: low.saturating_sub(1) })
    }

    /// Returns the call before a return address, if it can have led to the frame.
    fn call_site(&self, machine: &dyn DynMachine, frame: &CallFrame, word: u32) -> Option<u32> {
        let CallInstruction { at, goal } = call_before(machine, word)?;
        let begins = self.function(frame.call_word).map(|NamedFunction { words, .. }| words.start);
        (goal.is_none() || begins.is_none() || goal == begins).then_some(at)
    }

    /// Returns how to get from a frame of an AVR to the frame of its caller, and the return address.
    fn unwind_frame(&self, machine: &dyn DynMachine, frame: &CallFrame) -> Option<FrameUnwinding> {
        let ram = machine.chip().ram_space;
        let pair = |low: u32| {
            Some(u32::from(machine.peek(ram, low.checked_sub(1)?)?) << 8 | u32::from(machine.peek(ram, low)?))
        };
        let service = self.is_service(frame);
        if let Some(unwound) = self.info.unwind(&MachineFrame { machine, frame })
            && let undescribed = if service { self.undescribed_pushes(machine, frame, &unwound) } else { 0 }
            && let Some(word) = pair(unwound.cfa.saturating_add(undescribed))
            && (service || self.call_site(machine, frame, word).is_some())
        {
            return Some(FrameUnwinding { unwound, word, undescribed });
        }
        let pushed = self.pushed_registers(machine, frame);
        let chip = machine.chip();
        let end = (u32::from(chip.ram_start) + u32::from(chip.ram_len)).min(frame.sp.saturating_add(MAX_STACK_BYTES));
        let found = |exact: bool| {
            (frame.sp.saturating_add(2)..end).find_map(|low| {
                let word = pair(low)?;
                let fits = if exact {
                    self.call_site(machine, frame, word)
                } else {
                    call_before(machine, word).map(|call| call.at)
                };
                fits.map(|_| (low, word))
            })
        };
        let (cfa, word) = match service {
            // An interrupt may occur anywhere, not only at a call.
            true => {
                let low = frame.sp + pushed.len() as u32 + 2;
                (low, pair(low)?)
            }
            false => found(true).or_else(|| found(false))?,
        };
        // The first register was pushed directly below the return address.
        let saved = (0..).zip(&pushed).filter_map(|(n, register)| {
            let addr = cfa.checked_sub(2 + n)?;
            (addr > frame.sp).then_some((*register, addr))
        });
        let unwound = UnwoundFrame { cfa, saved: saved.collect() };
        Some(FrameUnwinding { unwound, word, undescribed: 0 })
    }

    fn is_service(&self, frame: &CallFrame) -> bool {
        self.function(frame.call_word).is_some_and(|NamedFunction { name, .. }| name.starts_with("__vector_"))
    }

    /// Returns the number of bytes that a service routine has pushed and that `.debug_frame` does not
    /// describe: GCC leaves out the push of the flags, which are pushed through r0.
    fn undescribed_pushes(&self, machine: &dyn DynMachine, frame: &CallFrame, unwound: &UnwoundFrame) -> u32 {
        let pushed = self.pushed_registers(machine, frame);
        let Some((flags, _)) = (0..).zip(&pushed).filter(|(_, register)| **register == 0).nth(1) else { return 0 };
        // The described place of the first register after the flags shows whether the flags are counted.
        let later = (0u32..).zip(&pushed).skip(flags + 1).filter(|(_, register)| **register > 1);
        let known = later.into_iter().find_map(|(n, register)| {
            let (_, addr) = unwound.saved.iter().find(|(own, _)| own == register)?;
            Some((2 + n).saturating_sub(unwound.cfa.saturating_sub(*addr)))
        });
        known.unwrap_or(1).min(1)
    }

    /// Returns the registers that the prologue of a function has pushed before the frame's location.
    fn pushed_registers(&self, machine: &dyn DynMachine, frame: &CallFrame) -> Vec<u16> {
        let Some(NamedFunction { words, .. }) = self.function(frame.call_word) else { return Vec::new() };
        let (mut found, mut word) = (Vec::new(), words.start);
        while word < frame.call_word.min(words.start.saturating_add(MAX_PROLOGUE)) {
            // PUSH; between pushes a service routine has IN or LDS, of two words, and CLR.
            match session::program_word_at(machine, word) {
                code if code & 0xFE0F == 0x920F => found.push(code >> 4 & 0x1F),
                code if code & 0xF800 == 0xB000 || code == 0x2411 => {}
                0x9000 => word += 1,
                _ => break,
            }
            word += 1;
        }
        found
    }
}
