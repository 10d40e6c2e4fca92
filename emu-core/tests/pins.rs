//! The level of a pin for each combination of drivers, case by case in `pins.txt`.

use emu_core::pins::{PinLevel, PinState};

fn level(text: &str) -> PinLevel {
    let all = [PinLevel::Low, PinLevel::High, PinLevel::Float, PinLevel::PullUp, PinLevel::PullDown];
    all.into_iter().find(|level| format!("{level:?}") == text).unwrap_or_else(|| panic!("{text}"))
}

#[test]
fn drivers() {
    let mut count = 0;
    for line in include_str!("pins.txt").lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[own, outside, pull_up, held, ":", wanted, fight] = words.as_slice() else { panic!("{line}") };
        let mut pin = PinState::default();
        pin.external = PinLevel::from_bit(held == "1");
        pin.settle(1);
        (pin.driven, pin.external, pin.pull_up) = (level(own), level(outside), pull_up == "+");
        pin.settle(2);
        assert_eq!((pin.level(), pin.has_contention()), (level(wanted), fight == "fight"), "{line}");
        // A floating pin keeps its last level.
        assert_eq!(pin.reads_high, if wanted == "Float" { held == "1" } else { wanted == "High" }, "{line}");
        count += 1;
    }
    assert_eq!(count, 21);
}

/// A bus that both sides only pull low, such as I2C, with an external pull-up. It is low while the chip
/// drives and high otherwise, and changes in the same cycle as the driver.
#[test]
fn open_drain() {
    let mut pin = PinState::default();
    pin.external = PinLevel::PullUp;
    assert!(pin.settle(0) && pin.reads_high);
    for cycle in 1..20 {
        pin.driven = if cycle % 2 == 1 { PinLevel::Low } else { PinLevel::Float };
        assert!(pin.settle(cycle), "cycle {cycle}");
        assert_eq!((pin.level(), pin.has_contention()), (PinLevel::from_bit(cycle % 2 == 0), false), "cycle {cycle}");
        assert_eq!(pin.was_high_at(cycle - 1), cycle % 2 == 1, "cycle {cycle}");
    }
}
