//! Selects the operations of the tables and of the elements that use a part of the chip, or refuses these
//! elements.

use std::collections::HashMap;

use ladder::format::{self, StringPiece};
use ladder::{
    BusOp, BusTransfer, CurvePoint, Element, LadderDialect, LadderOperand, PwmChoice, SerialTransfer,
    is_percent_resolution,
};

use crate::UnsupportedReason;
use crate::flat_program::{ElementOp, ValueSource};
use crate::flatten::FlatBuilder;
use crate::peripheral_state::{FormattedText, PiecewiseCurve, PwmChannel};

/// Settings on which all elements of a program must agree.
#[derive(Debug, Default)]
pub(crate) struct DeviceSettings {
    /// Reference selection of each analog input.
    references: HashMap<String, u32>,
}

/// Time of ten bits, one byte on the serial line, in microseconds times the baud rate.
const BYTE_BITS_US: u128 = 10_000_000;

/// Maximum time of writing one byte to the EEPROM, in microseconds.
const EEPROM_WRITE_US: u64 = 10_000;

/// Selects the operation of such an element; an error if it is unsupported.
pub(crate) fn peripheral_op(builder: &mut FlatBuilder<'_>, element: &Element) -> Result<ElementOp, UnsupportedReason> {
    Ok(match element {
        Element::ShiftRegister { name, stages } => {
            let stages = (0..*stages).map(|stage| builder.integer_index(&format!("{name}{stage}")));
            let stages = stages.collect::<Result<Vec<_>, _>>()?;
            let memory = builder.new_memory();
            ElementOp::Shift { stages: push_index(&mut builder.code.shift_stages, stages), memory }
        }
        Element::LookUpTable { dest, index, values, .. } => {
            let (dest, index) = (builder.integer_index(dest)?, builder.operand_source(index)?);
            let values = values.iter().map(|v| builder.checked_constant("a value of the table", *v));
            let values = values.collect::<Result<Vec<_>, _>>()?;
            ElementOp::LookUp { dest, index, table: push_index(&mut builder.code.tables, values) }
        }
        Element::PiecewiseLinear { dest, index, points, .. } => {
            let (dest, index) = (builder.integer_index(dest)?, builder.operand_source(index)?);
            let curve = check_curve(builder, dest, index, points)?;
            ElementOp::Curve { dest, index, curve: push_index(&mut builder.code.curves, curve) }
        }
        Element::ReadAdc { name, refs } => {
            check_reference(builder, name, refs.unwrap_or(0))?;
            let dest = builder.integer_index(name)?;
            let input = builder.code.adc_symbols.iter().position(|symbol| *symbol == dest);
            let input = input.and_then(|at| u32::try_from(at).ok());
            ElementOp::ReadAdc { dest, input: input.ok_or(UnsupportedReason::NotAnalogInput)? }
        }
        Element::SetPwm { duty, hertz, output } => {
            let output = pwm_output(builder, hertz, output.as_ref())?;
            ElementOp::SetPwm { duty: builder.operand_source(duty)?, output }
        }
        Element::UartRecvAvail => {
            check_serial(builder)?;
            ElementOp::Available
        }
        Element::UartSendReady => {
            check_serial(builder)?;
            ElementOp::Ready
        }
        Element::UartSend { name, rest } => {
            let src = builder.integer_index(name)?;
            let bytes = check_transfer(builder, src, rest.unwrap_or_default())?;
            match bytes {
                _ if rest.is_some_and(|rest| rest.wait != 0) => ElementOp::SendWait { src, bytes },
                1 => ElementOp::Send { src },
                bytes => ElementOp::SendBytes { src, bytes, transfer: new_transfer(builder) },
            }
        }
        Element::UartRecv { name, rest } => {
            let dest = builder.integer_index(name)?;
            match check_transfer(builder, dest, rest.unwrap_or_default())? {
                1 => ElementOp::Receive { dest },
                bytes if rest.is_some_and(|rest| rest.holds_scan()) => {
                    ElementOp::ReceiveAll { dest, bytes, transfer: new_transfer(builder) }
                }
                bytes => ElementOp::ReceiveBytes { dest, bytes, transfer: new_transfer(builder) },
            }
        }
        Element::FormattedString { var, text, quoted } => {
            check_serial(builder)?;
            let pieces = format::split_format_string(text, *quoted)?;
            let var = var.as_deref().map(|name| builder.integer_index(name)).transpose()?;
            if pieces.iter().any(|p| matches!(p, StringPiece::Digit { .. })) != var.is_some() {
                return Err(UnsupportedReason::TextVariableMismatch);
            }
            ElementOp::Text { text: push_index(&mut builder.code.texts, FormattedText { pieces, var }) }
        }
        Element::BusTransfer(transfer) => bus_op(builder, transfer)?,
        Element::Persist { name } => {
            let var = builder.integer_index(name)?;
            builder.code.scans_per_eeprom_write =
                u32::try_from(EEPROM_WRITE_US.div_ceil(builder.cycle_us()?)).unwrap_or(u32::MAX);
            let cell = builder.code.eeprom_cells;
            builder.code.eeprom_cells += u32::from(builder.integer_bytes(var));
            ElementOp::Persist { var, cell, memory: builder.new_memory() }
        }
        // The caller passes only the elements above.
        _ => return Err(UnsupportedReason::NoMeaning),
    })
}

/// Appends an item to a list and returns its index.
fn push_index<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    list.len() as u32 - 1
}

/// The operation of an element on a bus. The chip is the master, the highest bit goes first, SPI has mode 0
/// and 8 bits.
fn bus_op(builder: &mut FlatBuilder<'_>, transfer: &BusTransfer) -> Result<ElementOp, UnsupportedReason> {
    let BusTransfer { op, send, recv, mode, device, register, first, .. } = transfer;
    let number = |operand: &LadderOperand| match operand {
        LadderOperand::Const { value, .. } => u8::try_from(*value).ok(),
        LadderOperand::Var(_) => None,
    };
    let device = number(device).filter(|device| if op.is_i2c() { *device < 128 } else { *device == 0 });
    let is_known = op.is_i2c() || number(register) == Some(8);
    let (Some(device), true) = (device, is_known && mode == "Master" && first.starts_with("MSB")) else {
        return Err(UnsupportedReason::UnsupportedBus);
    };
    if *op == BusOp::I2cRead && recv.is_none() {
        return Err(UnsupportedReason::UnsupportedBus);
    }
    if *op == BusOp::SpiText {
        return Ok(ElementOp::SendText { text: push_index(&mut builder.code.bus_texts, transfer.text_bytes()) });
    }
    let send = send.as_ref().map_or(Ok(ValueSource::Const(0)), |send| builder.operand_source(send))?;
    let register = builder.operand_source(register)?;
    let recv = recv.as_ref().map(|name| builder.integer_index(name)).transpose()?;
    Ok(ElementOp::Transfer { op: *op, send, device, register, recv })
}

/// Checks the reference of a conversion, which is one for each input. It does not change the meaning: a
/// conversion gives 0 to 1023 of whatever the reference is.
fn check_reference(builder: &mut FlatBuilder<'_>, name: &str, refs: u32) -> Result<(), UnsupportedReason> {
    let most = if builder.program.dialect == LadderDialect::Ldmicro5 { 3 } else { 0 };
    let same = *builder.devices.references.entry(name.to_owned()).or_insert(refs) == refs;
    if refs <= most && same { Ok(()) } else { Err(UnsupportedReason::UnsupportedReference { refs }) }
}

/// Checks the points of a curve: the arithmetic has 16 bits, or 32 if an operand is wider, and each segment
/// must fit it (2.5).
fn check_curve(
    builder: &FlatBuilder<'_>,
    dest: u32,
    index: ValueSource,
    points: &[CurvePoint],
) -> Result<PiecewiseCurve, UnsupportedReason> {
    let coordinate = |value: i64| builder.checked_constant("a coordinate", value);
    let points = points.iter().map(|point| Ok((coordinate(point.x)?, coordinate(point.y)?)));
    let points = points.collect::<Result<Vec<_>, UnsupportedReason>>()?;
    let short = |value: i32| i16::try_from(value).is_ok();
    let short_index = match index {
        ValueSource::Var(var) => builder.integer_bytes(var) <= 2,
        ValueSource::Const(value) => short(value),
    };
    let narrow = short_index && builder.integer_bytes(dest) <= 2 && points.iter().all(|(x, y)| short(*x) && short(*y));
    let limit = if narrow { i64::from(i16::MAX) } else { i64::from(i32::MAX) };
    if points.len() < 2 {
        return Err(UnsupportedReason::TooFewPoints { points: points.len() });
    }
    for pair in points.windows(2) {
        let (dx, dy) = (i64::from(pair[1].0) - i64::from(pair[0].0), i64::from(pair[1].1) - i64::from(pair[0].1));
        if dx < 1 {
            return Err(UnsupportedReason::PointsNotAscending { before: pair[0].0, x: pair[1].0 });
        }
        if dx > limit || dy.checked_mul(dx).is_none_or(|product| product.abs() > limit) {
            return Err(UnsupportedReason::SegmentTooLarge { dx, dy, limit });
        }
    }
    Ok(PiecewiseCurve { points, cut: if narrow { 16 } else { 0 } })
}

/// Index of the output of a SET_PWM. All SET_PWM of an output have one frequency, and all of a program name
/// an output or none does.
fn pwm_output(
    builder: &mut FlatBuilder<'_>,
    hertz: &LadderOperand,
    choice: Option<&PwmChoice>,
) -> Result<u32, UnsupportedReason> {
    let hertz = match hertz {
        LadderOperand::Const { value, .. } => u32::try_from(*value).ok().filter(|hertz| *hertz > 0),
        LadderOperand::Var(_) => None,
    };
    let hertz = hertz.ok_or(UnsupportedReason::BadPwmFrequency)?;
    match choice {
        Some(_) if builder.program.dialect == LadderDialect::Ldmicro23 => {
            return Err(UnsupportedReason::NeedsDialect5 { feature: "the choice of the output".into() });
        }
        Some(choice) if !is_percent_resolution(&choice.resolution) => {
            return Err(UnsupportedReason::UnknownResolution { resolution: choice.resolution.clone() });
        }
        _ => {}
    }
    let name = choice.map(|choice| choice.name.clone());
    let outputs = &mut builder.code.pwm_outputs;
    if outputs.first().is_some_and(|first| first.name.is_some() != name.is_some()) {
        return Err(UnsupportedReason::ConflictingPwm);
    }
    if let Some(known) = outputs.iter().position(|output| output.name == name) {
        return if outputs[known].hertz == hertz { Ok(known as u32) } else { Err(UnsupportedReason::ConflictingPwm) };
    }
    Ok(push_index(outputs, PwmChannel { name, hertz }))
}

/// Index of the state of another UART_SEND or UART_RECV of several bytes.
fn new_transfer(builder: &mut FlatBuilder<'_>) -> u32 {
    builder.code.transfers += 1;
    builder.code.transfers - 1
}

/// The number of bytes that an element of the serial line transfers; fails if it waits in release 2.3, or
/// has too many for its symbol.
fn check_transfer(
    builder: &mut FlatBuilder<'_>,
    symbol: u32,
    SerialTransfer { bytes, wait }: SerialTransfer,
) -> Result<u8, UnsupportedReason> {
    check_serial(builder)?;
    let five = builder.program.dialect == LadderDialect::Ldmicro5;
    let waits = wait != 0 && !five;
    let most = if five { builder.integer_bytes(symbol) } else { 1 };
    match u8::try_from(bytes) {
        Ok(bytes) if !waits && (1..=most).contains(&bytes) => Ok(bytes),
        _ => Err(UnsupportedReason::UnsupportedSerialTransfer { bytes, wait, most }),
    }
}

/// Checks the serial line, which needs a rate in BAUD=.
fn check_serial(builder: &mut FlatBuilder<'_>) -> Result<(), UnsupportedReason> {
    let baud = builder.program.settings.baud.filter(|baud| *baud > 0);
    let baud = baud.ok_or(UnsupportedReason::NoBaudRate)?;
    let scans = BYTE_BITS_US.div_ceil(u128::from(baud) * u128::from(builder.cycle_us()?));
    builder.code.scans_per_byte = u32::try_from(scans).unwrap_or(u32::MAX);
    Ok(())
}
