//! The two subcycles as seen by a probe and by a debugger.

use emu_ap101::Ap101;
use emu_core::cpu::{Cpu, Probe, Subcycle};
use emu_core::pins::CycleTime;

use super::asm::assemble;
use super::core::image;

/// All subcycles, as (cycle, clock, phase, address, word).
#[derive(Default)]
struct Seen(Vec<(u64, u8, Subcycle, u32, u16)>);

impl Probe for Seen {
    const SUBCYCLE: bool = true;

    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.0.push((at.cycle, at.phase, phase, pc, word));
        false
    }
}

#[test]
fn fetch_fills_ric_and_counts_na_on_and_execute_does_the_rest() {
    let image = image(&assemble("channels 4, 2\nCLR\nNOT\nSTO E1\nJMP 0"));
    let mut machine = Ap101::new(&image);
    machine.run(2, &mut ());
    let words = [0xC000_u16, 0xB000, 0x2201, 0xD000];
    for (n, word) in words.into_iter().enumerate() {
        let before = (machine.reg("A"), machine.peek("e", 1));
        assert_eq!(machine.reg("NA"), Some(n as u32));
        machine.step_subcycle(&mut ());
        assert_eq!((machine.reg("RIC"), machine.reg("NA")), (Some(word.into()), Some(n as u32 + 1)), "fetched {n}");
        assert_eq!((machine.reg("A"), machine.peek("e", 1)), before, "fetched {n}");
        machine.step_subcycle(&mut ());
        let after = [(0, 0), (1, 0), (1, 1), (1, 1)][n];
        assert_eq!((machine.reg("A"), machine.peek("e", 1)), (Some(after.0), Some(after.1)), "executed {n}");
    }
    assert_eq!((machine.reg("NA"), machine.cycle()), (Some(0), 6));
}

#[test]
fn a_probe_sees_both_subcycles_of_each_instruction() {
    let image = image(&assemble("channels 4, 1\nLD I1\nNOT"));
    let mut seen = Seen::default();
    Ap101::new(&image).run(5, &mut seen);
    let order: Vec<_> = seen.0.iter().map(|&(cycle, _, phase, pc, word)| (cycle, phase, pc, word)).collect();
    let wanted = [
        (1, Subcycle::Fetch, 0, 0x0001),
        (1, Subcycle::Execute, 0, 0x0001),
        (2, Subcycle::Fetch, 1, 0xB000),
        (2, Subcycle::Execute, 1, 0xB000),
        (4, Subcycle::Fetch, 0, 0x0001),
        (4, Subcycle::Execute, 0, 0x0001),
    ];
    // A subcycle is reported at its end: the second one at the start of the next machine cycle, or in its own
    // last clock.
    let named: Vec<_> =
        order.iter().enumerate().map(|(n, &(_, phase, pc, word))| (wanted[n].0, phase, pc, word)).collect();
    assert_eq!(named, wanted);
    let times: Vec<_> = seen.0.iter().map(|&(cycle, clock, ..)| 2 * cycle + u64::from(clock)).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
}
