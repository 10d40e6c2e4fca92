//! Locates the element that caused a difference: repeats the differing scan and stops at every element.

use ladder::{ChipPart, Element, ElementId, LadderProgram, ProgramElement, WriteMoment};
use ladder_compile::ImageMap;

use crate::chip::families::CheckedChip;
use crate::chip::program_places::ScanPoint;
use crate::comparison::lockstep::{DifferingSymbol, LockstepPair, Mismatch, TestBench};
use crate::coverage::goals::EvaluatedScan;
use crate::report::check_report::DifferenceKind;
use crate::stimulus::generator::ScanStimulus;

/// Finds the first element in execution order whose result differs, and the symbol that shows it. The last of
/// `stimuli` is the scan that differs.
pub(crate) fn find_faulty_element<C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'_, C, F>,
    (program, map): (&LadderProgram, &ImageMap),
    (ram_seed, stimuli): (u64, &[ScanStimulus]),
    mismatch: &Mismatch,
) -> (Option<ElementId>, Option<DifferingSymbol>) {
    if mismatch.kind == DifferenceKind::Stop {
        let byte = mismatch.pc.map(|pc| pc * bench.places.word_bytes);
        return (byte.and_then(|byte| element_at(map, byte)), None);
    }
    let only_element_with = |part: ChipPart| {
        let mut all = program
            .elements()
            .filter(|ProgramElement { element: e, .. }| e.facts().part == Some(part))
            .map(|ProgramElement { id, .. }| id);
        all.next().filter(|_| all.next().is_none())
    };
    match mismatch.kind {
        DifferenceKind::Serial => return (only_element_with(ChipPart::Transmitter), None),
        DifferenceKind::Pwm => return (only_element_with(ChipPart::Pwm), None),
        DifferenceKind::Bus => {
            return (only_element_with(ChipPart::I2c).or_else(|| only_element_with(ChipPart::Spi)), None);
        }
        DifferenceKind::Eeprom => return (only_element_with(ChipPart::Eeprom), None),
        _ => {}
    }
    let first = mismatch.differing.first().copied();
    if !matches!(mismatch.kind, DifferenceKind::Symbol | DifferenceKind::Pin) {
        return (None, first);
    }
    let Some((evaluated, stops)) = step_through_elements(bench, map, ram_seed, stimuli, mismatch) else {
        return (None, first);
    };
    let suspects = mismatch.differing.iter().enumerate().map(|(n, &differing)| {
        let name = bench.eval.symbols().get(differing.symbol).map_or("", |s| s.name.as_str());
        (suspect_element(program, name, &evaluated, &changing_elements(&stops, n)), differing)
    });
    suspects
        .filter_map(|(element, differing)| Some((element?, differing)))
        .min_by_key(|(element, _)| *element)
        .map_or((None, first), |(element, differing)| (Some(element), Some(differing)))
}

/// The element whose code contains byte address `byte`.
fn element_at(map: &ImageMap, byte: u32) -> Option<ElementId> {
    let found = map.elements.iter().find(|e| (e.start..e.end).contains(&byte))?;
    Some(ElementId { rung: found.rung.checked_sub(1)?, index: found.element.checked_sub(1)? })
}

/// One entry per stop: the element (`None` outside of the rungs) and the values of the differing symbols.
type ElementStops = Vec<(Option<ElementId>, Vec<i32>)>;

/// Runs the last scan from element to element.
fn step_through_elements<C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'_, C, F>,
    map: &ImageMap,
    ram_seed: u64,
    stimuli: &[ScanStimulus],
    mismatch: &Mismatch,
) -> Option<(EvaluatedScan, ElementStops)> {
    let (last, before) = stimuli.split_last()?;
    let mut pair = LockstepPair::start(bench, ram_seed).ok()?;
    for stimulus in before {
        pair.scan(stimulus).ok()?;
    }
    pair.begin_scan(last).ok()?;
    let evaluated = EvaluatedScan::run(&mut pair.eval);
    for element in &map.elements {
        pair.runner.cpu.set_breakpoint(element.start / bench.places.word_bytes, true);
    }
    let mut stops = ElementStops::new();
    // The limit ends a faulty program that loops here.
    for _ in 0..map.elements.len() + map.rungs.len() + 8 {
        let pc = pair.runner.reach_next().ok()?;
        if Some(pc) == bench.places.point_word(ScanPoint::FirstRung) {
            pair.flip_inputs(last);
        }
        let values = mismatch.differing.iter().map(|d| bench.places.read_symbol(&pair.runner.cpu, d.symbol)).collect();
        stops.push((element_at(map, pc * bench.places.word_bytes), values));
        if Some(pc) == bench.places.point_word(ScanPoint::ScanEnd) {
            break;
        }
    }
    Some((evaluated, stops))
}

/// The elements during whose execution the chip changed the `n`-th differing symbol.
fn changing_elements(stops: &ElementStops, n: usize) -> Vec<Option<ElementId>> {
    let changed = stops.windows(2).filter_map(|pair| match pair {
        [(at, before), (_, after)] if before.get(n) != after.get(n) => Some(*at),
        _ => None,
    });
    changed.collect()
}

/// The element that most likely caused the wrong value of symbol `name`.
fn suspect_element(
    program: &LadderProgram,
    name: &str,
    evaluated: &EvaluatedScan,
    changes: &[Option<ElementId>],
) -> Option<ElementId> {
    let elements = program.elements().filter(|at| !matches!(at.element, Element::Comment(_)));
    let mut writers = Vec::new();
    let mut last = None;
    for (ProgramElement { id, element, .. }, pair) in elements.zip(&evaluated.trace) {
        let Some((input, output)) = pair else { continue };
        let Some(moment) = element.facts().write_moment(name) else { continue };
        writers.push(id);
        let has_written = match moment {
            WriteMoment::Always => true,
            WriteMoment::Powered => *input,
            WriteMoment::Passing => *output,
        };
        if has_written {
            last = Some(id);
        }
    }
    // In this order: an element that must not write the symbol; one that wrote it after the last correct
    // writer; that last writer.
    let wrong_writer = changes.iter().flatten().find(|id| !writers.contains(id));
    let late_writer = changes.iter().flatten().find(|id| last.is_none_or(|last| **id > last));
    wrong_writer.or(late_writer).copied().or(last)
}
