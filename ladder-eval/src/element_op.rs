//! The operations of elements in the flat form.

use ladder::{BusOp, CompareOp, ElementId, MathOp, SegmentDisplay, ShiftOp, UnaryOp};

use crate::arithmetic::{CountInput, CountMode};
use crate::flow_steps::FlowStep;

/// Operation of an element. `bit`, `var`, `dest` and `src` index the values, `memory` and `first` the memory
/// bits, all other numbers the lists of the program.
#[derive(Debug, Clone, Copy)]
#[rustfmt::skip]
pub(crate) enum ElementOp {
    Flow(FlowStep),
    /// Number of a line of Instruction List.
    Line(u32),
    Segments { display: SegmentDisplay, dest: u32, src: ValueSource, inverted: bool },
    Random   { dest: u32, seed: u32 },
    Seed     { seed: u32, src: ValueSource },
    Short,
    Open,
    Contact  { bit: u32, negated: bool },
    Coil     { bit: u32, negated: bool },
    SetCoil  { bit: u32 },
    ClearCoil{ bit: u32 },
    MasterRelay,
    Osr      { memory: u32 },
    Osf      { memory: u32 },
    Odr      { memory: u32 },
    Odf      { memory: u32, seen: u32 },
    Osc      { memory: u32 },
    Toggle   { bit: u32, memory: u32 },
    Ton      { var: u32, preset: ValueSource },
    Tof      { var: u32, preset: ValueSource, first: Option<u32> },
    Rto      { var: u32, preset: ValueSource },
    Rtl      { var: u32, preset: ValueSource },
    Tcy      { var: u32, preset: ValueSource, memory: u32 },
    Thi      { var: u32, preset: ValueSource, memory: u32 },
    Tlo      { var: u32, preset: ValueSource, memory: u32, seen: u32 },
    Count    { kind: CountMode, input: CountInput, var: u32, max: ValueSource, restart: ValueSource, memory: u32 },
    Move     { dest: u32, src: ValueSource },
    Math     { op: MathOp, dest: u32, a: ValueSource, b: ValueSource },
    Unary    { op: UnaryOp, dest: u32, src: ValueSource, bits: u32 },
    ShiftBits{ op: ShiftOp, dest: u32, src: ValueSource, bits: u32, count: ValueSource },
    WriteBit { var: u32, bit: ValueSource, value: bool },
    TestBit  { var: u32, bit: ValueSource, value: bool },
    Bus      { dest: u32, src: ValueSource, targets: [u8; 8] },
    Compare  { op: CompareOp, a: ValueSource, b: ValueSource },
    Shift    { stages: u32, memory: u32 },
    LookUp   { dest: u32, index: ValueSource, table: u32 },
    Curve    { dest: u32, index: ValueSource, curve: u32 },
    ReadAdc  { dest: u32, input: u32 },
    SetPwm   { duty: ValueSource, output: u32 },
    Send     { src: u32 },
    SendWait { src: u32, bytes: u8 },
    Receive  { dest: u32 },
    SendBytes    { src: u32, bytes: u8, transfer: u32 },
    ReceiveBytes { dest: u32, bytes: u8, transfer: u32 },
    ReceiveAll   { dest: u32, bytes: u8, transfer: u32 },
    Text     { text: u32 },
    Persist  { var: u32, cell: u32, memory: u32 },
    Transfer { op: BusOp, send: ValueSource, device: u8, register: ValueSource, recv: Option<u32> },
    SendText { text: u32 },
    Available,
    Ready,
    Pulser   { pulser: u32 },
    Npulse   { npulse: u32 },
    NpulseOff,
    Stepper  { stepper: u32, each: bool },
    Encoder  { encoder: u32 },
}

/// Source of an operand: the index of a variable, or a constant.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ValueSource {
    Var(u32),
    Const(i32),
}

/// One step of the flat form. Parallel groups need no jumps, because every branch of a group runs in every
/// scan (2.2).
#[derive(Debug, Clone, Copy)]
pub(crate) enum FlatStep {
    /// Start of a rung: the rung bit becomes the master relay.
    Rung,
    /// Start of a parallel group at this nesting depth: saves the rung bit for its branches.
    Split(usize),
    /// Start of the next branch: ORs the output of the previous branch into the group and restores the saved
    /// rung bit.
    Branch(usize),
    /// End of the group: the rung bit becomes the OR of all branches.
    Join(usize),
    /// The first time: an integer gets the value of another, and the memory is set.
    LoadOnce { var: u32, from: u32, memory: u32 },
    /// An element.
    Do(ElementId, ElementOp),
}
