//! Tests converter, serial line, PWM output and EEPROM of the evaluator; clones must be snapshots of them
//! too.

use crate::common;
use ladder_eval::Evaluator;

fn eval(text: &str) -> Evaluator {
    common::evaluator(&common::rungs(text))
}

#[test]
fn levels_are_given_to_the_symbols_of_read_adc() {
    let mut eval = eval("RUNG\nREAD_ADC Ab\nEND\nRUNG\nREAD_ADC Aa\nEND\nRUNG\nREAD_ADC Ab\nEND\nRUNG\nMOVE n An\nEND");
    let index = |eval: &Evaluator, name| common::index(eval, name);
    let (a, b, n) = (index(&eval, "Aa"), index(&eval, "Ab"), index(&eval, "An"));
    assert_eq!(eval.adc_symbols().collect::<Vec<_>>(), [a, b], "each once, ascending; An is read by nothing");
    for (symbol, level) in [(a, 5), (b, 1024), (n, 7), (usize::MAX, 7)] {
        eval.set_adc(symbol, level);
    }
    assert_eq!((eval.get(a), eval.get(b)), (0, 0), "before the scan");
    eval.scan();
    assert_eq!((eval.get(a), eval.get(b), eval.get(n)), (5, 1023, 0));
}

#[test]
fn the_serial_line_counts_down() {
    // At 2400 baud a byte is shorter than a scan of 10 ms; at 200 baud it takes 5 scans.
    let text =
        "LDmicro0.1\nCYCLE=10000\nCRYSTAL=1\nBAUD=200\nPROGRAM\nRUNG\nCONTACTS Xa 0\nUART_SEND n\nUART_RECV m\nEND\n";
    let mut eval = common::evaluator(&common::parse("t", text));
    let (x, n, m) = (common::index(&eval, "Xa"), common::index(&eval, "n"), common::index(&eval, "m"));
    assert_eq!((eval.sent(), eval.uart_busy_scans(), eval.has_received_byte()), (None, 0, false));
    assert!(eval.receive(7) && !eval.receive(8) && eval.has_received_byte());
    eval.set(x, 1);
    eval.set(n, 0x141);
    let before = eval.clone();
    eval.scan();
    assert_eq!((eval.sent(), eval.uart_busy_scans(), eval.has_received_byte(), eval.get(m)), (Some(0x41), 5, false, 7));
    assert_eq!(
        (before.sent(), before.uart_busy_scans(), before.has_received_byte()),
        (None, 0, true),
        "a clone is a snapshot"
    );
    eval.set(x, 0);
    for left in [4, 3, 2, 1, 0, 0] {
        eval.scan();
        assert_eq!((eval.sent(), eval.uart_busy_scans()), (None, left));
    }
    // The longest byte: 10^7 us at 1 baud, in scans of 1 us.
    let text = text.replace("CYCLE=10000", "CYCLE=1").replace("BAUD=200", "BAUD=1");
    let mut slow = common::evaluator(&common::parse("t", &text));
    slow.set(x, 1);
    slow.scan();
    assert_eq!(slow.uart_busy_scans(), 10_000_000);
}

#[test]
fn duty_and_frequency() {
    let mut eval = eval("RUNG\nCONTACTS Xa 0\nSET_PWM 30 1234\nEND");
    assert_eq!(
        (eval.pwm_percent(), eval.pwm_outputs().first().map(|output| output.hertz)),
        (None, Some(1234)),
        "the frequency is the program's, the duty is set by a scan"
    );
    eval.scan();
    assert_eq!(eval.pwm_percent(), None);
    eval.set(common::index(&eval, "Xa"), 1);
    eval.scan();
    assert_eq!(eval.pwm_percent(), Some(30));
    assert_eq!(self::eval("RUNG\nOPEN\nEND").pwm_outputs(), []);
}

#[test]
fn cells_are_those_of_persist() {
    let mut eval = eval("RUNG\nPERSIST a\nEND\nRUNG\nPERSIST b\nEND");
    assert_eq!((eval.eeprom(), eval.eeprom_busy_scans()), ([255; 4].as_slice(), 0));
    for (addr, byte) in [(0, 1), (3, 128), (4, 9), (usize::MAX, 9)] {
        eval.set_eeprom(addr, byte);
    }
    assert_eq!(eval.eeprom(), [1, 255, 255, 128]);
    eval.scan();
    let (a, b) = (common::index(&eval, "a"), common::index(&eval, "b"));
    assert_eq!((eval.get(a), eval.get(b), eval.eeprom_busy_scans()), (-255, -32513, 0));
    eval.set(b, 0);
    let before = eval.clone();
    eval.scan();
    assert_eq!((eval.eeprom(), eval.eeprom_busy_scans()), ([1, 255, 0, 128].as_slice(), 1));
    assert_eq!(before.eeprom(), [1, 255, 255, 128], "a clone is a snapshot");
    assert!(self::eval("RUNG\nOPEN\nEND").eeprom().is_empty());
}

#[test]
fn the_adjust_of_old_files_in_the_new_dialect() {
    // Header, dialect, number of scans until a TON of three cycles is true.
    for (header, dialect, wanted) in [
        ("0.1", ladder::LadderDialect::Ldmicro23, 3),
        ("0.1", ladder::LadderDialect::Ldmicro5, 3),
        ("0.2", ladder::LadderDialect::Ldmicro5, 4),
        ("0.2", ladder::LadderDialect::Ldmicro23, 3),
    ] {
        let text =
            format!("LDmicro{header}\nCYCLE=10000\nCRYSTAL=1\nPROGRAM\nRUNG\nTON Ta 30000\nCOIL Ya 0 0 0\nEND\n");
        let options = ladder::ParseOptions { dialect: Some(dialect) };
        let mut eval = common::evaluator(&ladder::parse_with("t", &text, options).expect("reads").program);
        let y = common::index(&eval, "Ya");
        let scans = (1..10).find(|_| {
            eval.scan();
            eval.get(y) == 1
        });
        assert_eq!(scans, Some(wanted), "{header} {dialect:?}");
    }
}
