//! Instructions with labels to words, for every family: jumps are as short as they can be and as long as they must be.

use std::fmt::Debug;

use crate::target::Mark;

/// The highest level of a form.
pub const HIGHEST: u8 = 7;

/// What differs from family to family.
pub trait Arch {
    /// An instruction of the chip's table.
    type Kind: Copy + PartialEq + Debug;
    /// A transfer of control that has several forms, by its reach: a conditional jump, a jump, a call.
    type Jump: Copy + Debug;

    /// Length of an instruction in words.
    fn len(&self, kind: Self::Kind) -> u32;

    /// The words of an instruction that stands at word `at`.
    ///
    /// # Errors
    /// An operand that does not fit.
    fn encode(&self, kind: Self::Kind, operands: &[i32], at: u32) -> Result<Vec<u16>, String>;

    /// Form `level` of `jump` from word `at` to word `to`; nothing where that form does not reach. Levels are tried from 0
    /// upwards, so the shortest come first; [`HIGHEST`] reaches everything. A form that reaches has a length that depends on
    /// `jump` and `level` alone, so code only ever grows while levels rise.
    fn form(&self, jump: Self::Jump, level: u8, at: u32, to: u32) -> Option<Vec<Step<Self::Kind>>>;

    /// What an instruction does to the course of the program, and its cycles.
    fn flow(&self, kind: Self::Kind) -> (Flow, Cycles);

    /// The instruction at the front of `words` as the chip's disassembler prints it.
    fn text(&self, words: &[u16], at: u32) -> String;
}

/// One instruction of a form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step<K> {
    /// Which one.
    pub kind: K,
    /// Its operands in the order of the table's row.
    pub operands: Vec<i32>,
    /// Where it goes, a word address.
    pub target: Option<u32>,
}

/// What an instruction does to the course of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// The next one follows.
    Next,
    /// Goes to its target.
    Jump,
    /// Goes to its target or on.
    Branch,
    /// May leave out the next instruction.
    Skip,
    /// Calls its target.
    Call,
    /// Ends a subroutine.
    Return,
}

/// Machine cycles of an instruction: going on, taken (or a skip of one word), a skip of two words.
pub type Cycles = [u32; 3];

/// A place in the code, given a number before its address is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label(usize);

#[derive(Debug, Clone)]
enum Item<K, J> {
    /// An instruction, and cycles that it costs beyond those of its row.
    Op(K, Vec<i32>, u32),
    /// An instruction one of whose operands is the byte `shift` of a label's address plus a constant.
    Refer(K, Vec<i32>, usize, Label, u8, i32),
    /// An instruction one of whose operands is computed from a label's address.
    ReferBy(K, Vec<i32>, usize, Label, fn(u32) -> i32),
    /// A jump, taken back at most so many times in a row (1 for all that go forward), and the first level that is tried.
    Jump(J, Label, u32, u8),
    Data(Vec<u16>),
    Label(Label),
    Mark(Mark),
}

/// Code being written.
#[derive(Debug)]
pub struct Asm<A: Arch> {
    /// The family.
    pub arch: A,
    items: Vec<Item<A::Kind, A::Jump>>,
    labels: usize,
}

/// One instruction of the finished code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Insn {
    /// Word address.
    pub addr: u32,
    /// Length in words.
    pub len: u32,
    /// Where a branch, jump or call goes, a word address.
    pub target: Option<u32>,
    /// What it does.
    pub flow: Flow,
    /// Its cycles.
    pub cycles: Cycles,
    /// How often a jump back is taken at most in a row; 1 elsewhere.
    pub times: u32,
    /// As the disassembler prints it.
    pub text: String,
}

/// Finished code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Code {
    /// Program memory from word 0.
    pub words: Vec<u16>,
    /// Its instructions in order of address; what lies between them is data.
    pub insns: Vec<Insn>,
    /// The marks with their word addresses, in order of address.
    pub marks: Vec<(Mark, u32)>,
    /// Word addresses of the labels.
    labels: Vec<u32>,
}

impl<A: Arch> Asm<A> {
    /// No code yet.
    pub fn new(arch: A) -> Self {
        Asm { arch, items: Vec::new(), labels: 0 }
    }

    /// A new label, placed later by [`Asm::place`].
    pub fn label(&mut self) -> Label {
        self.labels += 1;
        Label(self.labels - 1)
    }

    /// The label stands here.
    pub fn place(&mut self, label: Label) {
        self.items.push(Item::Label(label));
    }

    /// An instruction without a target; operands in the order of the table's row.
    pub fn op(&mut self, kind: A::Kind, operands: &[i32]) {
        self.items.push(Item::Op(kind, operands.to_vec(), 0));
    }

    /// An instruction that costs more than its row says, such as a call into a table of returns: `extra` machine cycles.
    pub fn costly(&mut self, kind: A::Kind, operands: &[i32], extra: u32) {
        self.items.push(Item::Op(kind, operands.to_vec(), extra));
    }

    /// An instruction whose operand `at` is `(address of label + plus) >> 8 * byte & 0xFF`, the address in words.
    pub fn refer(&mut self, kind: A::Kind, operands: &[i32], at: usize, label: Label, byte: u8, plus: i32) {
        self.items.push(Item::Refer(kind, operands.to_vec(), at, label, byte, plus));
    }

    /// An instruction whose operand `at` is what `value` makes of the label's address in words.
    pub fn refer_by(&mut self, kind: A::Kind, operands: &[i32], at: usize, label: Label, value: fn(u32) -> i32) {
        self.items.push(Item::ReferBy(kind, operands.to_vec(), at, label, value));
    }

    /// A jump forward, or a call.
    pub fn jump(&mut self, jump: A::Jump, to: Label) {
        self.jump_from(jump, to, 1, 0);
    }

    /// A jump back that is taken at most `times` times in a row.
    pub fn repeat(&mut self, jump: A::Jump, to: Label, times: u32) {
        self.jump_from(jump, to, times, 0);
    }

    /// A jump whose form has at least a level, for back ends that know their addresses. It is taken back at most `times`
    /// times in a row, 1 where it goes forward.
    pub fn jump_from(&mut self, jump: A::Jump, to: Label, times: u32, level: u8) {
        self.items.push(Item::Jump(jump, to, times, level));
    }

    /// Words that are no instructions.
    pub fn data(&mut self, words: &[u16]) {
        self.items.push(Item::Data(words.to_vec()));
    }

    /// A mark stands here.
    pub fn mark(&mut self, mark: Mark) {
        self.items.push(Item::Mark(mark));
    }

    /// Chooses the forms of the jumps and encodes. The code may be longer than any chip's memory; the caller looks.
    ///
    /// # Errors
    /// An operand does not fit its instruction: a fault of the back end.
    pub fn finish(&self) -> Result<Code, String> {
        let (levels, labels) = self.relax();
        let mut code = Code { words: Vec::new(), insns: Vec::new(), marks: Vec::new(), labels };
        for (item, &level) in self.items.iter().zip(&levels) {
            match item {
                Item::Label(_) => {}
                Item::Mark(mark) => code.marks.push((*mark, code.words.len() as u32)),
                Item::Data(words) => code.words.extend_from_slice(words),
                Item::Op(kind, operands, extra) => self.push(&mut code, *kind, operands, (None, 1, *extra))?,
                Item::Refer(kind, operands, at, label, byte, plus) => {
                    let mut operands = operands.clone();
                    let value = code.at_label(*label) as i32 + plus;
                    if let Some(operand) = operands.get_mut(*at) {
                        *operand = value >> (8 * byte) & 0xFF;
                    }
                    self.push(&mut code, *kind, &operands, (None, 1, 0))?;
                }
                Item::ReferBy(kind, operands, at, label, value) => {
                    let mut operands = operands.clone();
                    if let Some(operand) = operands.get_mut(*at) {
                        *operand = value(code.at_label(*label));
                    }
                    self.push(&mut code, *kind, &operands, (None, 1, 0))?;
                }
                Item::Jump(jump, to, times, _) => {
                    let (at, to) = (code.words.len() as u32, code.at_label(*to));
                    let steps = self.arch.form(*jump, level, at, to).ok_or("a jump does not reach its target")?;
                    for step in steps {
                        let times = if step.target.is_some_and(|target| target <= at) { *times } else { 1 };
                        self.push(&mut code, step.kind, &step.operands, (step.target, times, 0))?;
                    }
                }
            }
        }
        Ok(code)
    }

    fn push(
        &self,
        code: &mut Code,
        kind: A::Kind,
        operands: &[i32],
        (target, times, extra): (Option<u32>, u32, u32),
    ) -> Result<(), String> {
        let addr = code.words.len() as u32;
        let words = self.arch.encode(kind, operands, addr)?;
        let (flow, cycles) = self.arch.flow(kind);
        let text = self.arch.text(&words, addr);
        let cycles = cycles.map(|n| n + extra);
        code.insns.push(Insn { addr, len: words.len() as u32, target, flow, cycles, times, text });
        code.words.extend_from_slice(&words);
        Ok(())
    }

    /// Forms of the items and word addresses of the labels. Levels start as low as they may and only rise, at most to
    /// [`HIGHEST`], so this ends.
    fn relax(&self) -> (Vec<u8>, Vec<u32>) {
        let first = |item: &Item<_, _>| if let Item::Jump(.., level) = item { *level } else { 0 };
        let mut levels: Vec<u8> = self.items.iter().map(first).collect();
        let mut sizes: Vec<u32> = self.items.iter().map(|item| self.shortest(item)).collect();
        loop {
            let mut places = vec![0; self.labels];
            let mut pc = 0;
            for (item, size) in self.items.iter().zip(&sizes) {
                if let Item::Label(label) = item
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
                let Item::Jump(jump, to, ..) = item else { continue };
                let to = places.get(to.0).copied().unwrap_or(0);
                let Some((reaches, steps)) = self.reaching(*jump, *level, at, to) else { continue };
                if reaches > *level {
                    *level = reaches;
                    *size = self.length(&steps);
                    risen = true;
                }
            }
            if !risen {
                return (levels, places);
            }
        }
    }

    /// The lowest level from `level` on whose form reaches, with the form.
    fn reaching(&self, jump: A::Jump, level: u8, at: u32, to: u32) -> Option<(u8, Vec<Step<A::Kind>>)> {
        (level..=HIGHEST).find_map(|level| self.arch.form(jump, level, at, to).map(|steps| (level, steps)))
    }

    /// Words of a form.
    fn length(&self, steps: &[Step<A::Kind>]) -> u32 {
        steps.iter().map(|step| self.arch.len(step.kind)).sum()
    }

    /// Words of an item as layout begins.
    fn shortest(&self, item: &Item<A::Kind, A::Jump>) -> u32 {
        match item {
            Item::Op(kind, ..) | Item::Refer(kind, ..) | Item::ReferBy(kind, ..) => self.arch.len(*kind),
            Item::Data(words) => words.len() as u32,
            Item::Jump(jump, _, _, level) => {
                self.reaching(*jump, *level, 0, 0).map_or(0, |(_, steps)| self.length(&steps))
            }
            Item::Label(_) | Item::Mark(_) => 0,
        }
    }
}

impl Code {
    /// Word address of the first such mark.
    #[must_use]
    pub fn at(&self, mark: Mark) -> Option<u32> {
        self.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at)
    }

    /// Word address of a label.
    #[must_use]
    pub fn at_label(&self, label: Label) -> u32 {
        self.labels.get(label.0).copied().unwrap_or(0)
    }
}
