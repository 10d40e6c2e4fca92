//! Writes the state of a machine as bytes and reads it back ([`Cpu::save`](crate::Cpu::save),
//! [`Cpu::restore`](crate::Cpu::restore)).
//!
//! A [`StateTape`] either writes or reads. A [`SnapshotState`] passes its fields to the tape one by one with
//! the same code for both directions, so the two cannot differ. Reading fills an existing machine. What the
//! machine was built from (chip, options, image) is not on the tape and stays. The macro
//! [`state!`](crate::state!) must name every field of a type, including those that are not saved, so that a
//! new field cannot be forgotten.
//!
//! A number takes as few bytes as it needs, with seven bits in each byte. For any input, reading ends with a
//! value or with [`SnapshotDamaged`].

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::cpu::{LAST_CYCLE, NEVER, ResetCause};
use crate::pins::PinLevel;

/// Error: the bytes are not a state of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SnapshotDamaged;

impl std::fmt::Display for SnapshotDamaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the bytes are not a state of this machine")
    }
}

impl std::error::Error for SnapshotDamaged {}

/// A stream of bytes that is either written or read.
#[derive(Debug)]
pub struct StateTape<'a> {
    output: Vec<u8>,
    input: Option<&'a [u8]>,
    now: u64,
}

/// A type whose state can be saved and restored.
pub trait SnapshotState {
    /// Writes its state to the tape or reads it from the tape, depending on the tape's direction.
    ///
    /// # Errors
    /// The tape does not contain such a state. Fields that were read before the error are changed.
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged>;
}

/// Returns the state of `of` as bytes.
pub fn save_state<S: SnapshotState>(of: &mut S) -> Vec<u8> {
    let mut tape = StateTape { output: Vec::new(), input: None, now: 0 };
    // Writing cannot fail.
    let _ = of.pass_state(&mut tape);
    tape.output
}

/// Reads a state into `of`.
///
/// # Errors
/// The bytes are not such a state, or bytes are left over. `of` is partly changed then.
pub fn load_state<S: SnapshotState>(of: &mut S, bytes: &[u8]) -> Result<(), SnapshotDamaged> {
    let mut tape = StateTape { output: Vec::new(), input: Some(bytes), now: 0 };
    of.pass_state(&mut tape)?;
    if tape.input == Some(&[]) { Ok(()) } else { Err(SnapshotDamaged) }
}

impl StateTape<'_> {
    /// Returns true if the tape reads a state.
    #[must_use]
    pub const fn is_reading(&self) -> bool {
        self.input.is_some()
    }

    /// The time of the state, in the unit of the parts that follow on the tape. It is 0 before
    /// [`StateTape::set_now`].
    #[must_use]
    pub const fn now(&self) -> u64 {
        self.now
    }

    /// Sets the time of the state.
    pub const fn set_now(&mut self, now: u64) {
        self.now = now;
    }

    /// Checks a condition on a value that was read.
    ///
    /// # Errors
    /// `met` is false while reading. Writing never fails.
    pub fn require(&self, met: bool) -> Result<(), SnapshotDamaged> {
        if met || !self.is_reading() { Ok(()) } else { Err(SnapshotDamaged) }
    }

    /// Writes `value`, or reads and returns one byte.
    ///
    /// # Errors
    /// No byte is left.
    pub fn pass_byte(&mut self, value: u8) -> Result<u8, SnapshotDamaged> {
        match &mut self.input {
            None => {
                self.output.push(value);
                Ok(value)
            }
            Some(read) => {
                let (&first, rest) = read.split_first().ok_or(SnapshotDamaged)?;
                *read = rest;
                Ok(first)
            }
        }
    }

    /// Writes `value`, or reads and returns a number of up to 64 bits.
    ///
    /// # Errors
    /// There is no number, or it is written with more bytes than necessary.
    pub fn pass_number(&mut self, value: u64) -> Result<u64, SnapshotDamaged> {
        if !self.is_reading() {
            let mut left = value;
            while left >= 0x80 {
                self.pass_byte(left as u8 | 0x80)?;
                left >>= 7;
            }
            self.pass_byte(left as u8)?;
            return Ok(value);
        }
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.pass_byte(0)?;
            let bits = u64::from(byte & 0x7F);
            self.require((bits << shift) >> shift == bits && (byte != 0 || shift == 0))?;
            number |= bits << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(SnapshotDamaged)
    }

    /// Writes or reads a number below `end`.
    ///
    /// # Errors
    /// The number is not below `end`.
    pub fn pass_index(&mut self, value: &mut usize, end: usize) -> Result<(), SnapshotDamaged> {
        let number = self.pass_number(*value as u64)?;
        *value = usize::try_from(number).map_err(|_| SnapshotDamaged)?;
        self.require(*value < end)
    }

    /// Writes or reads a fixed number of values.
    ///
    /// # Errors
    /// One of the values cannot be read.
    pub fn pass_slice<T: SnapshotState>(&mut self, values: &mut [T]) -> Result<(), SnapshotDamaged> {
        values.iter_mut().try_for_each(|value| value.pass_state(self))
    }

    /// Writes or reads a memory of fixed size. A page of 256 equal bytes takes two bytes.
    ///
    /// # Errors
    /// The input ends early, or a page is not encoded in the canonical way.
    pub fn pass_memory(&mut self, memory: &mut [u8]) -> Result<(), SnapshotDamaged> {
        let uniform = |page: &[u8]| page.get(1..) == page.split_last().map(|(_, front)| front);
        for page in memory.chunks_mut(PAGE_BYTES) {
            if self.pass_flag(uniform(page))? {
                let first = page.first().copied().unwrap_or(0);
                page.fill(self.pass_byte(first)?);
                continue;
            }
            match &mut self.input {
                None => self.output.extend_from_slice(page),
                Some(read) => {
                    let (bytes, rest) = read.split_at_checked(page.len()).ok_or(SnapshotDamaged)?;
                    page.copy_from_slice(bytes);
                    *read = rest;
                }
            }
            self.require(!uniform(page))?;
        }
        Ok(())
    }

    /// Writes `value`, or reads and returns a flag.
    ///
    /// # Errors
    /// The byte is neither 0 nor 1.
    pub fn pass_flag(&mut self, value: bool) -> Result<bool, SnapshotDamaged> {
        match self.pass_byte(value.into())? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(SnapshotDamaged),
        }
    }
}

/// Size of a page of [`StateTape::pass_memory`], in bytes.
const PAGE_BYTES: usize = 256;

impl SnapshotState for u8 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        *self = tape.pass_byte(*self)?;
        Ok(())
    }
}

impl SnapshotState for bool {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        *self = tape.pass_flag(*self)?;
        Ok(())
    }
}

impl SnapshotState for u16 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        *self = u16::try_from(tape.pass_number((*self).into())?).map_err(|_| SnapshotDamaged)?;
        Ok(())
    }
}

impl SnapshotState for u32 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        *self = u32::try_from(tape.pass_number((*self).into())?).map_err(|_| SnapshotDamaged)?;
        Ok(())
    }
}

/// A time or a count of events: [`NEVER`], or small enough that the sum of a few does not overflow.
impl SnapshotState for u64 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        // [`NEVER`] takes one byte.
        *self = tape.pass_number(self.wrapping_add(1))?.wrapping_sub(1);
        tape.require(*self == NEVER || *self <= MAX_TIME)
    }
}

/// The latest time for which anything can be scheduled.
const MAX_TIME: u64 = LAST_CYCLE + (1 << 60);

/// All values are valid.
impl SnapshotState for u128 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (low, high) = (tape.pass_number(*self as u64)?, tape.pass_number((*self >> 64) as u64)?);
        *self = u128::from(high) << 64 | u128::from(low);
        Ok(())
    }
}

impl SnapshotState for usize {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        tape.pass_index(self, usize::from(u16::MAX))
    }
}

impl<T: SnapshotState, const N: usize> SnapshotState for [T; N] {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        tape.pass_slice(self)
    }
}

impl<T: SnapshotState + Default> SnapshotState for Option<T> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        if !tape.pass_flag(self.is_some())? {
            *self = None;
            return Ok(());
        }
        self.get_or_insert_default().pass_state(tape)
    }
}

impl<T: SnapshotState + Default> SnapshotState for Vec<T> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let len = tape.pass_number(self.len() as u64)?;
        if !tape.is_reading() {
            return tape.pass_slice(self);
        }
        self.clear();
        // A length that is too large is harmless: the input ends first.
        for _ in 0..len {
            let mut value = T::default();
            value.pass_state(tape)?;
            self.push(value);
        }
        Ok(())
    }
}

impl<T: SnapshotState + Default> SnapshotState for VecDeque<T> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let mut values = Vec::from(std::mem::take(self));
        let read = values.pass_state(tape);
        *self = values.into();
        read
    }
}

/// A memory of fixed size that clones share until one of them changes it.
impl SnapshotState for Arc<Vec<u8>> {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let cells: &mut Vec<u8> = Arc::make_mut(self);
        tape.pass_memory(cells)
    }
}

impl<A: SnapshotState, B: SnapshotState> SnapshotState for (A, B) {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.0.pass_state(tape)?;
        self.1.pass_state(tape)
    }
}

impl<A: SnapshotState, B: SnapshotState, C: SnapshotState> SnapshotState for (A, B, C) {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        self.0.pass_state(tape)?;
        self.1.pass_state(tape)?;
        self.2.pass_state(tape)
    }
}

/// The changes that a program made to its own program memory: the address, and the value at the time when the
/// machine was built.
#[derive(Debug, Clone, Default)]
pub struct MemoryChanges<T>(BTreeMap<usize, T>);

/// A value for one cell of a memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CellWrite<T> {
    /// The position of the cell in the memory.
    pub index: usize,
    /// The value.
    pub value: T,
}

impl<T: SnapshotState + Copy + Default + PartialEq> MemoryChanges<T> {
    /// No changes.
    pub const NONE: MemoryChanges<T> = MemoryChanges(BTreeMap::new());

    /// Records that the value at `at` changed from `old` to `new`.
    pub fn record(&mut self, at: usize, old: T, new: T) {
        if *self.0.entry(at).or_insert(old) == new {
            self.0.remove(&at);
        }
    }

    /// Writes the present values of `memory` at the changed addresses to the tape, or reads them from it.
    /// When reading, returns the writes that make `memory` the saved one, in order of address.
    ///
    /// # Errors
    /// An address is outside of the memory or not in rising order, or a value equals the original one.
    pub fn pass_state(&self, memory: &[T], tape: &mut StateTape<'_>) -> Result<Vec<CellWrite<T>>, SnapshotDamaged> {
        let mut changes: Vec<_> = self.0.keys().filter_map(|&at| Some((at as u32, *memory.get(at)?))).collect();
        changes.pass_state(tape)?;
        let changed = |&(at, value): &(u32, T)| {
            let now = memory.get(at as usize);
            now.is_some_and(|now| *self.0.get(&(at as usize)).unwrap_or(now) != value)
        };
        let rising = changes.iter().zip(changes.iter().skip(1)).all(|(first, second)| first.0 < second.0);
        tape.require(rising && changes.iter().all(changed))?;
        let mut writes = self.0.clone();
        writes.extend(changes.into_iter().map(|(at, value)| (at as usize, value)));
        let writes = writes.into_iter().map(|(index, value)| CellWrite { index, value });
        Ok(writes.filter(|write| memory.get(write.index) != Some(&write.value)).collect())
    }
}

/// Implements [`SnapshotState`](crate::state::SnapshotState) for a type, field by field.
///
/// For a struct: `Type { on, the, tape } stays { as, it, is }`. An optional `if |value, now| ..` is a
/// condition on the state that was read, and an optional `, then ..` computes what follows from it. For an
/// enum: `enum Type { 0 = One, 1 = Two(a), 2 = Three { b } }`.
#[macro_export]
macro_rules! state {
    (enum $type:ty { $($tag:literal = $variant:ident $(($($place:ident),+))? $({ $($field:ident),+ })?),+ $(,)? }) => {
        impl $crate::state::SnapshotState for $type {
            fn pass_state(&mut self, tape: &mut $crate::state::StateTape<'_>) -> Result<(), $crate::state::SnapshotDamaged> {
                if tape.is_reading() {
                    *self = match tape.pass_byte(0)? {
                        $($tag => {
                            $($(
                                let mut $place = Default::default();
                                $crate::state::SnapshotState::pass_state(&mut $place, tape)?;
                            )+)?
                            $($(
                                let mut $field = Default::default();
                                $crate::state::SnapshotState::pass_state(&mut $field, tape)?;
                            )+)?
                            Self::$variant $(($($place),+))? $({ $($field),+ })?
                        })+
                        _ => return Err($crate::state::SnapshotDamaged),
                    };
                    return Ok(());
                }
                match self {
                    $(Self::$variant $(($($place),+))? $({ $($field),+ })? => {
                        tape.pass_byte($tag)?;
                        $($($crate::state::SnapshotState::pass_state($place, tape)?;)+)?
                        $($($crate::state::SnapshotState::pass_state($field, tape)?;)+)?
                    })+
                }
                Ok(())
            }
        }
    };
    ($type:ty { $($field:ident),* $(,)? } $(stays { $($stays:ident),+ $(,)? })? $(if |$value:ident, $now:ident| $sound:expr)? $(, then $then:expr)?) => {
        impl $crate::state::SnapshotState for $type {
            fn pass_state(&mut self, tape: &mut $crate::state::StateTape<'_>) -> Result<(), $crate::state::SnapshotDamaged> {
                let Self { $($field,)* $($($stays: _,)+)? } = self;
                $($crate::state::SnapshotState::pass_state($field, tape)?;)*
                $(
                    let ($value, $now) = (&*self, tape.now());
                    let _ = $now;
                    tape.require($sound)?;
                )?
                $(if tape.is_reading() {
                    $then(self);
                })?
                Ok(())
            }
        }
    };
}

state! { enum PinLevel { 0 = Low, 1 = High, 2 = Float, 3 = PullUp, 4 = PullDown } }
state! { enum ResetCause { 0 = PowerOn, 1 = External, 2 = Watchdog, 3 = BrownOut } }
