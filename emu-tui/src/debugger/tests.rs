//! Tests of keys and pictures with a machine that consists of data only.

use std::time::Duration;

use ratatui_core::layout::Rect;

use super::{
    CodeLine, CommandAnswer, DebuggedMachine, DebuggerScreen, DebuggerSnapshot, MemoryExcerpt, NamedValue, PinTrace,
    ScreenQuery,
};
use crate::{ScreenKey, ScreenStyle, ScreenView, ViewRequest, key, key_script};

/// A machine that counts: every command and every cycle executes one instruction.
#[derive(Default)]
struct Counter {
    pc: u32,
    cycle: u64,
    point: Option<u32>,
    heard: Vec<String>,
}

impl DebuggedMachine for Counter {
    fn debugger_snapshot(&self, wants: &ScreenQuery) -> DebuggerSnapshot {
        let around = wants.around.unwrap_or(self.pc);
        let lines = u32::try_from(wants.lines).unwrap_or(0);
        let code = (around.saturating_sub(lines)..=around + lines).map(|word| CodeLine {
            word,
            address: format!("0x{:04x}", 2 * word),
            label: (word == 0).then(|| "main:".to_owned()),
            text: "nop".to_owned(),
            operand_meaning: if word == 3 { "three".to_owned() } else { String::new() },
            breakpoint: self.point.filter(|point| *point == word),
            ..CodeLine::default()
        });
        let value = |name: &str, text: &str, changed| NamedValue { name: name.into(), text: text.into(), changed };
        let (_, at, count) = wants.memory;
        let bytes = (at..).take(count).map(|addr| ((addr < 40).then_some(addr as u8), addr == 1)).collect();
        DebuggerSnapshot {
            title: "count.hex on a counter".to_owned(),
            time: format!("cycle {}", self.cycle),
            pc: self.pc,
            cycle: self.cycle,
            code: code.collect(),
            registers: vec![value("r0", "00", false), value("r1", "2a", true), value("SP", "08ff", false)],
            pins: vec![value("PB0", "1", false), value("PB1", "z", false)],
            memory: (count > 0).then(|| MemoryExcerpt { name: "data".to_owned(), address: at, bytes }),
            traces: vec![PinTrace {
                name: "PB0".to_owned(),
                high: true,
                edges: vec![(2_000, true), (4_500, false), (4_700, true)],
            }],
            ..DebuggerSnapshot::default()
        }
    }

    fn run_command(&mut self, line: &str) -> CommandAnswer {
        self.heard.push(line.to_owned());
        match line.split_once(' ') {
            Some(("break", address)) => {
                self.point = u32::from_str_radix(address.trim_start_matches("0x"), 16).ok().map(|a| a / 2)
            }
            Some(("delete", _)) => self.point = None,
            _ => self.pc += 1,
        }
        CommandAnswer { text: String::new(), failed: line == "wrong", quit: line == "quit" }
    }

    fn advance(&mut self, cycles: Option<u64>, _: Option<Duration>) -> Option<CommandAnswer> {
        self.cycle += cycles.unwrap_or(1);
        (self.cycle >= 5_000).then(|| {
            self.cycle = 5_000;
            CommandAnswer { text: "Breakpoint 1\n".to_owned(), ..CommandAnswer::default() }
        })
    }

    fn hertz(&self) -> f64 {
        1_000.0
    }
}

const AREA: Rect = Rect { x: 0, y: 0, width: 80, height: 24 };

fn screen() -> DebuggerScreen<Counter> {
    DebuggerScreen::new(Counter::default(), true)
}

fn after(screen: &mut DebuggerScreen<Counter>, keys: &str, area: Rect) -> String {
    let steps = key::parse_keys(keys).expect("keys");
    let look = ScreenStyle { color: false };
    key_script::picture_text(&key_script::play_keys(screen, &steps, area, look), look)
}

#[test]
fn keys_are_short_for_commands() {
    let mut screen = screen();
    after(&mut screen, "s n N f S g e u U r R :info", AREA);
    let wanted = [
        "stepi",
        "next",
        "nexti",
        "finish",
        "scan",
        "rung",
        "element",
        "reverse-stepi",
        "reverse-next",
        "reverse-continue",
        "reset",
        "info",
    ];
    assert_eq!(screen.machine.heard, wanted);
}

#[test]
fn the_cursor_sets_breakpoints_and_deletes_them() {
    let mut screen = screen();
    after(&mut screen, "down*3 b", AREA);
    assert_eq!((screen.machine.point, screen.cursor), (Some(3), Some(3)));
    after(&mut screen, "b up b enter", AREA);
    assert_eq!(screen.machine.heard, ["break 0x0006", "delete 3", "break 0x0004", "until 0x0004"]);
    assert_eq!(screen.cursor, None);
    // The cursor stops at the beginning of memory.
    after(&mut screen, "up*9", AREA);
    assert_eq!(screen.cursor, Some(0));
}

#[test]
fn it_runs_for_the_requested_time() {
    let mut screen = screen();
    after(&mut screen, "space wait:500ms", AREA);
    assert!(screen.is_moving());
    assert_eq!(screen.machine.cycle, 500);
    // A pause key only stops a run; any other key also has its own effect.
    after(&mut screen, "space wait:1s", AREA);
    assert_eq!((screen.is_moving(), screen.machine.cycle), (false, 500));
    after(&mut screen, "+ space wait:1s s", AREA);
    assert_eq!((screen.is_moving(), screen.machine.cycle, screen.machine.heard.len()), (false, 2_500, 1));
    // A breakpoint ends the run.
    let picture = after(&mut screen, "c wait:10s", AREA);
    assert_eq!((screen.is_moving(), screen.machine.cycle), (false, 5_000));
    assert!(picture.contains("Breakpoint 1"), "{picture}");
    after(&mut screen, ":c wait:1s", AREA);
    assert!(!screen.is_moving());
}

#[test]
fn ways_to_leave() {
    assert_eq!(screen().handle_key(ScreenKey::Char('q'), AREA), ViewRequest::Quit);
    assert_eq!(screen().handle_key(ScreenKey::Ctrl('c'), AREA), ViewRequest::Quit);
    let mut quits = screen();
    ":quit".chars().for_each(|c| assert_eq!(quits.handle_key(ScreenKey::Char(c), AREA), ViewRequest::Continue));
    assert_eq!(quits.handle_key(ScreenKey::Enter, AREA), ViewRequest::Quit);
    let mut runs = screen();
    after(&mut runs, "space", AREA);
    assert_eq!((runs.handle_key(ScreenKey::Ctrl('c'), AREA), runs.is_moving()), (ViewRequest::Continue, false));
}

#[test]
fn a_picture() {
    let mut screen = screen();
    screen.machine.cycle = 4_999;
    let picture = after(&mut screen, "down b z*7", Rect::new(0, 0, 76, 18));
    let wanted = concat!(
        " count.hex on a counter                              cycle 4999   ▪ stopped\n",
        "\
Code ────────────────────────────────────── │ Registers ────────────────────
  main:                                     │ r0 00   r1*2a   SP 08ff
 ▶ 0000  nop                                │ Pins ─────────────────────────
●> 0002  nop                                │ PB0 1 PB1 z
   0004  nop                                │
   0006  nop  ; three                       │
Memory data ─────────────────────────────── │
0000  00*01 02 03 04 05 06 07  ········     │
0008  08 09 0a 0b 0c 0d 0e 0f  ········     │
0010  10 11 12 13 14 15 16 17  ········     │
0018  18 19 1a 1b 1c 1d 1e 1f  ········     │
0020  20 21 22 23 24 25 26 27  ·!\"#$%&'     │
Pins over time, 100 cycles a column ────────────────────────────────────────
PB0  ▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▔▁▁▔▔▔
break 0x0002

s step  n next  c continue  space run  b break  u back  : command  ? help
"
    );
    assert_eq!(picture, wanted, "{picture}");
}

/// Random keys on screens of any size produce a picture of that size without a panic.
#[test]
fn any_keys_on_any_screen() {
    let mut seed = 7_u64;
    let mut below = |n: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % n
    };
    for round in 0..40 {
        let mut screen = screen();
        let area = Rect::new(0, 0, 1 + below(140) as u16, 1 + below(50) as u16);
        for _ in 0..40 {
            let key = match below(20) {
                0 => ScreenKey::Enter,
                1 => ScreenKey::Escape,
                2 => ScreenKey::Down,
                3 => ScreenKey::Up,
                4 => ScreenKey::PageDown,
                5 => ScreenKey::PageUp,
                6 => ScreenKey::Home,
                7 => ScreenKey::Tab,
                8 => ScreenKey::Backspace,
                _ => ScreenKey::Char((b' ' + below(95) as u8) as char),
            };
            _ = screen.handle_key(key, area);
            screen.advance_time(Duration::from_millis(below(300)));
            assert_eq!(screen.render(area, ScreenStyle { color: round % 2 == 0 }).area, area);
        }
    }
}
