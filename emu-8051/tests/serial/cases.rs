//! Cases computed by hand, one per line, with clocks of one tick per machine cycle: the transmitter rolls
//! over in the cycles 16, 32, 48 and so on unless a case says otherwise.

use std::collections::BTreeMap;

use emu_8051::periph::serial::{RI, SerialLine, SerialPort, SerialStep, TI};
use emu_core::NEVER;
use emu_test_support::case_lines;

/// Each line is `name | script | result`. In a script, `N` is the cycle of the words after it: `scon=XX`,
/// `sbuf=XX` are writes at its end, `r0`, `r1` levels of RXD from its start, `/bits` sixteen cycles per bit
/// on RXD, `.bits` one cycle per bit, and `?` prints SCON, SBUF and the time of the flags at its end. The
/// case ends after the last number. In a result, `N T0`, `N.4 R1` are edges (clock 0 is left out), `N TI`,
/// `N RI sbuf rb8`, `N sent byte`; `N ^` is a pulse of the shift clock, low from clock 4 to 10.
const CASES: &str = "
# Modes 1 to 3: sending
mode 1, 10 bits, TI as the stop bit begins | 0 scon=40 sbuf=A5 200 | 17 T0, 33 T1, 49 T0, 65 T1, 81 T0, 113 T1, 129 T0, 145 T1, 160 TI, 176 sent A5
the last bit is low: the stop bit is an edge | 0 scon=40 sbuf=7F 200 | 17 T0, 33 T1, 145 T0, 160 TI, 161 T1, 176 sent 7F
the write in the cycle of a rollover waits for the next one | 0 scon=40 16 sbuf=FF 200 | 33 T0, 49 T1, 176 TI, 192 sent FF
the write before a rollover begins there | 0 scon=40 15 sbuf=FF 200 | 17 T0, 33 T1, 160 TI, 176 sent FF
mode 2, TB8 is 0 | 0 scon=80 sbuf=FF 200 | 17 T0, 33 T1, 161 T0, 176 TI, 177 T1, 192 sent FF
mode 3, TB8 is 1 | 0 scon=C8 sbuf=00 200 | 17 T0, 161 T1, 176 TI, 192 sent 00
TB8 is taken at the write to SBUF | 0 scon=C8 sbuf=00 1 scon=C0 200 | 17 T0, 161 T1, 176 TI, 192 sent 00
TB8 set after the write comes too late | 0 scon=C0 sbuf=00 1 scon=C8 200 | 17 T0, 176 TI, 177 T1, 192 sent 00
a byte written in the stop bit begins when it has lasted one bit | 0 scon=40 sbuf=FF 165 sbuf=00 350 | 17 T0, 33 T1, 160 TI, 176 sent FF, 177 T0, 321 T1, 336 sent 00
TI stays: its moment is the first one | 0 scon=40 sbuf=FF 165 sbuf=FF 350 ? | 17 T0, 33 T1, 160 TI, 176 sent FF, 177 T0, 193 T1, 336 sent FF, 350 scon=42 sbuf=00 since=160
TI cleared is set again | 0 scon=40 sbuf=FF 165 scon=40 sbuf=FF 325 ? | 17 T0, 33 T1, 160 TI, 176 sent FF, 177 T0, 193 T1, 320 TI, 325 scon=42 sbuf=00 since=320
a write in mid-byte: the old byte ends there without TI | 0 scon=40 sbuf=FF 70 sbuf=FE 260 | 17 T0, 33 T1, 81 T0, 113 T1, 224 TI, 240 sent FE
a write in the last data bit spoils it still | 0 scon=40 sbuf=FF 159 sbuf=FF 340 | 17 T0, 33 T1, 161 T0, 177 T1, 304 TI, 320 sent FF
two writes before the rollover: the second counts | 0 scon=40 sbuf=00 5 sbuf=FF 200 | 17 T0, 33 T1, 160 TI, 176 sent FF
a change of mode ends the byte, line high | 0 scon=40 sbuf=00 50 scon=C0 400 | 17 T0, 51 T1
a change of mode before the rollover drops the byte | 0 scon=40 sbuf=00 5 scon=C0 400 |
a change of mode in the stop bit: the byte is sent | 0 scon=40 sbuf=FF 165 scon=00 400 | 17 T0, 33 T1, 160 TI, 165 sent FF
TI by program: seen from the next cycle on | 7 scon=42 9 ? | 9 scon=42 sbuf=00 since=8
the earlier of both flags counts | 7 scon=42 12 scon=43 13 ? 14 scon=41 15 ? 16 scon=40 17 ? | 13 scon=43 sbuf=00 since=8, 15 scon=41 sbuf=00 since=13, 17 scon=40 sbuf=00 since=-

# Modes 1 to 3: receiving. An edge sampled in cycle n: votes at n + 9, n + 25, .., the tenth at n + 153.
mode 1, 35h and its stop bit | 0 scon=50 20 /0101011001 400 ? | 173 RI 35 1, 400 scon=55 sbuf=35 since=173
mode 1, A5h | 0 scon=50 20 /0101001011 400 | 173 RI A5 1
mode 1, REN is 0 | 0 scon=40 20 /0101011001 400 |
mode 1, a bad stop bit goes to RB8 | 0 scon=50 20 /0111111110 180 r1 400 | 173 RI FF 0
mode 1, SM2: a frame with a bad stop bit is lost | 0 scon=70 20 /0111111110 180 r1 400 ? | 400 scon=70 sbuf=00 since=-
mode 1, SM2: a good one is not | 0 scon=70 20 /0111111111 400 | 173 RI FF 1
overrun: RI still set, the old byte stays | 0 scon=50 20 /0100000001 190 /0010000001 400 ? | 173 RI 01 1, 400 scon=55 sbuf=01 since=173
RI cleared in time | 0 scon=50 20 /0100000001 180 scon=50 190 /0010000001 400 | 173 RI 01 1, 343 RI 02 1
RI cleared in the cycle before the vote | 0 scon=51 20 /0100000001 172 scon=50 400 | 173 RI 01 1
RI cleared in the cycle of the vote comes too late | 0 scon=51 20 /0100000001 173 scon=50 400 |
a break is one frame of zeros | 0 scon=50 20 r0 900 | 173 RI 00 0
after a break the line must rise first | 0 scon=50 20 r0 300 scon=50 600 r1 620 /0111111111 900 | 173 RI 00 0, 773 RI FF 1
two samples of three: start bit kept | 0 scon=50 20 .0000000001001111 36 /111111111 400 | 173 RI FF 1
two of three high: no start bit, idle from the vote on | 0 scon=50 20 .0000000110111111 36 /111111111 400 |
the samples beside the three do not count | 0 scon=50 20 .0111111000111111 36 .0000000111000000 52 /01111111 400 | 173 RI FD 1
after a false start the next edge may come at once | 0 scon=50 20 .0111111111 30 /0100000001 400 | 183 RI 01 1
mode 1 looks for an edge from the middle of the stop bit on | 0 scon=50 20 /010000000 164 .1111111111 174 r0 176 scon=50 183 r1 400 | 173 RI 01 1, 327 RI FF 1
mode 3, ninth bit 1, RI at its vote | 0 scon=D0 20 /00101010111 400 ? | 173 RI AA 1, 400 scon=D5 sbuf=AA since=173
mode 3, ninth bit 0 | 0 scon=D0 20 /00101010101 400 ? | 173 RI AA 0, 400 scon=D1 sbuf=AA since=173
mode 2, the stop bit does not matter | 0 scon=90 20 /00101010110 196 r1 400 | 173 RI AA 1
mode 2, SM2: ninth bit 0 is lost | 0 scon=B0 20 /00101010101 400 ? | 400 scon=B0 sbuf=00 since=-
mode 2, SM2: ninth bit 1 is not | 0 scon=B0 20 /00101010111 400 | 173 RI AA 1
modes 2 and 3 look again one bit later: an edge in between is none | 0 scon=D0 20 /0010101011 180 r0 181 scon=D0 189 r1 500 | 173 RI AA 1
an edge at the last tick of that bit is none | 0 scon=D0 20 /0010101011 180 scon=D0 188 r1 189 r0 198 r1 500 | 173 RI AA 1
an edge after it is one | 0 scon=D0 20 /0010101011 180 scon=D0 188 r1 190 r0 199 r1 500 | 173 RI AA 1, 343 RI FF 1
REN cleared in mid-frame ends it | 0 scon=50 20 /0111111111 100 scon=40 101 scon=50 400 |
REN set while the line is low begins no frame | 0 scon=40 20 r0 30 scon=50 400 |
a change of mode in mid-frame ends it | 0 scon=50 20 /0111111111 100 scon=D0 400 |
both directions at once | 0 scon=50 sbuf=FF 20 /0010000001 180 | 17 T0, 33 T1, 160 TI, 173 RI 02 1, 176 sent FF

# Mode 0
sending 0Bh: 8 cycles, after one full cycle, then TI | 10 scon=00 sbuf=0B 30 ? | 12 ^, 13 ^, 14 R0, 14 ^, 15 R1, 15 ^, 16 R0, 16 ^, 17 ^, 18 ^, 19 ^, 20 R1, 20 TI, 20 sent 0B, 30 scon=02 sbuf=00 since=20
the first bit is low | 10 sbuf=FE 25 | 12 R0, 12 ^, 13 R1, 13 ^, 14 ^, 15 ^, 16 ^, 17 ^, 18 ^, 19 ^, 20 TI, 20 sent FE
a write in mid-byte begins anew | 10 sbuf=00 13 sbuf=FF 25 | 12 R0, 12 ^, 13 ^, 14 R1, 15 ^, 16 ^, 17 ^, 18 ^, 19 ^, 20 ^, 21 ^, 22 ^, 23 TI, 23 sent FF
a change of mode in mid-byte | 10 sbuf=00 13 scon=40 25 | 12 R0, 12 ^, 13 ^, 14 R1
reception begins when REN is set | 5 r0 10 scon=10 12 .10100000 25 ? | 12 ^, 13 ^, 14 ^, 15 ^, 16 ^, 17 ^, 18 ^, 19 ^, 20 RI 05 0, 25 scon=11 sbuf=05 since=20
reception begins when RI is cleared | 5 scon=11 10 scon=10 19 r0 25 | 12 ^, 13 ^, 14 ^, 15 ^, 16 ^, 17 ^, 18 ^, 19 ^, 20 RI 7F 0
RI is set: no reception | 10 scon=11 50 |
REN cleared ends it | 10 scon=10 14 scon=00 40 | 12 ^, 13 ^, 14 ^
another write to SCON does not restart it | 10 scon=10 14 scon=18 25 | 12 ^, 13 ^, 14 ^, 15 ^, 16 ^, 17 ^, 18 ^, 19 ^, 20 RI FF 0
both at once: the pin shows what is sent | 10 scon=10 sbuf=F5 25 | 12 ^, 13 R0, 13 ^, 14 R1, 14 ^, 15 R0, 15 ^, 16 R1, 16 ^, 17 ^, 18 ^, 19 ^, 20 TI, 20 RI F5 0, 20 sent F5
";

/// Notes the effects of a step in `cycle`, in the order within the cycle.
fn note(said: &mut Vec<(u64, u8, String)>, cycle: u64, step: SerialStep, port: &SerialPort) {
    for edge in step.edges() {
        let (cycle, phase) = (edge.at.cycle, edge.at.phase);
        match (edge.line, edge.level, phase) {
            (SerialLine::Txd, level, 0) => said.push((cycle, 0, format!("T{}", u8::from(level)))),
            (SerialLine::Rxd, level, 0) => said.push((cycle, 0, format!("R{}", u8::from(level)))),
            (SerialLine::Txd, false, 4) => said.push((cycle, 4, "^".into())),
            (SerialLine::Txd, true, 10) => {}
            _ => said.push((cycle, phase, format!("{edge:?}"))),
        }
    }
    if step.flags & TI != 0 {
        said.push((cycle, 11, "TI".into()));
    }
    if step.flags & RI != 0 {
        said.push((cycle, 11, format!("RI {:02X} {}", port.sbuf(), port.scon() >> 2 & 1)));
    }
    if let Some(byte) = step.sent_byte {
        said.push((cycle, 12, format!("sent {byte:02X}")));
    }
}

/// Runs a script and prints what happens.
fn run(script: &str) -> String {
    let mut acts: BTreeMap<u64, Vec<&str>> = BTreeMap::new();
    let mut wire: BTreeMap<u64, bool> = BTreeMap::new();
    let mut at = 0;
    for word in script.split_whitespace() {
        match word.split_at(1) {
            ("/", bits) => wire.extend(bits.bytes().zip(0..).map(|(bit, n)| (at + 16 * n, bit == b'1'))),
            (".", bits) => wire.extend(bits.bytes().zip(0..).map(|(bit, n)| (at + n, bit == b'1'))),
            ("r", bit) => drop(wire.insert(at, bit == "1")),
            ("s" | "?", _) => acts.entry(at).or_default().push(word),
            _ => at = word.parse().expect("a cycle"),
        }
    }
    let mut port = SerialPort::new();
    let mut level = true;
    let mut said: Vec<(u64, u8, String)> = Vec::new();
    for cycle in 0..=at {
        if let Some(&new) = wire.get(&cycle) {
            level = new;
            port.set_rxd_level(level);
        }
        if port.next_shift_cycle() == cycle {
            let step = port.step_shifter(cycle, level);
            note(&mut said, cycle, step, &port);
        }
        // The first tick is in cycle 1.
        if cycle > 0 {
            if port.tx_ticks_to_next_step() == Some(1) {
                let step = port.step_transmitter(cycle);
                note(&mut said, cycle, step, &port);
            } else {
                port.tx_advance(1);
            }
            if port.rx_ticks_to_next_step() == Some(1) {
                let step = port.step_receiver(cycle, level);
                note(&mut said, cycle, step, &port);
            } else {
                port.rx_advance(1);
            }
        }
        for act in acts.get(&cycle).into_iter().flatten() {
            match act.split_once('=') {
                Some(("scon", v)) => {
                    let step = port.set_scon(u8::from_str_radix(v, 16).expect("hex"), cycle);
                    note(&mut said, cycle, step, &port);
                }
                Some(("sbuf", v)) => {
                    let step = port.write_sbuf(u8::from_str_radix(v, 16).expect("hex"), cycle);
                    note(&mut said, cycle, step, &port);
                }
                _ => {
                    let since =
                        if port.flags_set_since() == NEVER { "-".into() } else { port.flags_set_since().to_string() };
                    let text = format!("scon={:02X} sbuf={:02X} since={since}", port.scon(), port.sbuf());
                    said.push((cycle, 13, text));
                }
            }
        }
    }
    said.sort_by_key(|(cycle, phase, _)| (*cycle, *phase));
    said.into_iter().map(|(cycle, _, text)| format!("{cycle} {text}")).collect::<Vec<_>>().join(", ")
}

#[test]
fn cases_of_the_manual() {
    let mut wrong = String::new();
    let mut count = 0;
    for line in case_lines(CASES) {
        let mut parts = line.split('|').map(str::trim);
        let (Some(what), Some(script), Some(want)) = (parts.next(), parts.next(), parts.next()) else {
            panic!("three parts: {line}");
        };
        let got = run(script);
        if got != want {
            wrong += &format!("{what}\n  script {script}\n  want   {want}\n  got    {got}\n");
        }
        count += 1;
    }
    assert!(wrong.is_empty() && count > 50, "of {count} cases:\n{wrong}");
}

/// An idle port accepts any number of ticks at once.
#[test]
fn far_distances_cost_nothing() {
    const FAR: u64 = 1 << 50;
    let mut port = SerialPort::new();
    let _ = port.set_scon(0x50, 0);
    port.tx_advance(FAR + 5);
    port.rx_advance(FAR);
    assert_eq!((port.tx_ticks_to_next_step(), port.rx_ticks_to_next_step()), (None, None));
    let _ = port.write_sbuf(0xFF, FAR);
    // 2^50 + 5 ticks leave 11 to the next rollover.
    assert_eq!(port.tx_ticks_to_next_step(), Some(11));
    port.set_rxd_level(false);
    assert_eq!(port.rx_ticks_to_next_step(), Some(1));
    let _ = port.step_receiver(FAR, false);
    assert_eq!(port.rx_ticks_to_next_step(), Some(9));
    port.set_rxd_level(true);
    port.rx_advance(6);
    port.set_rxd_level(false);
    port.rx_advance(2);
    let _ = port.step_receiver(FAR + 9, false);
    assert_eq!(port.rx_ticks_to_next_step(), Some(144));
    port.rx_advance(143);
    assert_eq!(port.step_receiver(FAR + 153, false).flags, 1);
    // The frame is complete, and the line stays low.
    port.rx_advance(FAR);
    assert_eq!(
        (port.rx_ticks_to_next_step(), port.flags_set_since(), port.next_shift_cycle()),
        (None, FAR + 153, NEVER)
    );
}
