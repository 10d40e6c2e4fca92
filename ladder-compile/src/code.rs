//! Writes instructions with labels and encodes them, for every family; each jump gets the shortest form that
//! reaches.

use std::fmt::Debug;

use crate::CodegenError;
use crate::jump_roles::JumpRole;
use crate::target::CodeMark;

/// Highest level of a jump form.
pub const MAX_FORM_LEVEL: u8 = 7;

/// Properties of a target that the code writer needs.
pub trait TargetArch {
    /// An instruction of the target's instruction table.
    type Opcode: Copy + PartialEq + Debug;
    /// A control transfer with several forms of different reach: a conditional jump, a jump, a call.
    type JumpForm: Copy + Debug;

    /// Length of an instruction in words.
    fn instruction_words(&self, kind: Self::Opcode) -> u32;

    /// Encodes an instruction at word address `at`.
    ///
    /// # Errors
    /// An operand does not fit.
    fn encode(&self, kind: Self::Opcode, operands: &[i32], at: u32) -> Result<Vec<u16>, CodegenError>;

    /// Returns form `level` of `jump` from word `at` to word `to`; `None` if that form does not reach.
    ///
    /// Levels are tried from 0 upwards, so the shortest forms come first; [`MAX_FORM_LEVEL`] reaches every
    /// address. The length of a form that reaches depends only on `jump` and `level`, so code only grows
    /// while levels rise.
    fn jump_form(
        &self,
        jump: Self::JumpForm,
        level: u8,
        at: u32,
        to: u32,
    ) -> Option<Vec<FormInstruction<Self::Opcode>>>;

    /// Control flow and cycle counts of an instruction.
    fn flow_and_cycles(&self, kind: Self::Opcode) -> (ControlFlow, CycleCounts);

    /// Disassembles the first instruction of `words` with the chip's disassembler.
    fn disassemble(&self, words: &[u16], at: u32) -> String;
}

/// One instruction of a jump form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FormInstruction<K> {
    /// The instruction.
    pub kind: K,
    /// Operands in the order of the instruction's row.
    pub operands: Vec<i32>,
    /// Target of a branch, jump or call, as a word address.
    pub target: Option<u32>,
}

/// How an instruction affects control flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlFlow {
    /// Continues with the next instruction.
    Sequential,
    /// Jumps to its target.
    Jump,
    /// Jumps to its target or continues.
    Branch,
    /// May skip the next instruction.
    Skip,
    /// Calls its target and returns.
    Call,
    /// Returns from a subroutine.
    Return,
}

/// Machine cycles of an instruction: not taken, taken (or a skip of one word), a skip of two words.
pub type CycleCounts = [u32; 3];

/// A position in the code whose address is determined when the code is finished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CodeLabel(usize);

/// An item of the code being written.
#[derive(Debug, Clone)]
enum CodeItem<K, J> {
    /// An instruction, its operands, and extra cycles beyond those of its row.
    Op(K, Vec<i32>, u32),
    /// An instruction with one operand that is a byte of a label's address plus a constant: the operand's
    /// position, the label, the number of the byte, and the constant.
    LabelByte(K, Vec<i32>, usize, CodeLabel, u8, i32),
    /// An instruction with one operand that is computed from a label's address: the operand's position, the
    /// label, and the function.
    LabelValue(K, Vec<i32>, usize, CodeLabel, fn(u32) -> i32),
    /// A jump, its label, its role, and the first level to try.
    Jump(J, CodeLabel, JumpRole<CodeLabel>, u8),
    /// Data words.
    Data(Vec<u16>),
    /// The position of a label.
    Label(CodeLabel),
    /// A mark for map and listing.
    Mark(CodeMark),
}

/// Code under construction: instructions, jumps, labels, data and marks.
#[derive(Debug)]
pub struct CodeWriter<A: TargetArch> {
    /// The target.
    pub arch: A,
    items: Vec<CodeItem<A::Opcode, A::JumpForm>>,
    /// Number of labels created.
    labels: usize,
}

/// An instruction of the finished code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodeInstruction {
    /// Word address.
    pub addr: u32,
    /// Length in words.
    pub len: u32,
    /// Target of a branch, jump or call, as a word address.
    pub target: Option<u32>,
    /// Effect on control flow.
    pub flow: ControlFlow,
    /// Machine cycles.
    pub cycles: CycleCounts,
    /// Role of a jump; `Repeats(1)` for other instructions.
    pub role: JumpRole<u32>,
    /// Text from the disassembler.
    pub text: String,
}

/// Encoded code with its instructions, marks and labels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FinishedCode {
    /// Program memory from word 0.
    pub words: Vec<u16>,
    /// Instructions in order of address; words between them are data.
    pub instructions: Vec<CodeInstruction>,
    /// Marks with their word addresses, in order of address.
    pub marks: Vec<(CodeMark, u32)>,
    /// Word addresses of the labels.
    labels: Vec<u32>,
}

impl CodeInstruction {
    /// Maximum number of times in a row that a jump back is taken; 1 for other instructions.
    #[must_use]
    pub const fn max_repeats(&self) -> u32 {
        if let JumpRole::Repeats(times) = self.role { times } else { 1 }
    }
}

impl<A: TargetArch> CodeWriter<A> {
    /// Creates an empty writer.
    pub fn new(arch: A) -> Self {
        CodeWriter { arch, items: Vec::new(), labels: 0 }
    }

    /// Creates a label, to be placed by [`CodeWriter::place_label`].
    pub fn new_label(&mut self) -> CodeLabel {
        self.labels += 1;
        CodeLabel(self.labels - 1)
    }

    /// Places the label at the current position.
    pub fn place_label(&mut self, label: CodeLabel) {
        self.items.push(CodeItem::Label(label));
    }

    /// Adds an instruction without a target; the operands have the order of its row.
    pub fn op(&mut self, kind: A::Opcode, operands: &[i32]) {
        self.items.push(CodeItem::Op(kind, operands.to_vec(), 0));
    }

    /// Adds an instruction that takes `extra` machine cycles more than its row states, such as a call into a
    /// table of returns.
    pub fn op_with_extra_cycles(&mut self, kind: A::Opcode, operands: &[i32], extra: u32) {
        self.items.push(CodeItem::Op(kind, operands.to_vec(), extra));
    }

    /// Adds an instruction whose operand `at` is `(address of label + plus) >> 8 * byte & 0xFF`, with the
    /// address in words.
    pub fn op_with_label_byte(
        &mut self,
        kind: A::Opcode,
        operands: &[i32],
        at: usize,
        label: CodeLabel,
        byte: u8,
        plus: i32,
    ) {
        self.items.push(CodeItem::LabelByte(kind, operands.to_vec(), at, label, byte, plus));
    }

    /// Adds an instruction whose operand `at` is `value` of the label's address in words.
    pub fn op_with_label_value(
        &mut self,
        kind: A::Opcode,
        operands: &[i32],
        at: usize,
        label: CodeLabel,
        value: fn(u32) -> i32,
    ) {
        self.items.push(CodeItem::LabelValue(kind, operands.to_vec(), at, label, value));
    }

    /// Adds a jump forward, or a call.
    pub fn jump(&mut self, jump: A::JumpForm, to: CodeLabel) {
        self.jump_with_role(jump, to, JumpRole::Repeats(1), 0);
    }

    /// Adds a jump back that is taken at most `times` times in a row.
    pub fn jump_back(&mut self, jump: A::JumpForm, to: CodeLabel, times: u32) {
        self.jump_with_role(jump, to, JumpRole::Repeats(times), 0);
    }

    /// Adds a jump with a role, and a minimum level of its form for back ends that know their addresses.
    pub fn jump_with_role(&mut self, jump: A::JumpForm, to: CodeLabel, role: JumpRole<CodeLabel>, level: u8) {
        self.items.push(CodeItem::Jump(jump, to, role, level));
    }

    /// Adds data words.
    pub fn data(&mut self, words: &[u16]) {
        self.items.push(CodeItem::Data(words.to_vec()));
    }

    /// Places a mark at the current position.
    pub fn mark(&mut self, mark: CodeMark) {
        self.items.push(CodeItem::Mark(mark));
    }

    /// Chooses the forms of all jumps and encodes the code.
    ///
    /// The code may exceed every chip's memory; the caller must check its length.
    ///
    /// # Errors
    /// An operand does not fit its instruction, which is an error of the back end.
    pub fn finish(&self) -> Result<FinishedCode, CodegenError> {
        let (levels, labels) = self.relax();
        let mut code = FinishedCode { words: Vec::new(), instructions: Vec::new(), marks: Vec::new(), labels };
        for (item, &level) in self.items.iter().zip(&levels) {
            match item {
                CodeItem::Label(_) => {}
                CodeItem::Mark(mark) => code.marks.push((*mark, code.words.len() as u32)),
                CodeItem::Data(words) => code.words.extend_from_slice(words),
                CodeItem::Op(kind, operands, extra) => {
                    self.push(&mut code, *kind, operands, (None, NO_ROLE, *extra))?
                }
                CodeItem::LabelByte(kind, operands, at, label, byte, plus) => {
                    let mut operands = operands.clone();
                    let value = code.label_address(*label) as i32 + plus;
                    if let Some(operand) = operands.get_mut(*at) {
                        *operand = value >> (8 * byte) & 0xFF;
                    }
                    self.push(&mut code, *kind, &operands, (None, NO_ROLE, 0))?;
                }
                CodeItem::LabelValue(kind, operands, at, label, value) => {
                    let mut operands = operands.clone();
                    if let Some(operand) = operands.get_mut(*at) {
                        *operand = value(code.label_address(*label));
                    }
                    self.push(&mut code, *kind, &operands, (None, NO_ROLE, 0))?;
                }
                CodeItem::Jump(jump, to, role, _) => {
                    let role = role.map(|label| code.label_address(label));
                    let (at, to) = (code.words.len() as u32, code.label_address(*to));
                    let steps = self.arch.jump_form(*jump, level, at, to).ok_or(CodegenError::JumpOutOfReach)?;
                    for step in steps {
                        let role = match role {
                            JumpRole::Repeats(_) if step.target.is_none_or(|target| target > at) => NO_ROLE,
                            role if step.target == Some(to) => role,
                            _ => NO_ROLE,
                        };
                        self.push(&mut code, step.kind, &step.operands, (step.target, role, 0))?;
                    }
                }
            }
        }
        Ok(code)
    }

    fn push(
        &self,
        code: &mut FinishedCode,
        kind: A::Opcode,
        operands: &[i32],
        (target, role, extra): (Option<u32>, JumpRole<u32>, u32),
    ) -> Result<(), CodegenError> {
        let addr = code.words.len() as u32;
        let words = self.arch.encode(kind, operands, addr)?;
        let (flow, cycles) = self.arch.flow_and_cycles(kind);
        let text = self.arch.disassemble(&words, addr);
        let cycles = cycles.map(|n| n + extra);
        code.instructions.push(CodeInstruction { addr, len: words.len() as u32, target, flow, cycles, role, text });
        code.words.extend_from_slice(&words);
        Ok(())
    }

    /// Chooses the jump levels and computes the word addresses of the labels (jump relaxation).
    ///
    /// Levels start at their minimum and only rise, up to [`MAX_FORM_LEVEL`], so the loop terminates.
    fn relax(&self) -> (Vec<u8>, Vec<u32>) {
        let first = |item: &CodeItem<_, _>| if let CodeItem::Jump(.., level) = item { *level } else { 0 };
        let mut levels: Vec<u8> = self.items.iter().map(first).collect();
        let mut sizes: Vec<u32> = self.items.iter().map(|item| self.initial_words(item)).collect();
        loop {
            let mut places = vec![0; self.labels];
            let mut pc = 0;
            for (item, size) in self.items.iter().zip(&sizes) {
                if let CodeItem::Label(label) = item
                    && let Some(place) = places.get_mut(label.0)
                {
                    *place = pc;
                }
                pc += size;
            }
            let (mut pc, mut risen) = (0, false);
            for ((item, size), level) in self.items.iter().zip(sizes.iter_mut()).zip(levels.iter_mut()) {
                let at = pc;
                pc += *size;
                let CodeItem::Jump(jump, to, ..) = item else { continue };
                let to = places.get(to.0).copied().unwrap_or(0);
                let Some((reaches, steps)) = self.shortest_reaching_form(*jump, *level, at, to) else { continue };
                if reaches > *level {
                    *level = reaches;
                    *size = self.form_words(&steps);
                    risen = true;
                }
            }
            if !risen {
                return (levels, places);
            }
        }
    }

    /// The lowest level from `level` on whose form reaches, with the form.
    fn shortest_reaching_form(
        &self,
        jump: A::JumpForm,
        level: u8,
        at: u32,
        to: u32,
    ) -> Option<(u8, Vec<FormInstruction<A::Opcode>>)> {
        (level..=MAX_FORM_LEVEL).find_map(|level| self.arch.jump_form(jump, level, at, to).map(|steps| (level, steps)))
    }

    /// Length of a form in words.
    fn form_words(&self, steps: &[FormInstruction<A::Opcode>]) -> u32 {
        steps.iter().map(|step| self.arch.instruction_words(step.kind)).sum()
    }

    /// Length of an item in words at the start of relaxation.
    fn initial_words(&self, item: &CodeItem<A::Opcode, A::JumpForm>) -> u32 {
        match item {
            CodeItem::Op(kind, ..) | CodeItem::LabelByte(kind, ..) | CodeItem::LabelValue(kind, ..) => {
                self.arch.instruction_words(*kind)
            }
            CodeItem::Data(words) => words.len() as u32,
            CodeItem::Jump(jump, _, _, level) => {
                self.shortest_reaching_form(*jump, *level, 0, 0).map_or(0, |(_, steps)| self.form_words(&steps))
            }
            CodeItem::Label(_) | CodeItem::Mark(_) => 0,
        }
    }
}

/// Role of an item that is not a jump back.
const NO_ROLE: JumpRole<u32> = JumpRole::Repeats(1);

impl FinishedCode {
    /// Word address of the first mark equal to `mark`.
    #[must_use]
    pub fn mark_address(&self, mark: CodeMark) -> Option<u32> {
        self.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at)
    }

    /// Word address of a label.
    #[must_use]
    pub fn label_address(&self, label: CodeLabel) -> u32 {
        self.labels.get(label.0).copied().unwrap_or(0)
    }
}
