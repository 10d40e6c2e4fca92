//! Cases from DS40002061, one per line: section, topic, steps. A step is `edge:NAME=value` (a write or a
//! level), `cycle:NAME?value` (a read by an instruction) or `edge:what`. Registers are hexadecimal, levels in
//! millivolts.

use emu_avr::periph::adc::{AdcRegister, AvrAdc, AvrAdcKind};
use emu_avr::periph::{AvrOutbox, Device};
use emu_core::NEVER;

const REGS: [AdcRegister; 6] = [
    AdcRegister::ADMUX,
    AdcRegister::ADCSRA,
    AdcRegister::ADCSRB,
    AdcRegister::ADCL,
    AdcRegister::ADCH,
    AdcRegister::DIDR0,
];

fn register(name: &str) -> Option<AdcRegister> {
    REGS.into_iter().find(|reg| format!("{reg:?}") == name)
}

fn step(adc: &mut AvrAdc, step: &str) -> Result<(), String> {
    let mut out = AvrOutbox::new();
    let (t, what) = step.split_once(':').ok_or("no time")?;
    let t: u64 = t.parse().map_err(|_| "time")?;
    let hex = |text: &str| u8::from_str_radix(text, 16).map_err(|e| e.to_string());
    if let Some((name, want)) = what.split_once('?') {
        let got = match name {
            "next" if adc.next_deadline() == NEVER => "-".to_string(),
            "next" => adc.next_deadline().to_string(),
            "irq" => {
                adc.run_due(t, &mut out);
                adc.interrupt_requests().to_string()
            }
            "channel" => adc.comparator_channel().map_or("-".into(), |n| n.to_string()),
            _ => format!("{:02X}", adc.read(register(name).ok_or("register")?, t, &mut out)),
        };
        return if got == want { Ok(()) } else { Err(format!("it is {got}")) };
    }
    if let Some((name, value)) = what.split_once('=') {
        let number = || value.parse().map_err(|_| "number");
        match (register(name), name) {
            (Some(reg), _) => adc.write(reg, hex(value)?, 0xFF, t, &mut out),
            (_, "AREF") => adc.set_aref(number()?, t),
            (_, "AVCC") => adc.set_avcc(number()?, t),
            (_, "temp") => adc.set_millivolts(8, number()?, t),
            _ => adc.set_millivolts(name[3..].parse().map_err(|_| "channel")?, number()?, t),
        }
        return Ok(());
    }
    match what {
        "taken" => adc.on_interrupt_taken(0, t, &mut out),
        "halted" => adc.on_core_halted(t),
        "sleep" => adc.stop_clock(t, &mut out),
        "wake" => adc.restart_clock(t, &mut out),
        "reset" => adc.reset(false, t, &mut out),
        _ => {
            let (set, source) = (what.starts_with("flag"), &what[4..]);
            adc.trigger(source.parse().map_err(|_| "source")?, set, t);
        }
    }
    Ok(())
}

fn run(line: &str) -> Result<(), String> {
    let steps = line.split('|').nth(1).ok_or("two columns")?;
    let kind = match line.split_whitespace().next() {
        Some("mega8") => AvrAdcKind::MEGA8,
        Some("mega16") => AvrAdcKind::MEGA16,
        _ => AvrAdcKind::MEGA48,
    };
    let mut adc = AvrAdc::new(kind);
    for text in steps.split_whitespace() {
        step(&mut adc, text).map_err(|said| format!("{line}\n  at {text}: {said}"))?;
    }
    Ok(())
}

/// At ADPS = 2 a clock of the converter is 4 cycles; it rises 2, 6, 10, .. cycles after ADEN. The first
/// conversion of `10:ADCSRA=C2` ends at 112.
const CASES: &str = "
    24.4   first conversion: 25 clocks after the first rise   | 10:ADCSRA=C2 11:ADCSRA?C2 111:ADCSRA?C2 112:ADCSRA?92
    24.4   ADEN first, ADSC later: the next rise, 25 clocks   | 10:ADCSRA=82 15:ADCSRA=C2 115:ADCSRA?C2 116:ADCSRA?92
    24.4   ADSC at a rise waits for the one after it          | 10:ADCSRA=82 16:ADCSRA=C2 119:ADCSRA?C2 120:ADCSRA?92
    24.4   the second takes 13                                | 10:ADCSRA=C2 113:ADCSRA=D2 114:ADCSRA?C2 167:ADCSRA?C2 168:ADCSRA?92
    24.4   ADEN off and on makes the next a first one         | 10:ADCSRA=C2 120:ADCSRA=12 121:ADCSRA=C2 222:ADCSRA?C2 223:ADCSRA?92
    24.4   the first sample is at 13.5 clocks: before         | 9:ADC0=2500 10:ADMUX=40 10:ADCSRA=C2 65:ADC0=0 112:ADCL?00 112:ADCH?00
    24.4   and after                                          | 9:ADC0=2500 10:ADMUX=40 10:ADCSRA=C2 66:ADC0=0 112:ADCL?00 112:ADCH?02
    24.4   a normal sample is at 1.5 clocks: before           | 10:ADMUX=40 10:ADCSRA=C2 113:ADCSRA=D2 121:ADC0=5000 168:ADCL?FF 168:ADCH?03
    24.4   and after                                          | 10:ADMUX=40 10:ADCSRA=C2 113:ADCSRA=D2 122:ADC0=5000 168:ADCL?00 168:ADCH?00
    24.4   the prescaler restarts with ADEN                   | 10:ADCSRA=87 99:ADCSRA=07 100:ADCSRA=C7 3363:ADCSRA?C7 3364:ADCSRA?97
    24.9.2 ADPS 0 halves the clock                            | 10:ADCSRA=C0 60:ADCSRA?C0 61:ADCSRA?90
    24.9.2 ADPS 1 too                                         | 10:ADCSRA=C1 60:ADCSRA?C1 61:ADCSRA?91
    24.9.2 ADPS 3 to 6: 8 to 64 cycles a clock                | 10:ADCSRA=C3 213:ADCSRA?C3 214:ADCSRA?93 300:ADCSRA=13 300:ADCSRA=C6 1931:ADCSRA?C6 1932:ADCSRA?96
    24.4   free running: 13 clocks each, ADSC stays           | 10:ADCSRA=E2 112:ADCSRA?F2 113:ADCSRA=F2 114:ADCSRA?E2 163:ADCSRA?E2 164:ADCSRA?F2
    24.3   free running does not wait for ADIF                | 10:ADMUX=40 10:ADCSRA=E2 130:ADC0=2500 164:ADCH?00 216:ADCH?02 216:ADCSRA?F2
    24.3   ADATE off ends it after the conversion             | 10:ADCSRA=E2 120:ADCSRA=92 163:ADCSRA?C2 164:ADCSRA?92 230:ADCSRA?92
    24.3   triggered first conversion: 3 cycles, 25.5 clocks  | 9:ADCSRB=03 10:ADCSRA=A2 20:flag3 20:ADCSRA?E2 124:ADCSRA?E2 125:ADCSRA?B2
    24.3   others: 3 cycles, 13.5 clocks                      | 9:ADCSRB=03 10:ADCSRA=C2 113:ADCSRA=B2 121:flag3 121:ADCSRA?E2 177:ADCSRA?E2 178:ADCSRA?B2
    24.4   sampled 3 cycles and 2 clocks after: before        | 9:ADCSRB=03 9:ADMUX=40 10:ADCSRA=C2 113:ADCSRA=B2 121:flag3 131:ADC0=5000 178:ADCL?FF 178:ADCH?03
    24.4   and after                                          | 9:ADCSRB=03 9:ADMUX=40 10:ADCSRA=C2 113:ADCSRA=B2 121:flag3 132:ADC0=5000 178:ADCL?00 178:ADCH?00
    24.3   a flag that stays set starts no more               | 9:ADCSRB=03 10:ADCSRA=A2 20:flag3 200:ADCSRA=B2 210:flag3 211:ADCSRA?A2
    24.3   it must have been cleared                          | 9:ADCSRB=03 10:ADCSRA=A2 20:flag3 200:ADCSRA=B2 205:fell3 210:flag3 211:ADCSRA?E2
    24.3   an edge in a conversion is ignored                 | 9:ADCSRB=03 10:ADCSRA=A2 20:flag3 30:fell3 40:flag3 125:ADCSRA?B2 300:ADCSRA?B2
    24.3   only the selected source counts                    | 9:ADCSRB=03 10:ADCSRA=A2 20:flag4 30:flag2 40:ADCSRA?A2
    24.3   only with ADATE                                    | 9:ADCSRB=03 10:ADCSRA=82 20:flag3 40:ADCSRA?82
    24.9.4 switched from a clear source to a set one          | 9:ADCSRB=03 10:ADCSRA=A2 20:flag4 30:ADCSRA?A2 30:ADCSRB=04 31:ADCSRA?E2 134:ADCSRA?E2 135:ADCSRA?B2
    24.9.4 from a set one to a set one                        | 9:ADCSRB=03 10:flag3 10:ADCSRA=A2 20:flag4 30:ADCSRB=04 31:ADCSRA?A2
    24.9.4 to free running with ADIF set                      | 9:ADCSRB=03 10:ADCSRA=E2 112:ADCSRA?B2 130:ADCSRB=00 131:ADCSRA?B2
    24.5   ADMUX is locked at the rise that starts            | 9:ADC1=5000 9:ADMUX=40 10:ADCSRA=C2 12:ADMUX=41 112:ADCL?00 112:ADCH?00
    24.5   and is free before it                              | 9:ADC1=5000 9:ADMUX=40 10:ADCSRA=C2 11:ADMUX=41 112:ADCL?FF 112:ADCH?03
    24.5   REFS too                                           | 9:ADC1=2500 9:ADMUX=41 10:ADCSRA=C2 12:ADMUX=C1 112:ADCL?00 112:ADCH?02
    24.5.1 free running: the next result is of the old one    | 9:ADC1=5000 9:ADMUX=40 10:ADCSRA=E2 113:ADMUX=41 164:ADCH?00 216:ADCH?03
    24.5   in the last clock it still counts                  | 9:ADC1=5000 9:ADMUX=40 10:ADCSRA=E2 111:ADMUX=41 112:ADCH?00 164:ADCH?03
    24.9.1 ADLAR acts at once                                 | 9:ADC0=2500 9:ADMUX=40 10:ADCSRA=C2 112:ADCH?02 113:ADMUX=60 113:ADCH?80 114:ADCL?00
    24.9.3 ADCL locks: the result is lost, ADIF is set        | 9:ADMUX=40 10:ADCSRA=C2 112:ADCL?00 113:ADC0=5000 113:ADCSRA=D2 168:ADCSRA?92 168:ADCL?00 168:ADCH?00 169:ADCH?00
    24.9.3 ADCH unlocks                                       | 9:ADMUX=40 10:ADCSRA=C2 112:ADCL?00 112:ADCH?00 113:ADC0=5000 113:ADCSRA=D2 168:ADCL?FF 168:ADCH?03
    24.9.3 ADCH alone locks nothing                           | 9:ADMUX=60 10:ADCSRA=C2 112:ADCH?00 113:ADC0=5000 113:ADCSRA=D2 168:ADCH?FF
    24.9.3 the data registers cannot be written               | 9:ADMUX=40 10:ADCL=55 10:ADCH=55 11:ADCL?00 11:ADCH?00
    24.9.2 ADSC written 0 does nothing                        | 10:ADCSRA=C2 50:ADCSRA=82 51:ADCSRA?C2 112:ADCSRA?92
    24.9.2 ADSC without ADEN is not kept                      | 10:ADCSRA=42 11:ADCSRA?02 20:ADCSRA=82 21:ADCSRA?82
    24.9.2 ADEN off ends the conversion without ADIF          | 10:ADCSRA=C2 111:ADCSRA=02 112:ADCSRA?02 200:ADCSRA?02
    24.9.2 ADIF and ADIE ask; the entry clears                | 10:ADCSRA=CA 10:next?112 111:irq?0 112:irq?1 116:taken 116:irq?0 117:ADCSRA?8A 117:next?-
    24.9.2 ADIF is cleared by a 1, and kept by a 0            | 10:ADCSRA=C2 113:ADCSRA=82 114:ADCSRA?92 115:ADCSRA=92 116:ADCSRA?82
    24.9.2 not by the write at the edge that sets it          | 10:ADCSRA=C2 112:ADCSRA=92 112:ADCSRA?92
    24.9.2 without ADIE nothing is asked                      | 10:ADCSRA=C2 10:next?- 112:irq?0 120:ADCSRA=8A 120:irq?1
    24.7   Vin * 1024 / Vref: 1234 mV of 5 V is 252           | 9:ADC5=1234 9:ADMUX=45 10:ADCSRA=C2 112:ADCL?FC 112:ADCH?00
    24.7   3 V reference on AREF: 341 at 1 V                  | 9:AREF=3000 9:ADC5=1000 9:ADMUX=05 10:ADCSRA=C2 112:ADCL?55 112:ADCH?01
    24.7   AVCC of 3.3 V: 310 at 1 V                          | 9:AVCC=3300 9:ADC7=1000 9:ADMUX=47 10:ADCSRA=C2 112:ADCL?36 112:ADCH?01
    24.7   1.1 V: 465 at 0.5 V                                | 9:ADC6=500 9:ADMUX=C6 10:ADCSRA=C2 112:ADCL?D1 112:ADCH?01
    24.7   no more than 1023                                  | 9:ADC6=5000 9:ADMUX=C6 10:ADCSRA=C2 112:ADCL?FF 112:ADCH?03
    24.8   the temperature sensor at 25 degrees: 314 mV       | 9:ADMUX=C8 10:ADCSRA=C2 112:ADCL?24 112:ADCH?01
    24.8   at 85 degrees: 380 mV                              | 9:temp=380 9:ADMUX=C8 10:ADCSRA=C2 112:ADCL?61 112:ADCH?01
    24.9.1 bandgap against 5 V: 225                           | 9:ADMUX=4E 10:ADCSRA=C2 112:ADCL?E1 112:ADCH?00
    24.9.1 ground                                             | 9:ADMUX=4F 10:ADCSRA=C2 112:ADCL?00 112:ADCH?00
    24.9.1 bit 4 of ADMUX is reserved                         | 9:ADMUX=FF 10:ADMUX?EF
    24.9.4 ADCSRB                                             | 9:ADCSRB=FF 10:ADCSRB?47
    24.9.5 DIDR0                                              | 9:DIDR0=FF 10:DIDR0?3F
    23.2   ACME gives the multiplexer to the comparator       | 9:ADMUX=05 9:ADCSRB=40 9:channel?5 10:ADCSRA=80 10:channel?- 11:ADCSRA=00 11:ADCSRB=00 11:channel?-
    10.4   going to sleep starts a conversion                 | 10:ADCSRA=8A 12:halted 13:ADCSRA?CA 115:irq?0 116:irq?1
    10.4   unless one runs, or ADEN is clear                  | 5:halted 10:ADCSRA=CA 50:halted 112:ADCSRA?9A 200:ADCSRA?9A
    10.5   the clock is stopped in deeper sleep               | 10:ADCSRA=C2 50:sleep 150:wake 211:ADCSRA?C2 212:ADCSRA?92
    24.9   reset                                              | 9:ADMUX=FF 9:DIDR0=3F 9:ADCSRB=47 10:ADCSRA=EA 200:reset 200:ADMUX?00 200:ADCSRA?00 200:ADCSRB?00 200:DIDR0?00 200:next?-
    mega8  bit 5 is ADFR, there is no ADTS                    | 9:ADCSRB=07 9:ADCSRB?00 10:ADCSRA=E2 112:ADCSRA?F2
    mega8  2.56 V: 400 at 1 V                                 | 9:ADC0=1000 9:ADMUX=C0 10:ADCSRA=C2 112:ADCL?90 112:ADCH?01
    mega16 1.22 V is MUX 30: 249 of 5 V                       | 9:ADMUX=5E 10:ADCSRA=C2 112:ADCL?F9 112:ADCH?00
    mega16 ground is MUX 31                                   | 9:ADMUX=5F 9:ADMUX?5F 10:ADCSRA=C2 112:ADCL?00 112:ADCH?00
";

#[test]
fn the_cases_of_the_data_sheet() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        run(line).unwrap_or_else(|said| panic!("{said}"));
    }
}

#[test]
fn a_wrong_case_is_found() {
    assert!(run("x | 10:ADCSRA=C2 111:ADCSRA?92").is_err());
}
