//! The state of a machine as bytes, and back ([`Cpu::save`](crate::Cpu::save), [`Cpu::restore`](crate::Cpu::restore)).
//!
//! A [`StateTape`] writes or reads, and a [`SnapshotState`] goes past it field by field: one text for both ways, so they cannot part. It reads into
//! a machine that is there already; what the machine was built of (its chip, options, image) is not on the tape and stays. The macro
//! [`state!`](crate::state!) names every field of a type, those that stay too, so that a new one cannot be forgotten.
//!
//! Numbers take as few bytes as they need, seven bits in each. Whatever bytes are read, reading ends in a value or in [`SnapshotDamaged`].

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::cpu::{LAST_CYCLE, NEVER, ResetCause};
use crate::pins::PinLevel;

/// The bytes are no state of such a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SnapshotDamaged;

impl std::fmt::Display for SnapshotDamaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the bytes are no state of this machine")
    }
}

impl std::error::Error for SnapshotDamaged {}

/// Bytes that are written, or read.
#[derive(Debug)]
pub struct StateTape<'a> {
    output: Vec<u8>,
    input: Option<&'a [u8]>,
    now: u64,
}

/// What has a state.
pub trait SnapshotState {
    /// Writes its state to the tape, or reads it from there.
    ///
    /// # Errors
    /// The tape holds something else; what was read so far has been changed.
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged>;
}

/// The bytes of a state.
pub fn save_state<S: SnapshotState>(of: &mut S) -> Vec<u8> {
    let mut tape = StateTape { output: Vec::new(), input: None, now: 0 };
    // Nothing fails that only writes.
    let _ = of.pass_state(&mut tape);
    tape.output
}

/// Reads a state into `of`.
///
/// # Errors
/// The bytes are no such state, or more than one: `of` is in part changed then.
pub fn load_state<S: SnapshotState>(of: &mut S, bytes: &[u8]) -> Result<(), SnapshotDamaged> {
    let mut tape = StateTape { output: Vec::new(), input: Some(bytes), now: 0 };
    of.pass_state(&mut tape)?;
    if tape.input == Some(&[]) { Ok(()) } else { Err(SnapshotDamaged) }
}

impl StateTape<'_> {
    /// True while a state is read.
    #[must_use]
    pub const fn is_reading(&self) -> bool {
        self.input.is_some()
    }

    /// The moment to which the state belongs, in the time of the parts that follow on the tape; 0 before [`StateTape::set_now`].
    #[must_use]
    pub const fn now(&self) -> u64 {
        self.now
    }

    /// Sets the moment to which the state belongs.
    pub const fn set_now(&mut self, now: u64) {
        self.now = now;
    }

    /// A demand on what was read.
    ///
    /// # Errors
    /// It is not met. Nothing is asked of what is written.
    pub fn require(&self, met: bool) -> Result<(), SnapshotDamaged> {
        if met || !self.is_reading() { Ok(()) } else { Err(SnapshotDamaged) }
    }

    /// One byte.
    ///
    /// # Errors
    /// There is none left.
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

    /// A number of up to 64 bits.
    ///
    /// # Errors
    /// None is there, or one that is longer than it needs be.
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

    /// A number below `end`.
    ///
    /// # Errors
    /// It is not below.
    pub fn pass_index(&mut self, value: &mut usize, end: usize) -> Result<(), SnapshotDamaged> {
        let number = self.pass_number(*value as u64)?;
        *value = usize::try_from(number).map_err(|_| SnapshotDamaged)?;
        self.require(*value < end)
    }

    /// Values of which there are as many as the machine has places for.
    ///
    /// # Errors
    /// One of them is none.
    pub fn pass_slice<T: SnapshotState>(&mut self, values: &mut [T]) -> Result<(), SnapshotDamaged> {
        values.iter_mut().try_for_each(|value| value.pass_state(self))
    }

    /// A memory of fixed size. Pages in which all bytes are alike take two.
    ///
    /// # Errors
    /// It ends early, or a page is written in another way than it would be.
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

    /// A yes or no.
    ///
    /// # Errors
    /// It is neither.
    pub fn pass_flag(&mut self, value: bool) -> Result<bool, SnapshotDamaged> {
        match self.pass_byte(value.into())? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(SnapshotDamaged),
        }
    }
}

/// Bytes of a page of [`StateTape::pass_memory`].
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

/// A moment, or a count of what happens in time: [`NEVER`], or so little that sums of a few do not overflow.
impl SnapshotState for u64 {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        // What never comes takes one byte.
        *self = tape.pass_number(self.wrapping_add(1))?.wrapping_sub(1);
        tape.require(*self == NEVER || *self <= MAX_TIME)
    }
}

/// The last moment of which anything is planned.
const MAX_TIME: u64 = LAST_CYCLE + (1 << 60);

/// Any bits.
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
        // However many are announced: the bytes end.
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

/// A memory of fixed size, shared until it changes.
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

/// What a program has changed of the memory that it runs from: where, and what stood there when the machine was built.
#[derive(Debug, Clone, Default)]
pub struct MemoryChanges<T>(BTreeMap<usize, T>);

impl<T: SnapshotState + Copy + Default + PartialEq> MemoryChanges<T> {
    /// Nothing yet.
    pub const NONE: MemoryChanges<T> = MemoryChanges(BTreeMap::new());

    /// What stood at `at` was `old`, and is `new`.
    pub fn record(&mut self, at: usize, old: T, new: T) {
        if *self.0.entry(at).or_insert(old) == new {
            self.0.remove(&at);
        }
    }

    /// Writes what `memory` holds in changed places to the tape, or reads it from there: then what is to be written into memory, by
    /// place.
    ///
    /// # Errors
    /// A place lies outside, or its value is no change.
    pub fn pass_state(&self, memory: &[T], tape: &mut StateTape<'_>) -> Result<Vec<(usize, T)>, SnapshotDamaged> {
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
        Ok(writes.into_iter().filter(|&(at, value)| memory.get(at) != Some(&value)).collect())
    }
}

/// How the fields of a type go past the tape: `Type { on, the, tape } stays { as, it, is }`, where `if |value, now| ..` demands
/// something of what is read and `, then ..` works out what follows from it; or `enum Type { 0 = One, 1 = Two(a), 2 = Three { b } }`.
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
