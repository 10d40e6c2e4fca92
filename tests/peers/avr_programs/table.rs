//! The programs of examples/avr: their flags, and their expected output, computed here or written by hand.

use std::fmt::Write;

/// A program and its flags for `emu run`.
pub struct Program {
    /// Name of the source and of the image.
    pub name: &'static str,
    /// Flags.
    pub flags: Vec<&'static str>,
}

/// Lines of `name: flags`.
const PROGRAMS: &str = r"
printf:
muldiv:
sort:
millis:
tone:
watchdog:
count:
echo:   --uart-in 1ms:Hello,\x20world\n --uart-in 20ms:again\x04 --baud 38400
boot:
logger: --attach i2c:24c64@0x50
filter: --set A0=1.25V --at 40.5ms:A0=3.1V
nap:    --at 100ms:PD2=0 --at 105ms:PD2=1 --at 400ms:PD2=0 --at 500ms:PD2=1 --at 640ms:PD2=0
";

/// Returns all programs.
pub fn programs() -> Vec<Program> {
    let row = |line: &'static str| {
        let (name, flags) = line.split_once(':').unwrap_or_else(|| panic!("{line}"));
        Program { name, flags: flags.split_whitespace().collect() }
    };
    PROGRAMS.trim().lines().map(row).collect()
}

/// Returns the expected output of a program.
pub fn text(name: &str) -> String {
    match name {
        "printf" => printf(),
        "muldiv" => super::muldiv::text(),
        "sort" => sort(),
        "millis" => (1..=10).map(|n| format!("{} ms\n", 100 * n)).collect(),
        "tone" => "1250 steps\n".to_owned(),
        "watchdog" => "start 1: power\nstart 2: watchdog\nstart 3: watchdog\nwarned\nstart 4: watchdog\n".to_owned(),
        "count" => "counter: start 1\n".to_owned(),
        "echo" => "HELLO, WORLD\nAGAIN\n18 bytes, 0 bad\n".to_owned(),
        "boot" => "boot loader: 63 of 64 bytes differ\npage written: 0 of 64 bytes differ\n\
                   application: hello from page 0\n"
            .to_owned(),
        "logger" => format!("a new log\n{}", log(3)),
        "filter" => filter(),
        // Presses at 100, 400 and 640 ms, ticks every 64 ms; the chip is awake for 22, 22 and 23 bytes of ten
        // bits.
        "nap" => "press 1 after 1 ticks\npress 2 after 6 ticks\npress 3 after 10 ticks\nawake for 17 ms\n".to_owned(),
        _ => panic!("{name} is not known"),
    }
}

/// Returns the first records of the logger.
pub fn log(records: i32) -> String {
    (0..records).map(|n| format!("log {n}: {}\n", 1000 - 7 * n * n)).collect()
}

fn printf() -> String {
    let mut out = String::new();
    for n in [0i16, 7, -42, 12345, i16::MIN] {
        let _ = writeln!(out, "{n}|{n:6}|{n:<6}|{n:06}|{n:+}|{n:x}|{n:o}|{}", n as u16);
    }
    let _ = writeln!(out, "{} {} {:x} abc {:>5}| %", -i32::MAX, u32::MAX, 0xDEAD_BEEFu32, "de");
    let reals = [0.0f32, 1.0, -2.5, std::f32::consts::PI, 1234.5678, 0.001_23];
    // The shorter of %e and %f with six digits, by hand.
    let short = ["0", "1", "-2.5", "3.14159", "1234.57", "0.00123"];
    for (x, short) in reals.into_iter().map(f64::from).zip(short) {
        let _ = writeln!(out, "{x:.4}|{x:10.2}|{}|{short}", scientific(x));
    }
    for x in reals.into_iter().skip(1).map(|x| f64::from(x).abs()) {
        let _ = writeln!(out, "{:.4} {:.4} {:.4} {:.4}", x.sqrt(), x.sin(), x.ln(), x.atan2(2.0));
    }
    out + "inf -inf nan\n"
}

/// Formats a number like C's `%.3e`: exponent with a sign and two digits.
fn scientific(x: f64) -> String {
    let text = format!("{x:.3e}");
    let (mantissa, exponent) = text.split_once('e').expect("an exponent");
    let exponent: i32 = exponent.parse().expect("a number");
    format!("{mantissa}e{}{:02}", if exponent < 0 { '-' } else { '+' }, exponent.abs())
}

fn sort() -> String {
    let mut seed = 1u16;
    let mut numbers: Vec<i16> = (0..100)
        .map(|_| {
            seed = seed.wrapping_mul(25_173).wrapping_add(13_849);
            seed as i16
        })
        .collect();
    numbers.sort_unstable();
    let shown: Vec<String> = numbers.iter().step_by(9).map(i16::to_string).collect();
    let mut out = format!("{}\nfound at 37\napple banana cherry date fig grape pear quince\n", shown.join(" "));
    for start in [2u32, 27, 52] {
        let next = |&n: &u32| (n != 1).then(|| if n % 2 == 1 { 3 * n + 1 } else { n / 2 });
        let steps = std::iter::successors(Some(start), next).count() - 1;
        let _ = writeln!(out, "{start} takes {steps} steps");
    }
    out
}

/// A sample every millisecond, of 1.25 V, from the 41st on of 3.1 V: medians of three, then a low-pass filter
/// with factor 1/8, in sixteenths, with division towards zero.
fn filter() -> String {
    let counts = |n: i32| if n <= 40 { 1250 * 1024 / 5000 } else { 3100 * 1024 / 5000 };
    let (mut out, mut low) = (String::new(), 0);
    for n in 1..=96 {
        let mut three = [n - 2, n - 1, n].map(|n| if n < 1 { 0 } else { counts(n) });
        three.sort_unstable();
        low += (three[1] * 16 - low) / 8;
        if n % 8 == 0 {
            let _ = writeln!(out, "{n:2} ms {:4} {:4}", counts(n) * 5000 / 1024, low / 16 * 5000 / 1024);
        }
    }
    out
}
