//! Which element went wrong: the differing scan once more, stopped at every element.

use ladder::{Element, ElementId, Program};
use ladder_compile::Map;

use crate::family::Target;
use crate::goals::Seen;
use crate::lockstep::{Bench, Differing, Mismatch, Pair};
use crate::places::Point;
use crate::report::What;
use crate::stimulus::Step;

/// Finds the first element, in order of execution, whose result differs, and the symbol that shows it. `steps` end with
/// the scan that differs.
pub(crate) fn locate<C: Target, F: Fn(u64) -> C>(
    bench: &Bench<'_, C, F>,
    (program, map): (&Program, &Map),
    (ram_seed, steps): (u64, &[Step]),
    mismatch: &Mismatch,
) -> (Option<ElementId>, Option<Differing>) {
    if mismatch.what == What::Stop {
        let byte = mismatch.pc.map(|pc| pc * bench.places.word_bytes);
        return (byte.and_then(|byte| element_at(map, byte)), None);
    }
    let only = |what: fn(&Element) -> bool| {
        let mut all = program.elements().filter(|(_, element, _)| what(element)).map(|(id, ..)| id);
        all.next().filter(|_| all.next().is_none())
    };
    match mismatch.what {
        What::Serial => {
            let sends = |e: &Element| matches!(e, Element::UartSend { .. } | Element::FormattedString { .. });
            return (only(sends), None);
        }
        What::Pwm => return (only(|e| matches!(e, Element::SetPwm { .. })), None),
        What::Eeprom => return (only(|e| matches!(e, Element::Persist { .. })), None),
        _ => {}
    }
    let first = mismatch.differing.first().copied();
    if !matches!(mismatch.what, What::Symbol | What::Pin) {
        return (None, first);
    }
    let Some((seen, stops)) = walk(bench, map, ram_seed, steps, mismatch) else { return (None, first) };
    let suspects = mismatch.differing.iter().enumerate().map(|(n, &differing)| {
        let name = bench.eval.symbols().get(differing.symbol).map_or("", |s| s.name.as_str());
        (suspect(program, name, &seen, &changes(&stops, n)), differing)
    });
    suspects
        .filter_map(|(element, differing)| Some((element?, differing)))
        .min_by_key(|(element, _)| *element)
        .map_or((None, first), |(element, differing)| (Some(element), Some(differing)))
}

/// The element that the code at byte address `byte` belongs to.
fn element_at(map: &Map, byte: u32) -> Option<ElementId> {
    let found = map.elements.iter().find(|e| (e.start..e.end).contains(&byte))?;
    Some(ElementId { rung: found.rung.checked_sub(1)?, index: found.element.checked_sub(1)? })
}

/// Where the chip was stopped (nothing outside of the rungs), and the differing symbols there.
type Stops = Vec<(Option<ElementId>, Vec<i32>)>;

/// Runs the last scan from element to element.
fn walk<C: Target, F: Fn(u64) -> C>(
    bench: &Bench<'_, C, F>,
    map: &Map,
    ram_seed: u64,
    steps: &[Step],
    mismatch: &Mismatch,
) -> Option<(Seen, Stops)> {
    let (last, before) = steps.split_last()?;
    let mut pair = Pair::start(bench, ram_seed).ok()?;
    for step in before {
        pair.scan(step).ok()?;
    }
    pair.begin(last).ok()?;
    let seen = Seen::scan(&mut pair.eval);
    for element in &map.elements {
        pair.rig.cpu.trap(element.start / bench.places.word_bytes, true);
    }
    let mut stops = Stops::new();
    // A program that goes round in circles here has more stops than elements.
    for _ in 0..map.elements.len() + map.rungs.len() + 8 {
        let pc = pair.rig.reach_next().ok()?;
        if Some(pc) == bench.places.pc(Point::FirstRung) {
            pair.flip(last);
        }
        let values = mismatch.differing.iter().map(|d| bench.places.read(&pair.rig.cpu, d.symbol)).collect();
        stops.push((element_at(map, pc * bench.places.word_bytes), values));
        if Some(pc) == bench.places.pc(Point::ScanEnd) {
            break;
        }
    }
    Some((seen, stops))
}

/// The elements during which the chip changed the `n`-th differing symbol.
fn changes(stops: &Stops, n: usize) -> Vec<Option<ElementId>> {
    let changed = stops.windows(2).filter_map(|pair| match pair {
        [(at, before), (_, after)] if before.get(n) != after.get(n) => Some(*at),
        _ => None,
    });
    changed.collect()
}

/// The element to blame for one symbol.
fn suspect(program: &Program, name: &str, seen: &Seen, changes: &[Option<ElementId>]) -> Option<ElementId> {
    let elements = program.elements().filter(|(_, element, _)| !matches!(element, Element::Comment(_)));
    let mut writers = Vec::new();
    let mut last = None;
    for ((id, element, _), (input, _)) in elements.zip(&seen.trace) {
        let Some((written, when)) = writes(element) else { continue };
        let shifts =
            |stages: u32| name.strip_prefix(written).and_then(|n| n.parse().ok()).is_some_and(|n: u32| n < stages);
        let writes = match element {
            Element::ShiftRegister { stages, .. } => shifts(*stages),
            _ => written == name,
        };
        if writes {
            writers.push(id);
            if when == Writes::Always || *input {
                last = Some(id);
            }
        }
    }
    // An element that has no business with the symbol; then one that acted after the last that should have; then that.
    let stray = changes.iter().flatten().find(|id| !writers.contains(id));
    let late = changes.iter().flatten().find(|id| last.is_none_or(|last| **id > last));
    stray.or(late).copied().or(last)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Writes {
    Always,
    /// Only on a true rung.
    OnTrue,
}

/// What an element writes (of a shift register the stem of its integers), and when.
fn writes(element: &Element) -> Option<(&str, Writes)> {
    match element {
        Element::Coil { name, set: false, reset: false, .. } => Some((name, Writes::Always)),
        Element::Timer { name, .. } | Element::Counter { name, .. } => Some((name, Writes::Always)),
        Element::Coil { name, .. }
        | Element::Res { name }
        | Element::ShiftRegister { name, .. }
        | Element::ReadAdc { name, .. }
        | Element::UartRecv { name, .. }
        | Element::Persist { name } => Some((name, Writes::OnTrue)),
        Element::Move { dest, .. }
        | Element::Math { dest, .. }
        | Element::LookUpTable { dest, .. }
        | Element::PiecewiseLinear { dest, .. } => Some((dest, Writes::OnTrue)),
        _ => None,
    }
}
