//! Tests in random layouts around the limits of pages and reaches that relaxation terminates and every jump
//! reaches its label.

use emu_8051::isa::Mcs51OpKind;
use emu_avr::isa::AvrOpKind;
use emu_core::rng::Rng;
use emu_pic16::isa::Pic16OpKind;
use ladder_compile::code::{CodeLabel, CodeWriter, FinishedCode, MAX_FORM_LEVEL, TargetArch};
use ladder_compile::pic16::arch::{PAGE, Pic16Arch};
use ladder_compile::pic16::chip_data::Pic16ChipData;
use ladder_compile::pic16::writer::{self, Pic16Item, Pic16Writer};
use ladder_compile::{avr, mcs51};

/// Length of filling that puts a label just before, at or after a border of `border` words.
fn gap(rng: &mut Rng, border: u64) -> usize {
    let base = match rng.below(4) {
        0 => 0,
        1 => border,
        2 => border / 2,
        _ => border * rng.below(3),
    };
    (base + rng.below(9)).saturating_sub(4) as usize
}

/// Places jumps in random filling and checks the result.
///
/// Relaxation must terminate, the last instruction of each form must go to the label of the jump, and the
/// others must stay within the form.
fn scatter<A: TargetArch>(arch: A, jumps: &[A::JumpForm], borders: &[u64], seed: u64) {
    let rng = &mut Rng::new(seed);
    let mut asm = CodeWriter::new(arch);
    let labels: Vec<CodeLabel> = (0..6).map(|_| asm.new_label()).collect();
    let mut unplaced = labels.clone();
    let mut forms = Vec::new();
    for _ in 0..18 {
        let border = borders[rng.below(borders.len() as u64) as usize];
        match rng.below(3) {
            0 => asm.data(&vec![0; gap(rng, border)]),
            1 if !unplaced.is_empty() => {
                let at = rng.below(unplaced.len() as u64) as usize;
                asm.place_label(unplaced.swap_remove(at));
            }
            _ => {
                let (jump, to) = (jumps[rng.below(jumps.len() as u64) as usize], labels[rng.below(6) as usize]);
                let ends = [asm.new_label(), asm.new_label()];
                asm.place_label(ends[0]);
                asm.jump(jump, to);
                asm.place_label(ends[1]);
                forms.push((jump, to, ends));
            }
        }
    }
    unplaced.into_iter().for_each(|label| asm.place_label(label));
    let code = asm.finish().expect("every form encodes");
    for (jump, to, ends) in forms {
        let [first, behind] = ends.map(|label| code.label_address(label));
        let form: Vec<_> = code.instructions.iter().filter(|insn| (first..behind).contains(&insn.addr)).collect();
        let (last, inner) = form.split_last().expect("an instruction");
        assert_eq!(last.target, Some(code.label_address(to)), "{jump:?} at {first:#x}, seed {seed}");
        let stays = |target: u32| (first..=behind).contains(&target);
        assert!(inner.iter().filter_map(|insn| insn.target).all(stays), "{jump:?} at {first:#x}, seed {seed}");
    }
}

/// Checks that each level of a form has a fixed length at all addresses, and that the highest level reaches
/// every address.
fn one_length<A: TargetArch>(arch: &A, jumps: &[A::JumpForm], limit: u64, seed: u64) {
    let mut rng = Rng::new(seed);
    for &jump in jumps {
        let mut lengths = [None; MAX_FORM_LEVEL as usize + 1];
        for _ in 0..20_000 {
            let at = rng.below(limit) as u32;
            let near = (i64::from(at) + rng.below(600) as i64 - 300).clamp(0, limit as i64 - 1) as u32;
            let to = if rng.one_in(2) { near } else { rng.below(limit) as u32 };
            for level in 0..=MAX_FORM_LEVEL {
                let form = arch.jump_form(jump, level, at, to);
                assert!(level < MAX_FORM_LEVEL || form.is_some(), "{jump:?} from {at} to {to}: nothing reaches");
                let Some(steps) = form else { continue };
                let words: u32 = steps.iter().map(|step| arch.instruction_words(step.kind)).sum();
                let length = lengths[usize::from(level)].get_or_insert(words);
                assert_eq!(*length, words, "{jump:?} at level {level} from {at} to {to}, seed {seed}");
            }
        }
        assert!(lengths.is_sorted(), "{jump:?}: {lengths:?}");
    }
}

const AVR_JUMPS: [avr::arch::AvrJump; 3] =
    [avr::arch::AvrJump::If(AvrOpKind::Breq), avr::arch::AvrJump::To, avr::arch::AvrJump::Call];

#[test]
fn avr_forms_end_and_reach() {
    for mcu in ["atmega328p", "atmega48", "atmega8"] {
        let chip = ladder_compile::find_chip(mcu).expect("a chip of the compiler");
        let arch = avr::arch::AvrArch { chip };
        one_length(&arch, &AVR_JUMPS, u64::from(chip.flash_bytes / 2), 1);
        (0..400).for_each(|seed| scatter(arch, &AVR_JUMPS, &[64, 2048], seed));
    }
}

const MCS51_JUMPS: [mcs51::arch::Mcs51Jump; 5] = [
    mcs51::arch::Mcs51Jump::Unconditional,
    mcs51::arch::Mcs51Jump::Call,
    mcs51::arch::Mcs51Jump::Conditional(Mcs51OpKind::Jb, [0x20, 0], 1),
    mcs51::arch::Mcs51Jump::Conditional(Mcs51OpKind::Jbc, [0x20, 0], 1),
    mcs51::arch::Mcs51Jump::Conditional(Mcs51OpKind::DjnzDir, [0x30, 0], 1),
];

#[test]
fn mcs51_forms_end_and_reach() {
    let arch = mcs51::arch::Mcs51Arch;
    one_length(&arch, &MCS51_JUMPS, 0x1_0000, 2);
    (0..400).for_each(|seed| scatter(arch, &MCS51_JUMPS, &[128, 2048], seed));
}

#[test]
fn pic16_forms_have_one_length() {
    use ladder_compile::pic16::arch::Pic16Jump;
    one_length(&Pic16Arch, &[Pic16Jump::Goto, Pic16Jump::Call], 4 * u64::from(PAGE), 3);
}

/// Tests subroutines followed by pieces of code that call them, with lengths such that calls and page
/// boundaries fall on page limits.
#[test]
fn pic16_pages_end_and_reach() {
    let part = ladder_compile::targets()
        .find_map(|target| (target.chip.name == "pic16f877").then(|| emu_pic16::chips::part(target.chip.name)))
        .flatten()
        .expect("a chip of four pages");
    let silicon = Pic16ChipData::new(part);
    let (mut crossed, mut several) = (0, 0);
    for seed in 0..600 {
        let rng = &mut Rng::new(seed);
        let mut out = Pic16Writer::new(&silicon);
        let entry = out.label();
        out.goto(entry);
        let mut subroutines = Vec::new();
        let total = u64::from(PAGE) * (1 + rng.below(3)) + rng.below(40);
        let count = 1 + rng.below(4);
        for _ in 0..count {
            out.allow_page_change();
            let label = out.label();
            out.place(label);
            random_filling(&mut out, rng.below(700), rng, &subroutines);
            out.implied_op(Pic16OpKind::Return);
            subroutines.push(label);
        }
        let poll = out.label();
        out.allow_page_change();
        out.place(entry);
        out.place(poll);
        while (out.items.len() as u64) < total {
            out.allow_page_change();
            random_filling(&mut out, 1 + rng.below(60), rng, &subroutines);
        }
        out.goto_back(poll, 1);
        let mut asm = CodeWriter::new(Pic16Arch);
        let length = writer::assemble(&out.items, out.labels(), &mut asm).expect("pieces are short");
        let code = asm.finish().expect("every form encodes");
        assert_eq!(code.words.len() as u32, length, "seed {seed}");
        let calls = out.items.iter().filter(|item| matches!(item, Pic16Item::Call(_))).count();
        let found = code.instructions.iter().filter(|insn| insn.text.starts_with("call")).count();
        assert_eq!(found, calls, "seed {seed}");
        crossed += pages(&code, seed);
        several += usize::from(length > PAGE);
    }
    assert!(several > 300 && crossed > 1_000, "{several} layouts of several pages, {crossed} jumps across");
}

fn random_filling(out: &mut Pic16Writer<'_>, words: u64, rng: &mut Rng, subroutines: &[writer::Pic16Label]) {
    for _ in 0..words {
        let label = subroutines.get(rng.below(60) as usize);
        match label {
            Some(&label) => out.call(label, 0b1111, None),
            None => out.implied_op(Pic16OpKind::Nop),
        }
    }
}

/// Tracks PCLATH<4:3> along the code: at each jump it must select the target's page, elsewhere the current
/// page.
///
/// Returns the number of jumps that leave their page.
fn pages(code: &FinishedCode, seed: u64) -> usize {
    let page = |addr: u32| addr / PAGE;
    let (mut pclath, mut crossed) = (0, 0);
    let mut end = 0;
    for insn in &code.instructions {
        if insn.addr != end {
            pclath = page(insn.addr);
        }
        end = insn.addr + insn.len;
        let word = code.words[insn.addr as usize];
        match (word >> 10, word & 0x7F) {
            // BCF and BSF of PCLATH<3> and <4>.
            (0b0100 | 0b0101, 0x0A) => {
                let bit = u32::from(word >> 7 & 7) - 3;
                pclath = pclath & !(1 << bit) | u32::from(word >> 10 & 1) << bit;
            }
            _ => match insn.target {
                Some(target) => {
                    assert_eq!(pclath, page(target), "{} at {:#x}, seed {seed}", insn.text, insn.addr);
                    assert_eq!(
                        u32::from(word & 0x7FF),
                        target % PAGE,
                        "{} at {:#x}, seed {seed}",
                        insn.text,
                        insn.addr
                    );
                    crossed += usize::from(page(insn.addr) != page(target));
                    // No skips occur here, so the instruction after a GOTO is reached from its own page.
                    if word >> 11 == 0b101 {
                        pclath = page(end);
                    }
                }
                None => assert_eq!(pclath, page(insn.addr), "{} at {:#x}, seed {seed}", insn.text, insn.addr),
            },
        }
    }
    crossed
}
