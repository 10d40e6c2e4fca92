//! The distribution of the cycles of a run: by instruction, by interrupt, and those in which no instruction
//! ran.
//!
//! Every cycle is counted once, so that the sum is the length of the run.

use std::collections::BTreeMap;

use emu_core::chip::Chip;
use emu_core::cpu::Probe;
use emu_core::image::{AddressedByte, Image};
use emu_core::table::{FlowKind, FoundRow, find_row, instruction_bits};

/// Number of entries: one for each program word that a 16-bit counter reaches.
const WORD_COUNT: usize = 0x1_0000;

/// Maximum nesting of interrupt services that are distinguished; only a program that never ends them has
/// more.
const MAX_NESTED_SERVICES: usize = 64;

/// How often an interrupt was served, and how long that took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InterruptStatistics {
    /// Number of entries.
    pub entry_count: u64,
    /// Machine cycles from each entry to the end of the instruction that ends the service, added up; nested
    /// interrupts are included.
    pub total_cycles: u64,
    /// Machine cycles of the longest service.
    pub longest_cycles: u64,
}

/// The cycles of one instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InstructionCycles {
    /// Number of the active interrupt, if there was one.
    pub interrupt: Option<u8>,
    /// Program word of the instruction.
    pub word: u32,
    /// Machine cycles of the instruction.
    pub cycles: u64,
}

/// Counts cycles. Iterations of a polling loop are skipped, as in a run without probes; their cycles are
/// still counted.
#[derive(Debug, Clone)]
pub struct CycleProfile {
    /// Per program word, the properties of its instruction.
    facts: Vec<InstructionFacts>,
    /// Cycles by active interrupt, if there is one, and by program word.
    cycles: BTreeMap<Option<u8>, Vec<u64>>,
    /// Idle cycles, in which the core executes nothing (it sleeps or is stopped), by active interrupt.
    idle: BTreeMap<Option<u8>, u64>,
    /// Cycles of interrupt entries after which another interrupt was entered before the first instruction of
    /// the service, by the interrupt that was entered first.
    entries: BTreeMap<Option<u8>, u64>,
    /// Cycles before the first instruction.
    before_first: u64,
    services: BTreeMap<u8, InterruptStatistics>,
    /// Active services: vector and cycle.
    open_services: Vec<(u8, u64)>,
    current: CycleOwner,
    /// All cycles up to this one are counted.
    counted_to: u64,
}

/// What the following cycles belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CycleOwner {
    /// Nothing has run yet.
    Before,
    /// An interrupt entry: they belong to the instruction that follows.
    Entry,
    /// The instruction at this program word.
    Word(u32),
}

/// What the profile needs to know about an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct InstructionFacts {
    /// Maximum cycles of the instruction; what takes longer is sleep after it. 0 if sleep is not separated,
    /// because the maximum is unknown or the instruction may close a loop with skipped iterations.
    max_cycles: u8,
    /// Whether it ends the service of an interrupt.
    ends_service: bool,
}

/// Cycles spent under an interrupt.
#[derive(Debug, Clone, Copy)]
pub struct InterruptCycles {
    /// The active interrupt; None outside of all service routines.
    pub serving: Option<u8>,
    /// The number of cycles.
    pub cycles: u64,
}

/// The services of an interrupt vector.
#[derive(Debug, Clone)]
pub struct VectorServices {
    /// The number of the vector.
    pub vector: u8,
    /// The number and length of the services.
    pub service: InterruptStatistics,
}

impl CycleProfile {
    /// Returns a profile for the program of an image, from the machine cycle `now` on.
    #[must_use]
    pub fn new(chip: &'static Chip, image: &Image, now: u64) -> CycleProfile {
        let mut code = vec![None; (chip.flash_bytes / chip.word_bytes.max(1)) as usize];
        let size = chip.word_bytes.max(1);
        for AddressedByte { addr, byte } in image.bytes_in(chip.code_space) {
            if let Some(word) = code.get_mut((addr / size) as usize) {
                *word = Some(word.unwrap_or(0u16) | u16::from(byte) << (8 * (addr % size)));
            }
        }
        let facts = (0..code.len().min(WORD_COUNT)).map(|pc| {
            let words: Vec<u16> = code.iter().skip(pc).take(3).map_while(|word| *word).collect();
            if words.is_empty() { InstructionFacts::default() } else { instruction_facts(chip, &words) }
        });
        let mut facts: Vec<InstructionFacts> = facts.collect();
        facts.resize(WORD_COUNT, InstructionFacts::default());
        let cycles = BTreeMap::from([(None, vec![0; WORD_COUNT])]);
        CycleProfile {
            facts,
            cycles,
            idle: BTreeMap::new(),
            entries: BTreeMap::new(),
            before_first: 0,
            services: BTreeMap::new(),
            open_services: Vec::new(),
            current: CycleOwner::Before,
            counted_to: now,
        }
    }

    /// Counts the cycles up to `now`; `next` is the instruction that follows, if there is one.
    fn count(&mut self, now: u64, next: Option<u32>) {
        let mut passed = now.saturating_sub(self.counted_to);
        self.counted_to = now;
        let serving = self.open_services.last().map(|open| open.0);
        let word = match (self.current, next) {
            (CycleOwner::Before, _) => {
                self.before_first += passed;
                return;
            }
            (CycleOwner::Entry, None) => {
                *self.entries.entry(serving).or_default() += passed;
                return;
            }
            (CycleOwner::Entry, Some(pc)) | (CycleOwner::Word(pc), _) => pc,
        };
        let facts = self.facts.get(word as usize).copied().unwrap_or_default();
        // One more than the table: a write to the program counter of a PIC takes a second cycle.
        if let (CycleOwner::Word(_), true, true) =
            (self.current, facts.max_cycles > 0, passed > u64::from(facts.max_cycles) + 1)
        {
            let idle = passed - u64::from(facts.max_cycles);
            *self.idle.entry(serving).or_default() += idle;
            passed -= idle;
        }
        let cycles = self.cycles.entry(serving).or_insert_with(|| vec![0; WORD_COUNT]);
        if let Some(cell) = cycles.get_mut(word as usize) {
            *cell += passed;
        }
        if facts.ends_service && matches!(self.current, CycleOwner::Word(_)) {
            self.end_service(now);
        }
    }

    fn end_service(&mut self, now: u64) {
        if let Some((vector, start)) = self.open_services.pop() {
            let service = self.services.entry(vector).or_default();
            let duration = now.saturating_sub(start);
            service.total_cycles += duration;
            service.longest_cycles = service.longest_cycles.max(duration);
        }
    }

    /// Ends the profile at the cycle `now`. Active services are counted up to there.
    pub fn finish(&mut self, now: u64) {
        let next = match self.current {
            // No instruction of the service was executed, so none is charged.
            CycleOwner::Entry => None,
            CycleOwner::Word(pc) => Some(pc),
            CycleOwner::Before => None,
        };
        self.count(now, next);
        while !self.open_services.is_empty() {
            self.end_service(now);
        }
        self.current = CycleOwner::Before;
    }

    /// Returns the cycles of the instructions that took any.
    pub fn cycles(&self) -> impl Iterator<Item = InstructionCycles> {
        let words = |(interrupt, cycles)| {
            (0..).zip(cycles).map(move |(word, count)| InstructionCycles { interrupt, word, cycles: count })
        };
        let all = self.cycles.iter().map(|(serving, cycles)| (*serving, cycles.iter().copied())).flat_map(words);
        all.filter(|one| one.cycles > 0)
    }

    /// Returns the cycles in which the core slept or was stalled, by active interrupt.
    pub fn idle(&self) -> impl Iterator<Item = InterruptCycles> {
        self.idle.iter().map(|(serving, count)| InterruptCycles { serving: *serving, cycles: *count })
    }

    /// Returns the cycles of interrupt entries that were interrupted before an instruction, by the interrupt
    /// that was entered.
    pub fn entries(&self) -> impl Iterator<Item = InterruptCycles> {
        self.entries.iter().map(|(serving, count)| InterruptCycles { serving: *serving, cycles: *count })
    }

    /// Returns the cycles before the first instruction.
    #[must_use]
    pub fn cycles_before_first(&self) -> u64 {
        self.before_first
    }

    /// Returns the services by vector.
    pub fn services(&self) -> impl Iterator<Item = VectorServices> {
        self.services.iter().map(|(vector, service)| VectorServices { vector: *vector, service: *service })
    }

    /// Returns the total of all counted cycles.
    #[must_use]
    pub fn total_cycles(&self) -> u64 {
        let without_instruction =
            self.idle().chain(self.entries()).map(|InterruptCycles { cycles: count, .. }| count).sum::<u64>();
        self.before_first + without_instruction + self.cycles().map(|one| one.cycles).sum::<u64>()
    }
}

/// Returns the properties of the instruction at the start of `words`.
fn instruction_facts(chip: &Chip, words: &[u16]) -> InstructionFacts {
    let isa = chip.isa;
    let Some(FoundRow { index: position, .. }) = find_row(isa.rows, isa.word_bits, words) else {
        return InstructionFacts::default();
    };
    let Some(row) = isa.rows.get(position) else { return InstructionFacts::default() };
    debug_assert!(row.pattern.matches(instruction_bits(row, isa.word_bits, words)), "the row that was found");
    // An instruction with a target may close a loop.
    let has_target = row.operands.iter().any(|slot| slot.kind.name.starts_with("target"));
    let most = row.cycles.possible_counts().iter().copied().max().unwrap_or(0);
    InstructionFacts {
        max_cycles: if has_target { 0 } else { most },
        ends_service: (isa.flow)(position) == FlowKind::EndsInterrupt,
    }
}

impl Probe for CycleProfile {
    const INSN: bool = true;
    const EVERY_ITERATION: bool = false;

    #[inline]
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.count(at, Some(pc));
        self.current = CycleOwner::Word(pc);
        false
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.count(at, None);
        self.services.entry(vector).or_default().entry_count += 1;
        if self.open_services.len() == MAX_NESTED_SERVICES {
            self.open_services.remove(0);
        }
        self.open_services.push((vector, at));
        self.current = CycleOwner::Entry;
    }
}
