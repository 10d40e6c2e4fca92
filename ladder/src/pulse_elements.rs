//! Readers and texts of PULSER, NPULSE, STEPPER and QUAD_ENCOD.

use crate::codes;
use crate::element_reader::{read_bit_name, read_input_kind, read_operand, read_operand_in_range};
use crate::lexer::LdToken;
use crate::model::{Element, LadderOperand};
use crate::reader::LdReader;
use crate::write::operand_text;

/// Reads one of these elements; its number of arguments is right.
pub(crate) fn read_pulse_element(r: &mut LdReader<'_>, keyword: &'static str, args: &[LdToken<'_>]) -> Option<Element> {
    match *args {
        [high, low, accel, count, coil] => {
            let [high, low, accel, count] = [high, low, accel, count].map(|t| read_operand(r, keyword, t));
            let coil = read_coil_name(r, keyword, coil);
            Some(Element::Pulser { high: high?, low: low?, accel: accel?, count: count?, coil: coil? })
        }
        [count, hertz, coil] => {
            let count = read_operand(r, keyword, count);
            let hertz = read_operand_in_range(r, keyword, hertz, "the frequency in Hz", 1, 100_000_000);
            let coil = read_coil_name(r, keyword, coil);
            Some(Element::Npulse { count: count?, hertz: hertz?, coil: coil? })
        }
        [name, max, period, size, graph, coil] => {
            let name = r.read_name(name);
            let (max, period) = (read_operand(r, keyword, max), read_operand(r, keyword, period));
            let (size, graph) = (r.read_u32(size, "the size", 0, 1024), r.read_u32(graph, "the graph", 0, 255));
            let coil = read_bit_name(r, coil, &['Y'], codes::COIL_KIND, keyword, "name an output");
            Some(Element::Stepper { name: name?, max: max?, period: period?, size: size?, graph: graph?, coil: coil? })
        }
        [counter, interrupt, a, b, zero, dir, kind, turn] => {
            let counter = r.read_integer_name(keyword, counter);
            let interrupt = r.read_u32(interrupt, "the interrupt", 0, 255);
            let input =
                |r: &mut LdReader<'_>, t| read_bit_name(r, t, &['X'], codes::CONTACT_KIND, keyword, "name an input");
            let (a, b) = (input(r, a), input(r, b));
            let zero = if zero.text == "(none)" { Some(None) } else { input(r, zero).map(Some) };
            let dir = if dir.text == "(none)" { Some(None) } else { read_coil_name(r, keyword, dir).map(Some) };
            let (zero_kind, turn) = (read_input_kind(r, kind), r.read_u32(turn, "the steps of a turn", 0, 32_767));
            Some(Element::QuadEncod {
                counter: counter?,
                interrupt: interrupt?,
                inputs: [a?, b?],
                zero: zero?,
                dir: dir?,
                zero_kind: zero_kind?,
                turn: turn?,
            })
        }
        _ => None,
    }
}

fn read_coil_name(r: &mut LdReader<'_>, keyword: &'static str, token: LdToken<'_>) -> Option<String> {
    read_bit_name(r, token, &['Y', 'R'], codes::COIL_KIND, keyword, "name an output or a relay")
}

/// Text of one of these elements as in a file; empty for any other.
pub(crate) fn pulse_element_text(element: &Element) -> String {
    let text = |operands: &[&LadderOperand]| operands.iter().map(|o| operand_text(o)).collect::<Vec<_>>().join(" ");
    match element {
        Element::Pulser { high, low, accel, count, coil } => {
            format!("PULSER {} {coil}", text(&[high, low, accel, count]))
        }
        Element::Npulse { count, hertz, coil } => format!("NPULSE {} {coil}", text(&[count, hertz])),
        Element::Stepper { name, max, period, size, graph, coil } => {
            format!("STEPPER {name} {} {size} {graph} {coil}", text(&[max, period]))
        }
        Element::QuadEncod { counter, interrupt, inputs: [a, b], zero, dir, zero_kind, turn } => {
            let name = |name: &Option<String>| name.clone().unwrap_or_else(|| "(none)".to_owned());
            format!("QUAD_ENCOD {counter} {interrupt} {a} {b} {} {} {zero_kind} {turn}", name(zero), name(dir))
        }
        // The caller passes only the elements above.
        _ => String::new(),
    }
}

/// Names of the counters of a STEPPER: the steps that are left, and the scans that are left of one.
#[must_use]
pub fn stepper_counters(name: &str) -> [String; 2] {
    [format!("C{name}Dec"), format!("C{name}P")]
}
