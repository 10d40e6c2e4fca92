//! Random elements that use parts of the chip: buses, pulse outputs, encoders.

use ladder::{BusOp, BusTransfer, Element};
use proptest::prelude::*;
use proptest::sample::select;

use crate::common::model::constant;
use crate::random::{COILS, integer, operand};

/// SPI, SPI_WR, I2C_RD and I2C_WR.
pub(crate) fn bus_element() -> impl Strategy<Value = Element> {
    let op = select(vec![BusOp::Spi, BusOp::SpiText, BusOp::I2cRead, BusOp::I2cWrite]);
    (op, operand(), integer(), any::<bool>(), 0..128i64, operand()).prop_map(
        |(op, send, recv, keep, device, register)| {
            let sends = matches!(op, BusOp::Spi | BusOp::I2cWrite);
            let receives = op == BusOp::I2cRead || op == BusOp::Spi && keep;
            Element::BusTransfer(Box::new(BusTransfer {
                op,
                name: "b".to_owned(),
                send: sends.then_some(send),
                text: if op == BusOp::SpiText { "aZ09".to_owned() } else { String::new() },
                recv: receives.then_some(recv),
                mode: "Master".to_owned(),
                device: constant(if op.is_i2c() { device } else { 0 }),
                register: if op.is_i2c() { register } else { constant(8) },
                first: "MSB_FIRST".to_owned(),
                hertz: 0,
            }))
        },
    )
}

/// PULSER, NPULSE, STEPPER and QUAD_ENCOD.
pub(crate) fn pulse_element() -> impl Strategy<Value = Element> {
    let few = || prop_oneof![4 => (-1..4i64).prop_map(constant), 1 => operand()];
    let pulser = (few(), few(), few(), few(), select(COILS))
        .prop_map(|(high, low, accel, count, coil)| Element::Pulser { high, low, accel, count, coil: coil.to_owned() });
    let hertz = select(vec![1, 3, 10, 24, 50, 125]).prop_map(constant);
    let npulse = (few(), hertz, select(COILS)).prop_map(|(count, hertz, coil)| Element::Npulse {
        count,
        hertz,
        coil: coil.to_owned(),
    });
    let stepper = (select(vec!["q", "r"]), few(), few()).prop_map(|(name, max, period)| Element::Stepper {
        name: name.to_owned(),
        max,
        period,
        size: 0,
        graph: 0,
        coil: "Ya".to_owned(),
    });
    let name = |names: &'static [&'static str]| select(names).prop_map(str::to_owned);
    let zero = prop::option::of(name(&["Xa", "Xb"]));
    let kinds = (select(vec!['/', '\\', '-', 'o']), select(vec![0u32, 1, 2, 5, 127, 128]));
    let encoder =
        (integer(), name(&["Xa", "Xb"]), name(&["Xa", "Xb"]), zero, prop::option::of(name(&["Ra", "Ya"])), kinds)
            .prop_map(|(counter, a, b, zero, dir, (zero_kind, turn))| Element::QuadEncod {
                counter,
                interrupt: 0,
                inputs: [a, b],
                zero,
                dir,
                zero_kind,
                turn,
            });
    prop_oneof![2 => pulser, 2 => npulse, 1 => Just(Element::NpulseOff), 2 => stepper, 2 => encoder]
}
