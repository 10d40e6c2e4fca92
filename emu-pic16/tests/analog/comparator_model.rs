//! The figures of the comparator modes as text, and a model that computes the outputs from that text at every
//! step.

use emu_core::rng::Rng;
use emu_pic16::periph::comparator::Pic16Comparators;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::{Device, Pic16Drive, Pic16Signal};

use crate::script::comparator_kind;

/// Chip, CM2:CM0, VIN- and VIN+ of C1, of C2 (two pins at VIN-: CIS 0 and 1), outputs with a pin, RA3 to RA0
/// analog or digital: DS40044 figure 10-1, DS39582 figure 12-1.
const MODES: &str = "
    62X  0  -    -   -    -   -     AAAA
    62X  1  03   2   1    2   -     AAAA
    62X  2  03   V   12   V   -     AAAA
    62X  3  0    2   1    2   -     DAAA
    62X  4  0    3   1    2   -     AAAA
    62X  5  -    -   1    2   -     DAAD
    62X  6  0    2   1    2   12    DAAA
    62X  7  -    -   -    -   -     DDDD
    87XA 0  -    -   -    -   -     AAAA
    87XA 1  0    3   -    -   1     ADDA
    87XA 2  0    3   1    2   -     AAAA
    87XA 3  0    3   1    2   12    AAAA
    87XA 4  0    3   1    3   -     ADAA
    87XA 5  0    3   1    3   12    ADAA
    87XA 6  03   V   12   V   -     AAAA
    87XA 7  -    -   -    -   -     DDDD
";

#[derive(Default)]
struct Model {
    cmcon: u8,
    cvrcon: u8,
    pins: [u64; 4],
    vdd: u64,
}

impl Model {
    fn row(&self, chip: &str) -> Vec<&'static str> {
        let cm = (self.cmcon & 7).to_string();
        let rows = MODES.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        rows.filter(|row| row.len() == 8).find(|row| row[0] == chip && row[1] == cm).expect("a row")
    }

    /// Returns the voltage of an input as a fraction.
    fn volts(&self, input: char) -> (u64, u64) {
        let cvr = u64::from(self.cvrcon & 0x0F);
        match input {
            'V' if self.cvrcon & 0x80 == 0 => (0, 1),
            'V' if self.cvrcon & 0x20 != 0 => (self.vdd * cvr, 24),
            'V' => (self.vdd * 8 + self.vdd * cvr, 32),
            pin => (self.pins[pin.to_digit(10).expect("a pin") as usize], 1),
        }
    }

    fn output(&self, row: &[&str], n: usize) -> bool {
        let (minus, plus) = (row[2 + 2 * n], row[3 + 2 * n]);
        if minus == "-" {
            return false;
        }
        let cis = self.cmcon & 8 != 0;
        let minus = if cis { minus.chars().last() } else { minus.chars().next() }.expect("a pin");
        let ((a, b), (c, d)) = (self.volts(plus.chars().next().expect("a pin")), self.volts(minus));
        (a * d > c * b) != (self.cmcon & (0x10 << n) != 0)
    }
}

#[test]
fn comparators_agree_with_the_figures() {
    let mut changes = 0;
    for seed in 0..30 {
        let mut rng = Rng::new(seed);
        let (name, chip) = [("62X", "62X"), ("87XA", "87XA"), ("88", "62X")][rng.below(3) as usize];
        let mut dut = Pic16Comparators::new(comparator_kind(name));
        let mut model = Model { cmcon: if name == "62X" { 0 } else { 7 }, vdd: 5_000, ..Model::default() };
        let (mut seen, mut before) = (0, 0);
        let mut drives = [Pic16Drive::Port; 2];
        for t in 1..2_000 {
            let mut out = Vec::new();
            match rng.below(12) {
                0..=4 => {
                    let pin = rng.below(4) as usize;
                    model.pins[pin] = [0, 1_249, 1_250, 1_251, 2_500, 3_593, 3_594, 5_000][rng.below(8) as usize];
                    dut.set_input(pin as u8, model.pins[pin] as u32, t, &mut out);
                }
                5 | 6 => {
                    let value = rng.next_u64() as u8;
                    (seen, model.cmcon) = (before, value & 0x3F);
                    dut.write(Sfr::CMCON, value, 0xFF, t, &mut out);
                }
                7 | 8 => {
                    let value = rng.next_u64() as u8;
                    model.cvrcon = value & 0xEF;
                    dut.write(Sfr::CVRCON, value, 0xFF, t, &mut out);
                }
                9 => {
                    seen = before;
                    assert_eq!(dut.read(Sfr::CMCON, t, &mut out), before | model.cmcon, "seed {seed}, clock {t}");
                }
                10 => {
                    model.vdd = [2_000, 5_000, 5_001][rng.below(3) as usize];
                    dut.set_supply(model.vdd as u32, t, &mut out);
                }
                _ => dut.stop_clock(t, &mut out),
            }
            let row = model.row(chip);
            let outputs = [model.output(&row, 0), model.output(&row, 1)];
            let now = u8::from(outputs[0]) << 6 | u8::from(outputs[1]) << 7;
            assert_eq!(dut.peek(Sfr::CMCON, t), now | model.cmcon, "CMCON, seed {seed}, clock {t}");
            assert_eq!(dut.peek(Sfr::CVRCON, t), model.cvrcon, "CVRCON, seed {seed}, clock {t}");
            assert_eq!(dut.has_mismatch(), now != seen, "mismatch, seed {seed}, clock {t}");
            let pins = row[7].chars().fold(0, |mask, c| mask << 1 | u8::from(c == 'D'));
            assert_eq!(dut.digital_pins(), pins, "digital pins, seed {seed}, clock {t}");
            let (volts, parts) = model.volts('V');
            assert_eq!(u64::from(dut.reference()), volts / parts, "CVREF, seed {seed}, clock {t}");
            let put_out = (model.cvrcon & 0xC0 == 0xC0).then_some((volts / parts) as u32);
            assert_eq!(dut.reference_out(), put_out, "CVREF on RA2, seed {seed}, clock {t}");
            let flagged = out.contains(&Pic16Signal::Flag { t, flag: InterruptFlag::CMIF });
            assert_eq!(flagged, now != before && now != seen, "CMIF, seed {seed}, clock {t}");
            for signal in &out {
                if let Pic16Signal::Drive { t: at, line, drive } = signal {
                    assert_eq!(*at, t, "seed {seed}");
                    drives[usize::from(*line == Pic16Line::C2out)] = *drive;
                }
            }
            for n in 0..2 {
                let has_pin = row[6].contains(['1', '2'][n]);
                let want = if has_pin { Pic16Drive::from_bit(outputs[n]) } else { Pic16Drive::Port };
                assert_eq!(drives[n], want, "C{}OUT, seed {seed}, clock {t}", n + 1);
            }
            changes += u64::from(now != before);
            before = now;
        }
    }
    assert!(changes > 1_000, "only {changes} changes were seen");
}
