//! The state of a machine as bytes, and back ([`Cpu::save`](crate::Cpu::save), [`Cpu::restore`](crate::Cpu::restore)).
//!
//! A [`Tape`] writes or reads, and a [`State`] goes past it field by field: one text for both ways, so they cannot part. It reads into
//! a machine that is there already; what the machine was built of (its chip, options, image) is not on the tape and stays. The macro
//! [`state!`](crate::state!) names every field of a type, those that stay too, so that a new one cannot be forgotten.
//!
//! Numbers take as few bytes as they need, seven bits in each. Whatever bytes are read, reading ends in a value or in [`Damaged`].

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::cpu::{END_OF_TIME, NEVER, Reset};
use crate::pins::Level;

/// The bytes are no state of such a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damaged;

impl std::fmt::Display for Damaged {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("the bytes are no state of this machine")
    }
}

impl std::error::Error for Damaged {}

/// Bytes that are written, or read.
#[derive(Debug)]
pub struct Tape<'a> {
    written: Vec<u8>,
    read: Option<&'a [u8]>,
    now: u64,
}

/// What has a state.
pub trait State {
    /// Writes its state to the tape, or reads it from there.
    ///
    /// # Errors
    /// The tape holds something else; what was read so far has been changed.
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged>;
}

/// The bytes of a state.
pub fn save<S: State>(of: &mut S) -> Vec<u8> {
    let mut tape = Tape { written: Vec::new(), read: None, now: 0 };
    // Nothing fails that only writes.
    let _ = of.state(&mut tape);
    tape.written
}

/// Reads a state into `of`.
///
/// # Errors
/// The bytes are no such state, or more than one: `of` is in part changed then.
pub fn load<S: State>(of: &mut S, bytes: &[u8]) -> Result<(), Damaged> {
    let mut tape = Tape { written: Vec::new(), read: Some(bytes), now: 0 };
    of.state(&mut tape)?;
    if tape.read == Some(&[]) { Ok(()) } else { Err(Damaged) }
}

impl Tape<'_> {
    /// True while a state is read.
    #[must_use]
    pub const fn reads(&self) -> bool {
        self.read.is_some()
    }

    /// The moment to which the state belongs, in the time of the parts that follow on the tape; 0 before [`Tape::set_now`].
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
    pub fn demand(&self, met: bool) -> Result<(), Damaged> {
        if met || !self.reads() { Ok(()) } else { Err(Damaged) }
    }

    /// One byte.
    ///
    /// # Errors
    /// There is none left.
    pub fn byte(&mut self, value: u8) -> Result<u8, Damaged> {
        match &mut self.read {
            None => {
                self.written.push(value);
                Ok(value)
            }
            Some(read) => {
                let (&first, rest) = read.split_first().ok_or(Damaged)?;
                *read = rest;
                Ok(first)
            }
        }
    }

    /// A number of up to 64 bits.
    ///
    /// # Errors
    /// None is there, or one that is longer than it needs be.
    pub fn number(&mut self, value: u64) -> Result<u64, Damaged> {
        if !self.reads() {
            let mut left = value;
            while left >= 0x80 {
                self.byte(left as u8 | 0x80)?;
                left >>= 7;
            }
            self.byte(left as u8)?;
            return Ok(value);
        }
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte(0)?;
            let bits = u64::from(byte & 0x7F);
            self.demand((bits << shift) >> shift == bits && (byte != 0 || shift == 0))?;
            number |= bits << shift;
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(Damaged)
    }

    /// A number below `end`.
    ///
    /// # Errors
    /// It is not below.
    pub fn below(&mut self, value: &mut usize, end: usize) -> Result<(), Damaged> {
        let number = self.number(*value as u64)?;
        *value = usize::try_from(number).map_err(|_| Damaged)?;
        self.demand(*value < end)
    }

    /// Values of which there are as many as the machine has places for.
    ///
    /// # Errors
    /// One of them is none.
    pub fn all<T: State>(&mut self, values: &mut [T]) -> Result<(), Damaged> {
        values.iter_mut().try_for_each(|value| value.state(self))
    }

    /// A memory of fixed size. Pages in which all bytes are alike take two.
    ///
    /// # Errors
    /// It ends early, or a page is written in another way than it would be.
    pub fn memory(&mut self, memory: &mut [u8]) -> Result<(), Damaged> {
        let uniform = |page: &[u8]| page.get(1..) == page.split_last().map(|(_, front)| front);
        for page in memory.chunks_mut(PAGE) {
            if self.flag(uniform(page))? {
                let first = page.first().copied().unwrap_or(0);
                page.fill(self.byte(first)?);
                continue;
            }
            match &mut self.read {
                None => self.written.extend_from_slice(page),
                Some(read) => {
                    let (bytes, rest) = read.split_at_checked(page.len()).ok_or(Damaged)?;
                    page.copy_from_slice(bytes);
                    *read = rest;
                }
            }
            self.demand(!uniform(page))?;
        }
        Ok(())
    }

    /// A yes or no.
    ///
    /// # Errors
    /// It is neither.
    pub fn flag(&mut self, value: bool) -> Result<bool, Damaged> {
        match self.byte(value.into())? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Damaged),
        }
    }
}

/// Bytes of a page of [`Tape::memory`].
const PAGE: usize = 256;

impl State for u8 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        *self = tape.byte(*self)?;
        Ok(())
    }
}

impl State for bool {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        *self = tape.flag(*self)?;
        Ok(())
    }
}

impl State for u16 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        *self = u16::try_from(tape.number((*self).into())?).map_err(|_| Damaged)?;
        Ok(())
    }
}

impl State for u32 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        *self = u32::try_from(tape.number((*self).into())?).map_err(|_| Damaged)?;
        Ok(())
    }
}

/// A moment, or a count of what happens in time: [`NEVER`], or so little that sums of a few do not overflow.
impl State for u64 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        // What never comes takes one byte.
        *self = tape.number(self.wrapping_add(1))?.wrapping_sub(1);
        tape.demand(*self == NEVER || *self <= LATEST)
    }
}

/// The last moment of which anything is planned.
const LATEST: u64 = END_OF_TIME + (1 << 60);

/// Any bits.
impl State for u128 {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let (low, high) = (tape.number(*self as u64)?, tape.number((*self >> 64) as u64)?);
        *self = u128::from(high) << 64 | u128::from(low);
        Ok(())
    }
}

impl State for usize {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        tape.below(self, usize::from(u16::MAX))
    }
}

impl<T: State, const N: usize> State for [T; N] {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        tape.all(self)
    }
}

impl<T: State + Default> State for Option<T> {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        if !tape.flag(self.is_some())? {
            *self = None;
            return Ok(());
        }
        self.get_or_insert_default().state(tape)
    }
}

impl<T: State + Default> State for Vec<T> {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let len = tape.number(self.len() as u64)?;
        if !tape.reads() {
            return tape.all(self);
        }
        self.clear();
        // However many are announced: the bytes end.
        for _ in 0..len {
            let mut value = T::default();
            value.state(tape)?;
            self.push(value);
        }
        Ok(())
    }
}

impl<T: State + Default> State for VecDeque<T> {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let mut values = Vec::from(std::mem::take(self));
        let read = values.state(tape);
        *self = values.into();
        read
    }
}

/// A memory of fixed size, shared until it changes.
impl State for Arc<Vec<u8>> {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let cells: &mut Vec<u8> = Arc::make_mut(self);
        tape.memory(cells)
    }
}

impl<A: State, B: State> State for (A, B) {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.0.state(tape)?;
        self.1.state(tape)
    }
}

impl<A: State, B: State, C: State> State for (A, B, C) {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        self.0.state(tape)?;
        self.1.state(tape)?;
        self.2.state(tape)
    }
}

/// What a program has changed of the memory that it runs from: where, and what stood there when the machine was built.
#[derive(Debug, Clone, Default)]
pub struct Changes<T>(BTreeMap<usize, T>);

impl<T: State + Copy + Default + PartialEq> Changes<T> {
    /// Nothing yet.
    pub const NONE: Changes<T> = Changes(BTreeMap::new());

    /// What stood at `at` was `old`, and is `new`.
    pub fn note(&mut self, at: usize, old: T, new: T) {
        if *self.0.entry(at).or_insert(old) == new {
            self.0.remove(&at);
        }
    }

    /// Writes what `memory` holds in changed places to the tape, or reads it from there: then what is to be written into memory, by
    /// place.
    ///
    /// # Errors
    /// A place lies outside, or its value is no change.
    pub fn pass(&self, memory: &[T], tape: &mut Tape<'_>) -> Result<Vec<(usize, T)>, Damaged> {
        let mut changes: Vec<_> = self.0.keys().filter_map(|&at| Some((at as u32, *memory.get(at)?))).collect();
        changes.state(tape)?;
        let changed = |&(at, value): &(u32, T)| {
            let now = memory.get(at as usize);
            now.is_some_and(|now| *self.0.get(&(at as usize)).unwrap_or(now) != value)
        };
        let rising = changes.iter().zip(changes.iter().skip(1)).all(|(first, second)| first.0 < second.0);
        tape.demand(rising && changes.iter().all(changed))?;
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
        impl $crate::state::State for $type {
            fn state(&mut self, tape: &mut $crate::state::Tape<'_>) -> Result<(), $crate::state::Damaged> {
                if tape.reads() {
                    *self = match tape.byte(0)? {
                        $($tag => {
                            $($(
                                let mut $place = Default::default();
                                $crate::state::State::state(&mut $place, tape)?;
                            )+)?
                            $($(
                                let mut $field = Default::default();
                                $crate::state::State::state(&mut $field, tape)?;
                            )+)?
                            Self::$variant $(($($place),+))? $({ $($field),+ })?
                        })+
                        _ => return Err($crate::state::Damaged),
                    };
                    return Ok(());
                }
                match self {
                    $(Self::$variant $(($($place),+))? $({ $($field),+ })? => {
                        tape.byte($tag)?;
                        $($($crate::state::State::state($place, tape)?;)+)?
                        $($($crate::state::State::state($field, tape)?;)+)?
                    })+
                }
                Ok(())
            }
        }
    };
    ($type:ty { $($field:ident),* $(,)? } $(stays { $($stays:ident),+ $(,)? })? $(if |$value:ident, $now:ident| $sound:expr)? $(, then $then:expr)?) => {
        impl $crate::state::State for $type {
            fn state(&mut self, tape: &mut $crate::state::Tape<'_>) -> Result<(), $crate::state::Damaged> {
                let Self { $($field,)* $($($stays: _,)+)? } = self;
                $($crate::state::State::state($field, tape)?;)*
                $(
                    let ($value, $now) = (&*self, tape.now());
                    let _ = $now;
                    tape.demand($sound)?;
                )?
                $(if tape.reads() {
                    $then(self);
                })?
                Ok(())
            }
        }
    };
}

state! { enum Level { 0 = Low, 1 = High, 2 = Float, 3 = PullUp, 4 = PullDown } }
state! { enum Reset { 0 = PowerOn, 1 = External, 2 = Watchdog, 3 = BrownOut } }
