//! Adapts random programs to their header: the widths of integers, the pins, and what release 2.3 supports.

use ladder::{CounterKind, Element, LadderOperand, LadderProgram, RungNode, SerialTransfer, TimerKind};

use crate::common::model::constant;
use crate::random::CYCLE;

/// Lets the elements of the serial line transfer no more bytes than their integers have.
pub(crate) fn fit_transfers(series: &mut [RungNode], widths: &std::collections::HashMap<String, u32>) {
    for node in series {
        match node {
            RungNode::Parallel(branches, _) => branches.iter_mut().for_each(|branch| fit_transfers(branch, widths)),
            RungNode::Leaf(
                Element::UartSend { name, rest: Some(SerialTransfer { bytes, .. }) }
                | Element::UartRecv { name, rest: Some(SerialTransfer { bytes, .. }) },
                _,
            ) => *bytes = widths[name].min(*bytes),
            RungNode::Leaf(..) => {}
        }
    }
}

/// Puts inputs and outputs on ports whose registers the elements name.
pub(crate) fn name_pins(program: &mut LadderProgram, avr: bool) {
    let (micro, pins) = match avr {
        true => ("Atmel AVR ATmega328 28-PDIP", [14, 24, 16]),
        false => ("Microchip PIC16F877 40-PDIP", [33, 16, 40]),
    };
    program.settings.micro = Some(micro.to_owned());
    let entry = |(name, pin): (&str, u32)| ladder::IoEntry {
        name: name.to_owned(),
        pin,
        modbus: None,
        pos: Default::default(),
    };
    program.io = ["Xa", "Xb", "Ya"].into_iter().zip(pins).map(entry).collect();
}

/// Removes what only ldmicro-5 supports.
pub(crate) fn only_release_23(series: &mut [RungNode]) {
    for node in series {
        let element = match node {
            RungNode::Parallel(branches, _) => {
                branches.iter_mut().for_each(|branch| only_release_23(branch));
                continue;
            }
            RungNode::Leaf(element, _) => element,
        };
        match element {
            Element::Counter { kind, max, init, input, .. } => {
                (*init, *input) = (None, None);
                if let LadderOperand::Var(_) = max {
                    *max = constant(2);
                }
                if *kind == CounterKind::Ctr {
                    *kind = CounterKind::Ctc;
                }
            }
            Element::Timer { kind, delay, adjust, .. } => {
                *adjust = None;
                if !matches!(delay, LadderOperand::Const { value, .. } if *value >= 2 * CYCLE) {
                    *delay = constant(2 * CYCLE);
                }
                if !matches!(kind, TimerKind::Ton | TimerKind::Tof | TimerKind::Rto) {
                    *kind = TimerKind::Ton;
                }
            }
            Element::Coil { ttrigger, .. } => *ttrigger = None,
            Element::UartSend { rest, .. } | Element::UartRecv { rest, .. } => *rest = None,
            Element::SetPwm { output, .. } => *output = None,
            Element::Odr | Element::Odf | Element::Osl | Element::Osc => *element = Element::Short,
            element if element.facts().needs_ldmicro5 => *element = Element::Short,
            _ => {}
        }
    }
}
