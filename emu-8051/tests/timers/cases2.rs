//! Cases for timer 2, computed by hand (user's manual, "Timer 2"; AT89S52 data sheet for T2MOD).

use crate::table::{TimerUnderTest, check};
use emu_8051::periph::map::{pin, sfr};
use emu_8051::periph::timer2::Mcs51Timer2;
use emu_8051::periph::{Device, Mcs51Outbox};

impl TimerUnderTest for Mcs51Timer2 {
    fn sync(&mut self, cycle: u64) {
        self.run_due(cycle, &mut Mcs51Outbox::new());
        self.advance_to(cycle);
    }

    fn get(&self, name: &str) -> u64 {
        let reg = |reg: u8| u64::from(self.peek(reg, 0));
        match name {
            "con" => reg(sfr::T2CON),
            "mod" => reg(sfr::T2MOD),
            "t" => reg(sfr::TH2) << 8 | reg(sfr::TL2),
            "rcap" => reg(sfr::RCAP2H) << 8 | reg(sfr::RCAP2L),
            "tf2" => u64::from(self.t2con() >> 7),
            "exf2" => u64::from(self.t2con() >> 6 & 1),
            "out" => self.clock_out().map_or(0xFF, u64::from),
            "since" => self.flags_set_since(),
            "next" => self.next_flag(),
            "toggle" => self.next_toggle(),
            _ => match (name.strip_prefix("overflow"), name.strip_prefix("by")) {
                (Some(k), _) => self.ticks().time_of(k.parse().expect("a number")),
                (_, Some(state)) => self.ticks().count_at(state.parse().expect("a number")),
                _ => panic!("no {name}"),
            },
        }
    }

    fn set(&mut self, name: &str, value: u8) {
        let reg = match name {
            "con" => sfr::T2CON,
            "mod" => sfr::T2MOD,
            "tl" => sfr::TL2,
            "th" => sfr::TH2,
            "rl" => sfr::RCAP2L,
            "rh" => sfr::RCAP2H,
            _ => panic!("no {name}"),
        };
        self.write(reg, value, 0xFF, 0, &mut Mcs51Outbox::new());
    }

    fn pin(&mut self, name: &str, level: bool, cycle: u64) {
        let line = match name {
            "T2" => pin::T2,
            "EX" => pin::T2EX,
            _ => panic!("no {name}"),
        };
        self.on_line_changed(line, level, cycle, &mut Mcs51Outbox::new());
    }

    fn decimal(&self, name: &str) -> bool {
        ["since", "next", "toggle", "overflow", "by"].iter().any(|start| name.starts_with(start))
    }
}

#[test]
fn by_hand() {
    check(
        || Mcs51Timer2::new(0),
        "
        reset                      | con:0 mod:0 t:0 rcap:0 out:FF since:never next:never toggle:never overflow1:never
        stopped                    | con=00 tl=FF th=FF @99 t:FFFF tf2:0 next:never
        first and last count       | @10 con=04 t:0 @11 t:1 @15 t:5 con=00 @16 t:5
        registers                  | tl=12 th=34 rl=56 rh=78 t:3412 rcap:7856 con=FB con:FB mod=FF mod:3

        capture mode overflows to 0| con=05 tl=FE th=FF rl=34 rh=12 next:1 @1 t:FFFF tf2:0 @2 t:0 tf2:1 since:1 rcap:1234 next:65537
        capture                    | con=0D @10 EX=0 next:11 @11 t:B rcap:B exf2:1 tf2:0 since:11 @12 t:C rcap:B
        capture without EXEN2      | con=05 @10 EX=0 next:65535 @11 rcap:0 exf2:0
        capture, rising edge       | con=0D EX=0 @5 con=0D EX=1 @9 exf2:0 rcap:1
        capture, stopped           | con=09 tl=5 EX=0 @1 rcap:5 exf2:1
        capture, again             | con=0D EX=0 @1 rcap:1 EX=1 @2 EX=0 @3 rcap:3 exf2:1 since:1
        capture, no edge after all | con=0D EX=0 @1 rcap:1 EX!1 rcap:0 exf2:0 since:never @9 t:9
        capture, write stays       | con=0D EX=0 tl=77 @1 rcap:78 EX!1 rcap:0 t:78
        capture, called off late   | con=0D EX=0 @1 rcap:1 tl=50 EX!1 rcap:1 exf2:1 @2 t:51
        capture ignores DCEN       | mod=01 con=05 EX=0 tl=FF th=FF @1 t:0 tf2:1 exf2:0

        reload                     | con=04 tl=FE th=FF rl=FD rh=FF @2 t:FFFD tf2:1 exf2:0 since:1 next:4 @5 t:FFFD
        reload FFFF                | con=04 tl=FF th=FF rl=FF rh=FF next:0 @7 t:FFFF tf2:1 since:0 next:7
        reload by T2EX             | con=0C rl=00 rh=80 @5 t:5 EX=0 @6 t:8000 exf2:1 tf2:0 since:6 @7 t:8001
        reload by T2EX, not armed  | con=04 rl=00 rh=80 @5 EX=0 @6 t:6 exf2:0
        overflow and edge          | con=0C tl=FF th=FF rl=77 EX=0 next:0 @1 t:77 tf2:1 exf2:1 since:0
        EXEN2 too late             | con=04 EX=0 @1 con=0C @2 exf2:0 t:2
        flags stay                 | con=04 tl=FF th=FF @1 tf2:1 @65537 tf2:1 since:0 con=04 tf2:0 since:never
        flags written              | @7 con=80 since:8 con=40 since:8 con=00 since:never
        far                        | con=04 rl=00 rh=FF @2^50 t:FF00 tf2:1 since:65535

        counter                    | con=06 T2=0 @1 t:0 @2 t:1 T2=1 @3 T2=0 @4 T2=1 @5 t:2
        counter, highest rate      | con=06 T2=0 @1 T2=1 @2 T2=0 @3 T2=1 @4 T2=0 @5 T2=1 @6 t:3
        counter, overflow          | con=06 tl=FF th=FF rl=11 rh=22 T2=0 next:1 @1 tf2:0 @2 t:2211 tf2:1 since:1
        counter, no edge after all | con=06 T2=0 @1 T2!1 @9 t:0

        DCEN, up                   | mod=01 con=04 tl=FF th=FF rl=F0 rh=FF @1 t:FFF0 tf2:1 exf2:1 since:0 @17 t:FFF0 exf2:0
        DCEN, EXF2 asks nothing    | mod=01 con=44 since:never con=04 con=40 since:never mod=00 since:1
        DCEN, down                 | mod=01 con=04 tl=03 rl=01 EX=0 next:2 @1 t:2 @2 t:1 tf2:0 @3 t:FFFF tf2:1 exf2:1 since:2 @4 t:FFFE next:65537
        DCEN, down past 0          | mod=01 con=04 tl=01 rh=80 EX=0 @1 t:0 @2 t:FFFF tf2:0 @32769 t:8000 tf2:0 @32770 t:FFFF tf2:1
        DCEN, RCAP2 FFFF down      | mod=01 con=04 tl=FF th=FF rl=FF rh=FF EX=0 @1 t:FFFF exf2:1 @2 exf2:0 @5 exf2:1
        DCEN, turned               | mod=01 con=04 @5 t:5 EX=0 @6 t:4 @8 t:2 EX=1 @9 t:3
        DCEN, turned in the cycle  | mod=01 con=04 @5 EX=0 @6 t:4 EX!1 t:6
        DCEN, reported too late    | mod=01 con=04 @5 EX!0 t:5 @6 t:4
        DCEN, EXEN2 is deaf        | mod=01 con=0C tl=9 rl=3 EX=0 @1 t:8 exf2:0 next:6
        DCEN, far                  | mod=01 con=04 EX=0 rl=00 rh=F0 tl=FF th=FF @2^50 t:FFFF tf2:1 exf2:0

        baud, states               | con=14 rl=00 rh=FF @1 t:5 @2 t:B overflow1:65541 next:never
        baud, S6 before a write    | con=14 rl=00 rh=FF @1 t:5 con=10 t:6 @9 t:6
        baud, reload               | con=24 tl=FE th=FF rl=FD rh=FF overflow1:7 overflow2:10 by6:0 by7:1 by13:3 @1 t:FFFD by10:2 tf2:0
        baud, period 1             | con=34 tl=FF th=FF rl=FF rh=FF overflow1:6 overflow9:14 @1 by10:5 overflow5:10 overflow6:11 @2 by16:11
        baud, edge of T2EX         | con=1C rl=44 rh=44 EX=0 next:1 @1 t:5 exf2:1 rcap:4444 since:1
        baud, CP/RL2 has no say    | con=15 tl=FF th=FF rl=00 rh=80 @1 t:8004 by10:1 tf2:0
        baud, DCEN has no say      | mod=01 con=14 EX=0 @1 t:5
        baud, counter              | con=16 tl=FF th=FF rl=FE rh=FF T2=0 overflow1:14 overflow2:never by13:0 by14:1 @2 t:FFFE by16:1 tf2:0 next:never
        baud, stopped              | con=10 tl=FF @9 t:FF overflow1:never
        baud, far                  | con=14 rl=00 rh=80 @2^50 t:FFFF by6755399441055748:206158430206
        reload is no baud          | con=04 tl=FF th=FF overflow1:never by99:0 @1 by10:0

        clock out                  | mod=02 con=04 rl=FD rh=FF tl=FF th=FF out:1 toggle:6 @1 t:FFFE out:1 toggle:12 by10:2 @2 out:1 toggle:18
        clock out, odd             | mod=02 con=04 rl=FA rh=FF tl=FA th=FF toggle:11 @1 out:1 toggle:17 @2 out:0 toggle:23 tf2:0
        clock out, S6 and a write  | mod=02 con=04 rl=FA rh=FF tl=FA th=FF @1 out:1 con=00 out:0 toggle:never @9 out:0
        clock out, stopped         | mod=02 con=00 tl=FF th=FF out:1 toggle:never @9 out:1
        clock out, counter         | mod=02 con=06 out:FF toggle:never T2=0 @2 t:1 by16:0
        clock out, not enabled     | con=04 out:FF toggle:never
        clock out and baud         | mod=02 con=34 tl=FF th=FF rl=FF rh=FF overflow1:6 toggle:6 @1 out:0
        clock out, edge of T2EX    | mod=02 con=0D tl=9 EX=0 @1 t:E rcap:0 exf2:1
        baud toggles no clock      | con=14 tl=FF th=FF @1 by10:1 mod=02 out:1
        ",
    );
}

#[test]
fn time_does_not_go_back_and_has_no_end() {
    let out = &mut Mcs51Outbox::new();
    let mut timer = Mcs51Timer2::new(100);
    timer.write(sfr::T2CON, 0x1C, 0xFF, 100, out);
    timer.advance_to(110);
    timer.advance_to(50);
    assert_eq!(timer.peek(sfr::TL2, 110), 59);
    let mut last = timer.clone();
    last.advance_to(u64::MAX);
    assert_eq!(last.t2con() & 0x40, 0, "no edge, however long");
    timer.on_line_changed(pin::T2EX, false, 3, out);
    timer.advance_to(u64::MAX);
    assert_eq!(timer.t2con() & 0x40, 0, "an edge reported too late is not an edge of the cycles gone");

    let mut counter = Mcs51Timer2::new(100);
    counter.write(sfr::T2CON, 0x06, 0xFF, 100, out);
    counter.on_line_changed(pin::T2, false, 3, out);
    counter.advance_to(101);
    assert_eq!(counter.peek(sfr::TL2, 101), 1, "an edge reported too late is one of the cycle synced to");
}
