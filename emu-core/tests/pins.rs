//! Who wins on a pin, case by case in `pins.txt`.

use emu_core::pins::{Level, Pin};

fn level(text: &str) -> Level {
    let all = [Level::Low, Level::High, Level::Float, Level::PullUp, Level::PullDown];
    all.into_iter().find(|level| format!("{level:?}") == text).unwrap_or_else(|| panic!("{text}"))
}

#[test]
fn drivers() {
    let mut count = 0;
    for line in include_str!("pins.txt").lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[own, outside, pull_up, held, ":", wanted, fight] = words.as_slice() else { panic!("{line}") };
        let mut pin = Pin::default();
        pin.outside = Level::of(held == "1");
        pin.settle(1);
        (pin.own, pin.outside, pin.pull_up) = (level(own), level(outside), pull_up == "+");
        pin.settle(2);
        assert_eq!((pin.level(), pin.contention()), (level(wanted), fight == "fight"), "{line}");
        // What floats keeps what it had.
        assert_eq!(pin.high, if wanted == "Float" { held == "1" } else { wanted == "High" }, "{line}");
        count += 1;
    }
    assert_eq!(count, 21);
}

/// A bus that both sides only pull low, as that of I2C, with the resistor outside: it is low while the chip drives, and comes
/// back, each in the cycle of the change.
#[test]
fn open_drain() {
    let mut pin = Pin::default();
    pin.outside = Level::PullUp;
    assert!(pin.settle(0) && pin.high);
    for cycle in 1..20 {
        pin.own = if cycle % 2 == 1 { Level::Low } else { Level::Float };
        assert!(pin.settle(cycle), "cycle {cycle}");
        assert_eq!((pin.level(), pin.contention()), (Level::of(cycle % 2 == 0), false), "cycle {cycle}");
        assert_eq!(pin.at(cycle - 1), cycle % 2 == 1, "cycle {cycle}");
    }
}
