//! Breakpoints and watchpoints.

use emu_core::pins::{PinId, PinLevel};

use super::dyn_machine::DynMachine;
use super::expression::DebugExpression;
use super::expression_value::ExpressionValue;
use crate::address_names::AddressRange;

/// The accesses that a watchpoint waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccessKind {
    /// Reads, including those before a write.
    Read,
    /// Reads and writes.
    Any,
    /// Writes, even if they change nothing.
    Write,
}

/// The event that a point waits for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PointTrigger {
    /// One of these program words is next.
    Code(Vec<u32>),
    /// The program accesses one of these bytes, as reported by the probe of the machine.
    Access(AddressRange, AccessKind),
    /// The value of an expression has changed; checked after every instruction.
    Change(DebugExpression),
    /// A pin reaches a level, or (without one) changes its level.
    Pin(PinId, Option<PinLevel>),
}

/// A breakpoint or watchpoint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DebugPoint {
    /// Number of the point, from 1; never reused in a session.
    pub id: u32,
    /// The event that the point waits for.
    pub trigger: PointTrigger,
    /// The user's text for the trigger.
    pub text: String,
    /// The point is deleted when it stops the machine.
    pub temporary: bool,
    /// The point is active.
    pub enabled: bool,
    /// Number of stops after which the point is disabled, if there is a limit.
    pub stops_left: Option<u64>,
    /// The point stops the machine only if the value of this expression is not 0.
    pub condition: Option<DebugExpression>,
    /// The condition as written; empty if there is none.
    pub condition_text: String,
    /// Number of hits to ignore.
    pub ignore: u64,
    /// Number of hits so far, including ignored ones; running backwards counts none.
    pub hits: u64,
    /// If the point watches variables of a call: where that call returns. The point is deleted there.
    pub call_end: Option<CallEnd>,
    /// Commands that the command line executes when the point has stopped the machine.
    pub commands: Vec<String>,
}

/// Where a call has returned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CallEnd {
    /// Program word address of the instruction after the call.
    pub return_word: u32,
    /// The least value of the stack pointer after the return.
    pub stack_pointer: u32,
}

impl DebugPoint {
    /// Returns true if the call whose variables the point watches has just returned.
    #[must_use]
    pub fn has_call_returned(&self, machine: &dyn DynMachine) -> bool {
        self.call_end.is_some_and(|end| {
            machine.pc() == end.return_word && machine.reg("SP").is_some_and(|sp| sp >= end.stack_pointer)
        })
    }

    /// Returns true if the condition holds now, or there is none. A condition without a value (a floating
    /// pin) holds: a superfluous stop is better than a missed one.
    #[must_use]
    pub fn condition_holds(&self, machine: &dyn DynMachine) -> bool {
        self.condition.as_ref().is_none_or(|condition| condition.evaluate(machine).is_none_or(ExpressionValue::is_true))
    }
}

/// All points of a session, in order of their numbers.
#[derive(Debug, Clone, Default)]
pub struct DebugPoints {
    all: Vec<DebugPoint>,
    last_id: u32,
}

impl DebugPoints {
    /// Adds a point; returns its number.
    pub fn add(&mut self, what: PointTrigger, text: &str, temporary: bool) -> u32 {
        self.last_id += 1;
        self.all.push(DebugPoint {
            id: self.last_id,
            trigger: what,
            text: text.to_owned(),
            temporary,
            enabled: true,
            stops_left: None,
            condition: None,
            condition_text: String::new(),
            ignore: 0,
            hits: 0,
            call_end: None,
            commands: Vec::new(),
        });
        self.last_id
    }

    /// Returns all points.
    #[must_use]
    pub fn all(&self) -> &[DebugPoint] {
        &self.all
    }

    /// Returns the point with this number.
    #[must_use]
    pub fn get(&self, id: u32) -> Option<&DebugPoint> {
        self.all.iter().find(|point| point.id == id)
    }

    /// Returns the point with this number for modification.
    pub fn get_mut(&mut self, id: u32) -> Option<&mut DebugPoint> {
        self.all.iter_mut().find(|point| point.id == id)
    }

    /// Deletes a point; returns false if there is none with this number.
    pub fn remove(&mut self, id: u32) -> bool {
        let before = self.all.len();
        self.all.retain(|point| point.id != id);
        self.all.len() < before
    }

    /// Records that points have stopped the machine: deletes temporary ones, and disables those with no stops
    /// left.
    pub(super) fn note_stops(&mut self, ids: impl Iterator<Item = u32>) {
        for id in ids {
            let Some(point) = self.get_mut(id) else { continue };
            if let Some(left) = point.stops_left {
                point.stops_left = Some(left.saturating_sub(1)).filter(|left| *left > 0);
                point.enabled = point.stops_left.is_some();
            }
            if point.temporary {
                self.remove(id);
            }
        }
    }

    /// Deletes all.
    pub fn clear(&mut self) {
        self.all.clear();
    }

    /// Returns the enabled points.
    pub fn enabled(&self) -> impl Iterator<Item = &DebugPoint> {
        self.all.iter().filter(|point| point.enabled)
    }
}

/// Returns the program words at which points stop the machine.
pub(super) fn breakpoint_words(points: &DebugPoints) -> impl Iterator<Item = u32> + '_ {
    points.enabled().flat_map(|point| match &point.trigger {
        PointTrigger::Code(words) => words.clone(),
        _ => point.call_end.iter().map(|end| end.return_word).collect(),
    })
}
