//! Instructions with labels to words: displacements are as short as they can be and as long as they must be.

use emu_avr::isa::{self, Kind};
use ladder::ElementId;

/// A place in the code, given a number before its address is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Label(usize);

/// A place that the map or the listing wants to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A part of the image that belongs to no rung.
    Part(&'static str),
    /// The next instruction starts the timer when it ends.
    TimerStart,
    /// The loop that waits for the match.
    Poll,
    /// The first instruction of a scan.
    ScanStart,
    /// A rung, from 0.
    Rung(u32),
    /// An element.
    Element(ElementId),
    /// The end of the last rung.
    RungsEnd,
    /// The last instruction of a scan.
    ScanEnd,
    /// Behind the scan.
    ScanOver,
}

#[derive(Debug, Clone)]
enum Item {
    Op(Kind, Vec<i32>),
    /// A conditional branch, taken at most so many times in a row (1 for all that go forward).
    Branch(Kind, Label, u32),
    Jump(Label),
    Call(Label),
    Label(Label),
    Mark(Mark),
}

/// Code being written.
#[derive(Debug, Default)]
pub struct Asm {
    items: Vec<Item>,
    labels: usize,
}

/// One instruction of the finished code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Insn {
    /// Which one.
    pub kind: Kind,
    /// Word address.
    pub addr: u32,
    /// Length in words.
    pub len: u32,
    /// Where a branch, jump or call goes, a word address.
    pub target: Option<u32>,
    /// How often a branch back is taken at most; 1 elsewhere.
    pub times: u32,
}

/// Finished code.
#[derive(Debug, Clone)]
pub struct Code {
    /// Program memory from word 0.
    pub words: Vec<u16>,
    /// Its instructions in order of address.
    pub insns: Vec<Insn>,
    /// The marks with their word addresses, in order of address.
    pub marks: Vec<(Mark, u32)>,
}

/// Why code could not be finished.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// The code needs so many bytes.
    TooLarge(u64),
    /// An instruction cannot be encoded: a fault of the compiler.
    Encode(String),
}

impl Asm {
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
    pub fn op(&mut self, kind: Kind, operands: &[i32]) {
        self.items.push(Item::Op(kind, operands.to_vec()));
    }

    /// A conditional branch forward.
    pub fn branch(&mut self, kind: Kind, to: Label) {
        self.items.push(Item::Branch(kind, to, 1));
    }

    /// A conditional branch back that is taken at most `times` times in a row.
    pub fn repeat(&mut self, kind: Kind, to: Label, times: u32) {
        self.items.push(Item::Branch(kind, to, times));
    }

    /// A jump. It is one instruction whatever its reach, so a skip may stand before it.
    pub fn jump(&mut self, to: Label) {
        self.items.push(Item::Jump(to));
    }

    /// A call.
    pub fn call(&mut self, to: Label) {
        self.items.push(Item::Call(to));
    }

    /// A mark stands here.
    pub fn mark(&mut self, mark: Mark) {
        self.items.push(Item::Mark(mark));
    }

    /// Chooses displacements and encodes.
    ///
    /// # Errors
    /// The code is larger than `flash` bytes, or an operand does not fit its instruction.
    pub fn finish(&self, flash: u32) -> Result<Code, Fault> {
        let (sizes, places) = self.relax();
        let total: u64 = sizes.iter().map(|&size| u64::from(size)).sum();
        if total * 2 > u64::from(flash) {
            return Err(Fault::TooLarge(total * 2));
        }
        let mut code = Code { words: Vec::new(), insns: Vec::new(), marks: Vec::new() };
        let target = |label: &Label| places.get(label.0).copied().unwrap_or(0);
        for (item, &size) in self.items.iter().zip(&sizes) {
            let pc = code.words.len() as u32;
            match item {
                Item::Label(_) => {}
                Item::Mark(mark) => code.marks.push((*mark, pc)),
                Item::Op(kind, operands) => code.push(*kind, operands, None, 1)?,
                Item::Jump(to) => code.jump(size, target(to), Kind::Rjmp, Kind::Jmp)?,
                Item::Call(to) => code.jump(size, target(to), Kind::Rcall, Kind::Call)?,
                Item::Branch(kind, to, times) => match size {
                    1 => code.push(*kind, &[target(to) as i32], Some(target(to)), *times)?,
                    // Too far for the branch: the opposite branch steps over a jump.
                    _ => {
                        let over = pc + size;
                        code.push(opposite(*kind), &[over as i32], Some(over), 1)?;
                        code.jump(size - 1, target(to), Kind::Rjmp, Kind::Jmp)?;
                    }
                },
            }
        }
        Ok(code)
    }

    /// Sizes of the items and word addresses of the labels. Everything starts short and only ever grows, so this ends.
    fn relax(&self) -> (Vec<u32>, Vec<u32>) {
        let mut sizes: Vec<u32> = self.items.iter().map(Item::shortest).collect();
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
            let (mut pc, mut grown) = (0, false);
            for (item, size) in self.items.iter().zip(sizes.iter_mut()) {
                let at = pc;
                pc += *size;
                let Some(to) = item.target().and_then(|l| places.get(l.0)) else { continue };
                let needed = item.needed(at, *to);
                if needed > *size {
                    *size = needed;
                    grown = true;
                }
            }
            if !grown {
                return (sizes, places);
            }
        }
    }
}

impl Item {
    fn shortest(&self) -> u32 {
        match self {
            Item::Op(kind, _) => words(*kind),
            Item::Branch(..) | Item::Jump(_) | Item::Call(_) => 1,
            Item::Label(_) | Item::Mark(_) => 0,
        }
    }

    fn target(&self) -> Option<Label> {
        match self {
            Item::Branch(_, to, _) | Item::Jump(to) | Item::Call(to) => Some(*to),
            _ => None,
        }
    }

    /// Words needed to reach `to` from `at`.
    fn needed(&self, at: u32, to: u32) -> u32 {
        let away = |from: u32| i64::from(to) - i64::from(from) - 1;
        let jump = |from: u32| if (-2048..2048).contains(&away(from)) { 1 } else { 2 };
        match self {
            Item::Branch(..) if (-64..64).contains(&away(at)) => 1,
            Item::Branch(..) => 1 + jump(at + 1),
            _ => jump(at),
        }
    }
}

impl Code {
    fn push(&mut self, kind: Kind, operands: &[i32], target: Option<u32>, times: u32) -> Result<(), Fault> {
        let addr = self.words.len() as u32;
        let words = isa::encode(kind, operands, addr).map_err(|error| Fault::Encode(error.to_string()))?;
        self.words.extend_from_slice(&words);
        self.insns.push(Insn { kind, addr, len: words.len() as u32, target, times });
        Ok(())
    }

    fn jump(&mut self, size: u32, to: u32, short: Kind, long: Kind) -> Result<(), Fault> {
        self.push(if size == 1 { short } else { long }, &[to as i32], Some(to), 1)
    }

    /// Word address of the first such mark.
    #[must_use]
    pub fn at(&self, mark: Mark) -> Option<u32> {
        self.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at)
    }
}

/// Length of an instruction in words.
fn words(kind: Kind) -> u32 {
    isa::ROWS.get(kind as usize).map_or(1, |row| row.len())
}

/// The branch on the opposite condition.
fn opposite(kind: Kind) -> Kind {
    const PAIRS: [(Kind, Kind); 6] = [
        (Kind::Brcs, Kind::Brcc),
        (Kind::Breq, Kind::Brne),
        (Kind::Brmi, Kind::Brpl),
        (Kind::Brlt, Kind::Brge),
        (Kind::Brts, Kind::Brtc),
        (Kind::Brvs, Kind::Brvc),
    ];
    let found = PAIRS.iter().find_map(|&(a, b)| if a == kind { Some(b) } else { (b == kind).then_some(a) });
    found.unwrap_or(kind)
}
