//! Builds the map of a finished image.

use ladder::{Element, ElementId, LadderProgram, ProgramElement};

use crate::lower;
use crate::map::{EepromMap, ElementMap, ImageMap, PinMap, RungMap, SCHEMA, SymbolMap};
use crate::target::{BuiltImage, CodeMark, CompileJob};

/// Maps every pin, symbol, rung and element of `program` to its place in `built`.
pub(crate) fn build_map(program: &LadderProgram, job: &CompileJob<'_>, built: &BuiltImage) -> ImageMap {
    let chip = job.target.chip;
    let at = |mark| built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at * chip.word_bytes);
    let byte = |mark| at(mark).unwrap_or(0);
    let rungs_end = byte(CodeMark::RungsEnd);
    let starts: Vec<u32> = (0..program.rungs.len() as u32).map(|n| byte(CodeMark::Rung(n))).collect();
    let end_of = |rung: usize| starts.get(rung + 1).copied().unwrap_or(rungs_end);
    let listed: Vec<(ElementId, u32)> = built
        .marks
        .iter()
        .filter_map(
            |&(mark, at)| if let CodeMark::Element(id) = mark { Some((id, at * chip.word_bytes)) } else { None },
        )
        .collect();
    // Marks and elements are in the same order. An element without a mark has no code, and the checks of the
    // map find it.
    let elements = program.elements().map(|ProgramElement { id, element, .. }| {
        let place = listed.binary_search_by_key(&id, |&(listed, _)| listed).ok();
        let start = place.and_then(|n| listed.get(n)).map_or(0, |&(_, at)| at);
        let next = place.and_then(|n| listed.get(n + 1)).filter(|(next, _)| next.rung == id.rung);
        ElementMap {
            rung: id.rung + 1,
            element: id.index + 1,
            text: ladder::element_text(element),
            start,
            end: next.map_or_else(|| end_of(id.rung as usize), |&(_, at)| at),
        }
    });
    let symbols = program.symbols().into_iter().filter_map(|symbol| {
        let place = if symbol.kind.is_bit() {
            built.bit_places.get(job.ir.bits.iter().position(|cell| cell.name == symbol.name)?)?
        } else {
            built.word_places.get(job.ir.words.iter().position(|cell| cell.name == symbol.name)?)?
        };
        Some(SymbolMap { name: symbol.name, kind: symbol.kind, place: place.clone() })
    });
    let rung = |(n, &start): (usize, &u32)| RungMap {
        rung: n as u32 + 1,
        start,
        end: end_of(n),
        worst_cycles: built.rung_cycles.get(n).copied().unwrap_or(0),
    };
    ImageMap {
        schema: SCHEMA,
        mcu: chip.name.to_owned(),
        clock_hz: job.clock_hz,
        cycle: built.period,
        tick: built.tick_cycles,
        timer_start: byte(CodeMark::TimerStart),
        poll: byte(CodeMark::PollLoop),
        poll_cycles: built.poll_cycles as u32,
        scan_start: byte(CodeMark::ScanStart),
        scan_end: byte(CodeMark::ScanEnd),
        worst_scan_cycles: built.worst_scan_cycles as u32,
        // Configuration words are beyond program memory.
        code_bytes: built
            .segments
            .iter()
            .filter(|(at, _)| *at < chip.flash_bytes)
            .map(|(_, bytes)| bytes.len() as u32)
            .sum(),
        ram_bytes: built.ram_bytes,
        slack_cycles: built.shortest_period_cycles.saturating_sub(built.worst_scan_cycles + built.poll_cycles),
        specials: built.specials.clone(),
        eeprom: eeprom_map(program),
        rungs: starts.iter().enumerate().map(rung).collect(),
        elements: elements.collect(),
        symbols: symbols.collect(),
        pins: job
            .pins
            .iter()
            .filter(|pin| !pin.analog)
            .map(|pin| PinMap {
                name: pin.name.clone(),
                pin: pin.pin.to_owned(),
                direction: if pin.output { "out" } else { "in" }.to_owned(),
            })
            .collect(),
        fuses: built.fuses.clone(),
    }
}

/// EEPROM cells of every PERSIST, in text order.
fn eeprom_map(program: &LadderProgram) -> Vec<EepromMap> {
    let cells = lower::eeprom_cells(program);
    let names = program.elements().filter_map(|ProgramElement { element, .. }| match element {
        Element::Persist { name } => Some(name.clone()),
        _ => None,
    });
    names.zip(cells).map(|(name, (addr, bytes))| EepromMap { name, addr, bytes }).collect()
}
