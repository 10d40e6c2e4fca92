//! Cases for timers 0 and 1, computed by hand (user's manual, "Timer/Counters").

use crate::table::{TimerUnderTest, check};
use emu_8051::periph::map::{pin, sfr};
use emu_8051::periph::timer::Mcs51Timers;
use emu_8051::periph::{Device, Mcs51Outbox};
use emu_core::NEVER;

/// The direct address of a register.
fn address(name: &str) -> Option<u8> {
    let names = ["tmod", "tl0", "tl1", "th0", "th1"];
    names.iter().position(|&known| known == name).map(|at| sfr::TMOD + at as u8)
}

impl TimerUnderTest for Mcs51Timers {
    fn sync(&mut self, cycle: u64) {
        self.advance_to(cycle);
    }

    fn get(&self, name: &str) -> u64 {
        if let Some(reg) = address(name) {
            return self.peek(reg, 0).into();
        }
        match name {
            "tr0" => u64::from(self.run(0)),
            "tr1" => u64::from(self.run(1)),
            "tf0" => u64::from(self.flag(0)),
            "tf1" => u64::from(self.flag(1)),
            "since0" => self.flag_set_since(0),
            "since1" => self.flag_set_since(1),
            "next0" => self.next_flag(0),
            "next1" => self.next_flag(1),
            _ => match (name.strip_prefix("overflow"), name.strip_prefix("by")) {
                (Some(k), _) => self.ticks().cycle_of(k.parse().expect("a number")),
                (_, Some(now)) => self.ticks().count_by_cycle(now.parse().expect("a number")),
                _ => panic!("no {name}"),
            },
        }
    }

    fn set(&mut self, name: &str, value: u8) {
        match name {
            "tr0" => self.set_run(0, value != 0),
            "tr1" => self.set_run(1, value != 0),
            "tf0" => self.set_flag(0, value != 0),
            "tf1" => self.set_flag(1, value != 0),
            _ => self.write(address(name).expect(name), value, 0xFF, 0, &mut Mcs51Outbox::new()),
        }
    }

    fn pin(&mut self, name: &str, level: bool, cycle: u64) {
        let line = match name {
            "T0" => pin::T0,
            "T1" => pin::T1,
            "INT0" => pin::INT0,
            "INT1" => pin::INT1,
            _ => panic!("no {name}"),
        };
        self.on_line_changed(line, level, cycle, &mut Mcs51Outbox::new());
    }

    fn decimal(&self, name: &str) -> bool {
        ["since", "next", "overflow", "by"].iter().any(|start| name.starts_with(start))
    }
}

#[test]
fn by_hand() {
    check(
        || Mcs51Timers::new(0),
        "
        reset                      | tmod:0 tl0:0 th0:0 tl1:0 th1:0 tr0:0 tr1:0 tf0:0 tf1:0 next0:never next1:never since0:never
        stopped                    | tmod=11 @500 tl0:0 tl1:0 tf0:0
        first count after SETB     | @10 tmod=01 tr0=1 tl0:0 @11 tl0:1 @12 tl0:2
        last count after CLR       | tmod=01 tr0=1 @7 tr0=0 tl0:7 @8 tl0:7 @9 tl0:7

        mode 0, five bits carry    | tl0=1E tr0=1 @1 tl0:1F th0:0 @2 tl0:20 th0:1 @34 tl0:40 th0:2
        mode 0, upper bits of TL   | tl0=FF th0=10 tr0=1 @1 tl0:0 th0:11
        mode 0, upper bits stay out| tl0=E0 th0=FF tr0=1 next0:32 @31 tl0:FF th0:FF tf0:0 @32 tl0:0 th0:0 tf0:1 since0:32
        mode 0, from 0             | tr0=1 next0:8192 @8191 tf0:0 th0:FF tl0:FF @8192 tf0:1 th0:0 tl0:0 next0:16384
        mode 0, timer 1            | tl1=1F th1=FF tr1=1 next1:1 @1 tf1:1 tf0:0 by1:1 overflow2:8193 overflow3:16385

        mode 1                     | tmod=01 tl0=FE th0=FF tr0=1 next0:2 @1 tl0:FF th0:FF tf0:0 @2 tl0:0 th0:0 tf0:1 since0:2
        mode 1, carry              | tmod=01 tl0=FF th0=12 tr0=1 @1 tl0:0 th0:13 tf0:0
        mode 1, no reload          | tmod=10 tl1=FF th1=FF tr1=1 next1:1 @1 tf1:1 next1:65537 overflow2:65537 overflow4:196609
        mode 1, far                | tmod=01 tr0=1 @2^50 tl0:0 th0:0 tf0:1 since0:65536
        mode 1, clear and again    | tmod=01 tl0=FF th0=FF tr0=1 @1 tf0:1 tf0=0 tf0:0 since0:never next0:65537 @65537 since0:65537
        mode 1, set stays since    | tmod=01 tl0=FF th0=FF tr0=1 @65600 tf0:1 since0:1 next0:131073
        cleared in its own cycle   | tmod=01 tl0=FE th0=FF tr0=1 @2 tf0:1 tf0=0 @3 tf0:0
        TL written as it counts    | tmod=01 tl0=10 tr0=1 @5 tl0:15 tl0=FF @6 tl0:0 th0:1
        TF written                 | @9 tf0=1 tf0:1 since0:10 @20 tf0=1 since0:10 next0:never

        mode 2                     | tmod=02 tl0=FE th0=F0 tr0=1 @1 tl0:FF tf0:0 @2 tl0:F0 th0:F0 tf0:1 since0:2 next0:18 @18 tl0:F0
        mode 2, TH FF              | tmod=20 tl1=FF th1=FF tr1=1 @1 tl1:FF by1:1 @9 tl1:FF by9:9 overflow12:12 by20:20
        mode 2, TH 0               | tmod=20 tr1=1 next1:256 @256 tl1:0 by256:1 overflow3:768 by767:2 by768:3
        mode 2, overflows past     | tmod=20 tl1=FF th1=FD tr1=1 @10 by10:4 overflow4:10 overflow5:13 overflow4:10
        mode 2, far                | tmod=20 tl1=0 th1=F3 tr1=1 @2^50 tf1:1 since1:256 by1125899906842624:86607685141721

        mode 3, two halves         | tmod=03 tl0=FE th0=FD tr0=1 tr1=1 @2 tl0:0 tf0:1 th0:FF tf1:0 @3 th0:0 tf1:1 tl0:1 since1:3
        mode 3, TH0 without TR1    | tmod=03 th0=FF tr0=1 @9 th0:FF tf1:0 next1:never
        mode 3, TH0 has no gate    | tmod=8B th0=FE tr1=1 INT0=0 INT1=0 next1:2 @2 th0:0 tf1:1 tl0:0 tl1:0
        mode 3, TL0 alone          | tmod=03 tl0=FF th0=77 tr0=1 @1 tl0:0 th0:77 tf0:1 next0:257
        mode 3, timer 1 runs       | tmod=23 tl1=FE th1=FC @2 tl1:FC tf1:0 by2:1 next1:never overflow2:6 @6 by6:2 tf1:0
        mode 3, timer 1 in mode 1  | tmod=13 tl1=FF th1=FF @1 tl1:0 th1:0 tf1:0 by1:1 overflow2:65537
        mode 3, timer 1 gated      | tmod=93 INT1=0 @5 tl1:0 INT1=1 @8 tl1:3
        mode 3, both               | tmod=33 tl1=12 tr0=1 tr1=1 @5 tl1:12 tl0:5 th0:5 overflow1:never
        mode 3 of timer 1          | tmod=30 tl1=FF th1=FF tr1=1 @9 tl1:FF tf1:0 next1:never overflow1:never tmod=10 @10 tl1:0 tf1:1
        mode 3 left                | tmod=03 tr1=1 @4 th0:4 tl1:4 tmod=01 @5 th0:4 tl1:5

        gate, pin high             | tmod=09 tr0=1 @3 tl0:3
        gate, pin low              | tmod=09 tr0=1 INT0=0 @3 tl0:0 next0:never
        gate, pulse of three       | tmod=09 tr0=1 INT0=0 @10 INT0=1 @13 INT0=0 @20 tl0:3
        gate without TR            | tmod=90 INT1=0 @3 INT1=1 @9 tl1:0
        gate of the other          | tmod=19 tr0=1 tr1=1 INT1=0 @3 tl0:3 tl1:3
        no gate, pin low           | tmod=11 tr1=1 INT1=0 @3 tl1:3
        gate, taken back           | tmod=09 tr0=1 INT0=0 @1 tl0:0 INT0!1 tl0:1 @2 tl0:2
        gate, written, taken back  | tmod=09 tr0=1 INT0=0 tl0=50 @1 tl0:50 INT0!1 tl0:51
        gate, taken back too late  | tmod=09 tr0=1 INT0=0 @1 tl0=50 INT0!1 tl0:50 @2 tl0:51
        gate, reported too late    | tmod=09 tr0=1 @10 INT0!0 tl0:A @20 tl0:A
        gate, low after all        | tmod=0A tl0=FF th0=80 tr0=1 INT0=0 INT0=1 @1 tf0:1 tl0:80 INT0!0 tf0:0 tl0:FF since0:never @9 tf0:0

        counter, one edge          | tmod=05 tr0=1 @4 T0=0 @5 tl0:0 @6 tl0:1 @99 tl0:1
        counter, highest rate      | tmod=05 tr0=1 T0=0 @1 T0=1 @2 tl0:1 T0=0 @3 tl0:1 T0=1 @4 tl0:2 T0=0 @5 T0=1 @6 tl0:3
        counter, half a cycle      | tmod=05 tr0=1 T0=0 T0=1 @1 T0=0 T0=1 @5 tl0:0
        counter, low then high     | tmod=05 tr0=1 T0=0 @1 T0!1 @5 tl0:0 T0=0 @9 tl0:1
        counter, high then low     | tmod=05 tr0=1 T0=0 @3 tl0:1 T0=1 @4 T0!0 @9 tl0:1
        counter, overflow          | tmod=50 tl1=FF th1=FF tr1=1 next1:never T1=0 next1:2 overflow1:2 overflow2:never by1:0 by2:1 @2 tf1:1 since1:2
        counter, mode 2            | tmod=06 tl0=FF th0=FE tr0=1 T0=0 @2 tl0:FE tf0:1 T0=1 @3 T0=0 @5 tl0:FF
        counter, not running       | tmod=05 T0=0 @1 @2 tr0=1 @9 tl0:0
        counter, run in time       | tmod=05 T0=0 @1 tr0=1 @2 tl0:1
        counter, stopped in time   | tmod=05 tr0=1 T0=0 @1 tr0=0 @2 tl0:0 tr0=1 @9 tl0:0
        counter, gate              | tmod=0D tr0=1 T0=0 @1 INT0=0 @2 tl0:0 INT0=1 @5 tl0:0
        counter, far               | tmod=05 tr0=1 T0=0 @2^50 tl0:1 th0:0
        counter, mode 3            | tmod=07 tl0=FF tr0=1 T0=0 @2 tl0:0 th0:0 tf0:1 tf1:0
        pins do not mix            | tmod=55 tr0=1 tr1=1 T1=0 @5 tl0:0 tl1:1
        timer takes no edges       | tmod=01 tr0=1 T0=0 @5 tl0:5
        ",
    );
}

#[test]
fn numbers_of_timers_are_masked_and_time_does_not_go_back() {
    let out = &mut Mcs51Outbox::new();
    let mut timers = Mcs51Timers::new(100);
    timers.write(sfr::TMOD, 0x11, 0xFF, 100, out);
    timers.set_run(3, true);
    timers.advance_to(110);
    timers.advance_to(50);
    assert_eq!((timers.peek(sfr::TL0, 110), timers.peek(sfr::TL1, 110)), (0, 10));
    assert_eq!(timers.peek(sfr::TL1, 112), 12, "a peek in the future counts on a copy");
    timers.write(sfr::TL1, 0xF0, 0x30, 110, out);
    assert_eq!(timers.peek(sfr::TL1, 110), 0x3A, "only the bits in the mask");
    timers.write(sfr::TL1, 10, 0xFF, 110, out);
    timers.on_line_changed(pin::T1, false, 3, out);
    timers.advance_to(u64::MAX);
    assert_eq!(timers.next_flag(1), NEVER, "beyond the end of time there is no moment to name");

    let mut counter = Mcs51Timers::new(100);
    counter.write(sfr::TMOD, 0x50, 0xFF, 100, out);
    counter.set_run(1, true);
    counter.on_line_changed(pin::T1, false, 3, out);
    counter.advance_to(101);
    assert_eq!(counter.peek(sfr::TL1, 101), 1, "an edge reported too late is one of the cycle synced to");
}
