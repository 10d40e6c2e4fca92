//! What the flat form must know before its first element: start values, and analog inputs.

use ladder::{CounterKind, Element, LadderOperand, ProgramElement, TimerKind};

use crate::arithmetic::truncate;
use crate::flat_program::ValueSource;
use crate::flatten::FlatBuilder;

impl FlatBuilder<'_> {
    /// Collects what must be known before the first element: start values of counters, and analog inputs.
    pub(crate) fn collect_devices_and_starts(&mut self) {
        for ProgramElement { element, .. } in self.program.elements() {
            match element {
                // In LDmicro 5 a TOF begins with its preset, written in the same order of the text.
                Element::Timer { kind: TimerKind::Tof, name, delay, adjust } if !self.is_release_23() => {
                    let Some(&at) = self.by_name.get(name) else { continue };
                    let preset = self.timer_preset(TimerKind::Tof, at as u32, delay, adjust.as_ref());
                    // What is wrong with the timer is reported where it is flattened.
                    let Ok(preset) = preset else { continue };
                    let start = if let ValueSource::Const(preset) = preset { preset } else { -1 };
                    if let (Some(width), Some(initial)) =
                        (self.code.cut_bits.get(at), self.code.initial_values.get_mut(at))
                    {
                        *initial = truncate(start.into(), *width);
                    }
                }
                Element::Counter { kind, name, init, .. } => {
                    let Some(&at) = self.by_name.get(name) else { continue };
                    let start = match init {
                        None => LadderOperand::Const { value: 0, text: String::new() },
                        Some(start) => start.clone(),
                    };
                    // At power-up an integer has the start of the last counter of its name that has a
                    // constant.
                    if let LadderOperand::Const { value, .. } = start
                        && let (Some(width), Some(initial)) =
                            (self.code.cut_bits.get(at), self.code.initial_values.get_mut(at))
                    {
                        *initial = truncate(value, *width);
                    }
                    let of_kind = (reset_rank(*kind), start);
                    let slot = self.counter_starts.entry(name).or_insert_with(|| of_kind.clone());
                    if of_kind.0 < slot.0 {
                        *slot = of_kind;
                    }
                }
                Element::ReadAdc { name, .. } => {
                    self.code.adc_symbols.extend(self.by_name.get(name).and_then(|at| u32::try_from(*at).ok()));
                }
                // No other element defines start values or analog inputs.
                _ => {}
            }
        }
        self.code.adc_symbols.sort_unstable();
        self.code.adc_symbols.dedup();
    }
}

/// Which of several counters of one name says what RES stores: the least.
const fn reset_rank(kind: CounterKind) -> u8 {
    match kind {
        CounterKind::Ctu => 0,
        CounterKind::Ctd => 1,
        CounterKind::Ctc => 2,
        CounterKind::Ctr => 3,
    }
}
