//! Tests of the panel's keys, without a screen.

use std::time::Duration;

use ladder_eval::Evaluator;
use ratatui_core::layout::Rect;

use super::{LadderPanel, PanelPace};
use crate::{ScreenKey, ScreenStyle, ScreenView, ViewRequest, key, key_script};

const AREA: Rect = Rect { x: 0, y: 0, width: 80, height: 24 };

const PROGRAM: &str = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=16000000\nBAUD=9600\n\nIO LIST\n    Xa at 4\n    Ya at 5\n    Aknob at 23\nEND\n\nPROGRAM\n\
RUNG\n    CONTACTS Xa 0\n    COIL Ya 0 0 0\nEND\n\
RUNG\n    CONTACTS Xa 0\n    CTU Cparts 3\n    COIL Rfull 0 0 0\nEND\n\
RUNG\n    READ_ADC Aknob\nEND\n\
RUNG\n    UART_RECV last\nEND\n\
RUNG\n    CONTACTS Xa 0\n    OSR\n    UART_SEND last\nEND\n\
RUNG\n    PERSIST kept\nEND\n";

fn panel() -> LadderPanel {
    let program = ladder::parse("test.ld", PROGRAM).expect("a program").program;
    let evaluator = Evaluator::new(&program).expect("a meaning");
    LadderPanel::new("test.ld", program, evaluator)
}

fn after(panel: &mut LadderPanel, keys: &str) {
    let steps = key::parse_keys(keys).expect("keys");
    _ = key_script::play_keys(panel, &steps, AREA, ScreenStyle { color: false });
}

fn value(panel: &LadderPanel, name: &str) -> i32 {
    panel.machine.get(panel.machine.index(name).expect("a symbol"))
}

fn scans(panel: &LadderPanel) -> u64 {
    panel.machine.evaluator().scans()
}

#[test]
fn a_switch_acts_with_the_next_scan() {
    let mut panel = panel();
    after(&mut panel, "1");
    assert_eq!((value(&panel, "Xa"), value(&panel, "Ya"), scans(&panel)), (1, 0, 0));
    after(&mut panel, "space");
    assert_eq!((value(&panel, "Xa"), value(&panel, "Ya"), scans(&panel)), (1, 1, 1));
}

#[test]
fn a_pulse_lasts_for_one_scan() {
    for key in ["!", "alt-1"] {
        let mut panel = panel();
        after(&mut panel, &format!("{key} space"));
        assert_eq!((value(&panel, "Xa"), value(&panel, "Ya"), value(&panel, "Cparts")), (0, 1, 1));
        after(&mut panel, &format!("space {key} space"));
        assert_eq!((value(&panel, "Xa"), value(&panel, "Cparts")), (0, 2));
        // An input that is switched stays switched.
        after(&mut panel, &format!("space {key} 1 1 space"));
        assert_eq!(value(&panel, "Xa"), 1);
    }
}

#[test]
fn a_pulse_is_over_after_a_step_back() {
    let mut panel = panel();
    after(&mut panel, "! space*3 b*2");
    assert_eq!((scans(&panel), value(&panel, "Xa"), value(&panel, "Ya")), (1, 0, 1));
    after(&mut panel, "space");
    assert_eq!((value(&panel, "Xa"), value(&panel, "Ya"), value(&panel, "Cparts")), (0, 0, 1));
    // A pulse that no scan has used yet is restored.
    after(&mut panel, "! R space b");
    assert_eq!((value(&panel, "Xa"), scans(&panel)), (1, 0));
    after(&mut panel, "space");
    assert_eq!((value(&panel, "Xa"), value(&panel, "Ya")), (0, 1));
}

#[test]
fn back_and_forth_is_the_same() {
    let mut panel = panel();
    after(&mut panel, "1 space*3 1 space*4 1 space*2");
    let before: Vec<i32> = (0..panel.machine.symbols().len()).map(|symbol| panel.machine.get(symbol)).collect();
    after(&mut panel, "b*4");
    assert_eq!((scans(&panel), value(&panel, "Xa"), value(&panel, "Cparts")), (5, 0, 1));
    after(&mut panel, "space*2 1 space*2");
    let again: Vec<i32> = (0..panel.machine.symbols().len()).map(|symbol| panel.machine.get(symbol)).collect();
    assert_eq!(before, again);
    // Going back stops at the first scan.
    after(&mut panel, "B b*20");
    assert_eq!(scans(&panel), 0);
    assert!(panel.last_message.1, "{:?}", panel.last_message);
}

#[test]
fn the_past_is_bounded() {
    let mut panel = panel();
    after(&mut panel, ":x wait:1ms");
    panel.machine.run(20_000);
    assert_eq!(panel.machine.past().len(), 5_001);
    assert_eq!(panel.machine.go_back(10_000), 5_000);
    assert_eq!(scans(&panel), 15_000);
}

#[test]
fn a_power_cycle_keeps_switches_levels_and_eeprom() {
    let mut panel = panel();
    after(&mut panel, "space*2 : k e p t = 7 enter 1 . space*9");
    assert_eq!((value(&panel, "Cparts"), panel.machine.evaluator().eeprom()), (1, &[7, 0][..]));
    after(&mut panel, "R");
    assert_eq!((value(&panel, "Xa"), value(&panel, "Cparts"), scans(&panel)), (1, 0, 0));
    assert_eq!(panel.machine.evaluator().eeprom(), [7, 0]);
    after(&mut panel, "space*3");
    assert_eq!((value(&panel, "Aknob"), value(&panel, "kept")), (32, 7));
    // Going back over a power cycle restores the state before it.
    after(&mut panel, "b*4");
    assert_eq!((value(&panel, "Cparts"), scans(&panel)), (1, 11));
}

#[test]
fn the_clock_runs_the_scans_that_are_due() {
    let mut panel = self::panel().with_pace(PanelPace::Real, 1.0);
    assert!(panel.is_moving());
    for _ in 0..10 {
        panel.advance_time(Duration::from_millis(33));
    }
    assert_eq!(scans(&panel), 33);
    after(&mut panel, "+ wait:1s - - wait:1s");
    assert_eq!(scans(&panel), 33 + 200 + 50);
    after(&mut panel, "p wait:5s");
    assert_eq!(scans(&panel), 283);
    // The speed is clamped to the maximum.
    let fast = self::panel().with_pace(PanelPace::Real, 1e9);
    assert_eq!(fast.speed, 1000.0);
}

#[test]
fn bytes_arrive_as_fast_as_the_line_is() {
    let mut panel = panel();
    after(&mut panel, ": s e n d");
    for c in " hi\\n".chars() {
        panel.handle_key(ScreenKey::Char(c), AREA);
    }
    panel.handle_key(ScreenKey::Enter, AREA);
    after(&mut panel, "space");
    assert_eq!((value(&panel, "last"), panel.machine.incoming_bytes()), (104, 2));
    after(&mut panel, "space ! space space");
    assert_eq!((value(&panel, "last"), panel.machine.incoming_bytes()), (10, 0));
    assert_eq!(panel.machine.sent().iter().copied().collect::<Vec<u8>>(), b"\n");
}

#[test]
fn every_way_to_leave() {
    for key in [ScreenKey::Char('q'), ScreenKey::Ctrl('c')] {
        assert_eq!(panel().handle_key(key, AREA), ViewRequest::Quit);
    }
    let mut typing = panel();
    after(&mut typing, ":");
    assert_eq!(typing.handle_key(ScreenKey::Char('q'), AREA), ViewRequest::Continue);
    assert_eq!(typing.handle_key(ScreenKey::Ctrl('c'), AREA), ViewRequest::Quit);
}

/// Random keys on screens of any size produce a picture of that size without a panic.
#[test]
fn any_keys_on_any_screen() {
    let mut seed = 1_u64;
    let mut below = |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    for round in 0..30 {
        let mut panel = panel();
        let area = Rect::new(0, 0, 1 + below(140) as u16, 1 + below(50) as u16);
        for _ in 0..40 {
            let key = match below(24) {
                0 => ScreenKey::Enter,
                1 => ScreenKey::Escape,
                2 => ScreenKey::Down,
                3 => ScreenKey::Up,
                4 => ScreenKey::PageDown,
                5 => ScreenKey::Right,
                6 => ScreenKey::End,
                7 => ScreenKey::Tab,
                8 => ScreenKey::Backspace,
                9 => ScreenKey::Left,
                _ => ScreenKey::Char((b' ' + below(95) as u8) as char),
            };
            _ = panel.handle_key(key, area);
            if below(10) == 0 {
                panel.advance_time(Duration::from_millis(1));
            }
            let picture = panel.render(area, ScreenStyle { color: round % 2 == 0 });
            assert_eq!(picture.area, area);
        }
    }
}
