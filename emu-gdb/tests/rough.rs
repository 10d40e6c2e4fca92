//! Clients that are not gdb: whatever they send, the server ends normally and does not panic. `EMU_SEED` and
//! `EMU_CLIENTS` select other clients and their number.

mod machine;

use std::fmt::Write as _;
use std::io::Write;
use std::net::{Shutdown, TcpStream};

use emu_core::rng::Rng;

/// Packets that gdb sends; `#` is replaced by a number, `~` by bytes.
const PACKETS: &[&str] = &[
    "qSupported:multiprocess+;swbreak+;hwbreak+;xmlRegisters=i386",
    "?",
    "g",
    "G~",
    "p#",
    "P#=~",
    "m#,#",
    "M#,#:~",
    "X#,#:~",
    "x#,#",
    "Z0,#,#",
    "Z1,#,#",
    "Z2,#,#",
    "Z3,#,#",
    "Z4,#,#",
    "Z5,#,#",
    "z0,#,#",
    "z1,#,#",
    "z2,#,#",
    "z3,#,#",
    "z4,#,#",
    "z,,",
    "vCont?",
    "vCont;c",
    "vCont;s:1",
    "vCont;s:p1.1",
    "vCont;r#,#:1",
    "vCont;C05",
    "vCont;S#:1",
    "vCont;t",
    "vCont;",
    "vCont",
    "c",
    "c#",
    "s",
    "s#",
    "C05",
    "S05",
    "bs",
    "bc",
    "D",
    "D;1",
    "k",
    "vKill;1",
    "!",
    "R00",
    "r",
    "T1",
    "Tp1.1",
    "T#",
    "Hg0",
    "Hc-1",
    "Hg-1",
    "Hgp#.#",
    "H",
    "qC",
    "qfThreadInfo",
    "qsThreadInfo",
    "qAttached",
    "qAttached:1",
    "qOffsets",
    "qSymbol::",
    "qTStatus",
    "qCRC:#,#",
    "qXfer:features:read:target.xml:#,#",
    "qXfer:features:read:~:#,#",
    "qXfer:memory-map:read::#,#",
    "qXfer:",
    "qXfer:features:write:target.xml:#:~",
    "qRcmd,~",
    "qRcmd,6261636b2039",
    "qRcmd,676f746f20393939",
    "qRcmd,726573657420",
    "qRcmd",
    "qRcmd,706565 6b20646174613a302e2e39393939",
    "vFlashErase:#,#",
    "vFlashWrite:#:~",
    "vFlashDone",
    "vFile:open:~,0,0",
    "vRun;~",
    "QStartNoAckMode",
    "QNonStop:1",
    "QPassSignals:#",
    "vAttach;#",
    "vMustReplyEmpty",
    "vCtrlC",
    "jThreadsInfo",
    "qRegisterInfo#",
];

fn number(rng: &mut Rng) -> String {
    const EDGES: [u64; 12] =
        [0, 1, 2, 4, 0x100, 0x7fff, 0x8000, 0x80_0000, 0x80_0100, 0x81_0000, 0xffff_ffff, u64::MAX];
    match rng.next_u64() % 6 {
        0 => format!("{:x}", rng.next_u64() % 0x8000),
        1 => format!("{:x}", 0x80_0000 + rng.next_u64() % 0x900),
        2 => format!("{:x}", rng.next_u64()),
        3 => "ffffffffffffffffffffffffff".to_owned(),
        _ => format!("{:x}", EDGES[rng.next_u64() as usize % EDGES.len()]),
    }
}

/// A random packet, usually one that gdb might send.
fn packet(rng: &mut Rng) -> Vec<u8> {
    let mut body = Vec::new();
    for c in PACKETS[rng.next_u64() as usize % PACKETS.len()].bytes() {
        match c {
            b'#' => body.extend(number(rng).bytes()),
            b'~' => {
                let hex = (0..rng.next_u64() % 40).fold(String::new(), |mut hex, _| {
                    _ = write!(hex, "{:02x}", rng.next_u64() as u8);
                    hex
                });
                body.extend(hex.bytes());
            }
            c => body.push(c),
        }
    }
    if rng.one_in(4) && !body.is_empty() {
        let at = rng.next_u64() as usize % body.len();
        match rng.next_u64() % 3 {
            0 => body[at] = rng.next_u64() as u8,
            1 => body.truncate(at),
            _ => body.insert(at, rng.next_u64() as u8),
        }
    }
    let sum = body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
    let mut bytes = [b"$", body.as_slice(), format!("#{sum:02x}").as_bytes()].concat();
    match rng.next_u64() % 24 {
        0 => bytes.push(0x03),
        1 => bytes.push(b'-'),
        2 => bytes.truncate(rng.next_u64() as usize % bytes.len()),
        3 => bytes = (0..rng.next_u64() % 9000).map(|_| rng.next_u64() as u8).collect(),
        _ => {}
    }
    bytes
}

fn client(chip: &str, program: &str, seed: u64) {
    let chip = machine::chip(chip);
    let (address, server) =
        machine::serving(chip, emu_asm::assemble_text(chip, program).expect("a program"), false, |_| {});
    let mut stream = TcpStream::connect(address).expect("a server");
    let mut reader = stream.try_clone().expect("a socket");
    // Some clients never read the answers.
    let drain = (!seed.is_multiple_of(3))
        .then(|| std::thread::spawn(move || _ = std::io::copy(&mut reader, &mut std::io::sink())));
    let mut rng = Rng::new(seed);
    for _ in 0..40 {
        if stream.write_all(&packet(&mut rng)).is_err() {
            break;
        }
    }
    _ = stream.shutdown(if seed.is_multiple_of(2) { Shutdown::Both } else { Shutdown::Write });
    let ended = server.join();
    assert!(ended.is_ok_and(|text| text.starts_with("the client ")), "{} EMU_SEED={seed}", chip.name);
    drop(stream);
    if let Some(drain) = drain {
        drain.join().expect("no panic");
    }
}

#[test]
fn clients_that_are_none() {
    let wanted = |name: &str, or: u64| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(or);
    let first = wanted("EMU_SEED", 1);
    for seed in first..first + wanted("EMU_CLIENTS", 60) {
        match seed % 3 {
            0 => client("atmega328p", "ldi r16, 0x40\nloop: sts 0x100, r16\ninc r16\nrjmp loop\n", seed),
            1 => client("at89s52", "loop: inc 30h\nsjmp loop\n", seed),
            _ => client("pic16f873", "loop: incf 0x20, f\ngoto loop\n", seed),
        }
    }
}
