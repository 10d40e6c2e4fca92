//! `emu run`: an image on an emulated chip, headless.

use std::io::Write;
use std::time::{Duration, Instant};

use clap::Args;
use emu_core::chip::{Chip, Family};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::Time;
use emu_debug::cod::{Limits, Script};
use emu_debug::run::{run_on, shown};
use emu_debug::stimulus::{Put, drive, put, queue};
use emu_debug::text::unescape;
use emu_debug::until::Until;
use emu_debug::{Board, Clock, Drive, Ended, Names, Plan, Range, Reason, Sender, Source, Wave, time};

use crate::args::Mcu;
use crate::attach::{self, Attached, Bench};
use crate::fail::{Failure, exit};
use crate::family::{self, Job, Setup, on_machine};
use crate::held::held;
use crate::lint::Lint;
use crate::output::Pending;
use crate::report::{Terminal, Texts, report};
use crate::store::{self, Store};
use crate::summary::{self, Story};
use crate::{ap101, avr, cod, input, lint, mcs51, output, pic16};

const EXAMPLES: &str = "\
Examples:
  emu run blink.hex --mcu atmega328p --for 2s --vcd blink.vcd
  emu run hello.elf --mcu atmega328p --uart - --expect-uart 'done\\n' --fail-uart FAIL
  emu run press.hex --mcu atmega328p --set PD2=1 --at 10ms:PD2=0 --until 'pin PB5=1' --for 1s
  emu run app.elf --mcu atmega328p --until pc=main --peek data:0x100..0x120 --json
  emu run app.elf --mcu atmega328p --until pc=main.c:12 --peek buf
  emu run test.ihx --mcu at89s52 --symbols test.map --until 'read xdata:0x7654' --uart -

Exit codes: 0 halted, or what was waited for came, or a limit that was asked for; 1 --fail-uart was seen, or the program
halted while --until or --expect-uart still waited, or --lint=error found something; 4 a fault of the program; 5 a limit
came while something still waited, or the default limit of 60 s of the chip's time, or --timeout.";

/// Simulated time after which a run without a limit ends.
const DEFAULT_LIMIT: &str = "60s";

/// Flags of `emu run`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RunArgs {
    /// A HEX or ELF file, or an assembly source by its name (.asm, .s, .a51, .src), which is assembled on the fly; - is standard
    /// input.
    #[arg(value_name = "IMAGE")]
    image: String,
    #[command(flatten)]
    mcu: Mcu,
    /// End after this much of the chip's time: 2s, 10ms, 2.5us, 100ns, or 1000c (machine cycles). Default 60s.
    #[arg(long = "for", value_name = "TIME", conflicts_with = "cycles")]
    time: Option<String>,
    /// End after this many machine cycles.
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,
    /// Oscillator: 16MHz, 32.768kHz, 8000000. Default: what the chip's row says (`emu chips --json`).
    #[arg(long, value_name = "HZ", value_parser = time::hertz)]
    clock: Option<u64>,
    /// What RAM and registers hold after power-up: random:SEED, zero, or trap: zero, and reading RAM that the program has
    /// not written ends the run with exit code 4.
    #[arg(long, value_name = "FILL", default_value = "zero", value_parser = ram)]
    ram: Ram,
    /// Leave out the start-up times of the oscillator and the power-up timer, on AVR and PIC16: the first instruction runs in cycle
    /// 0.
    #[arg(long)]
    no_start_up: bool,
    /// Drive a pin from the start: PB0=1, P1.0=0, PB0=z (let go), RC3=pullup or pulldown (a resistor, which the chip
    /// overcomes); on AVR and PIC16 also to a voltage: RA0=1.25V, and VDD=4.5V or VCC=4.5V sets the supply. On AVR A0 is the
    /// pin of ADC0, and RESET the reset pin. Repeatable.
    #[arg(long, value_name = "PIN=LEVEL")]
    set: Vec<String>,
    /// Drive a pin from a time on: 10ms:PB0=0, 1000c:PB0=z; levels and voltages as in --set. Repeatable.
    #[arg(long, value_name = "TIME:PIN=LEVEL")]
    at: Vec<String>,
    /// Send bytes to the chip's first serial port from a time on: '10ms:hello\n' (escapes as in --expect-uart), as the edges that a
    /// sender of --baud makes at its receive pin. Repeatable.
    #[arg(long, value_name = "TIME:TEXT")]
    uart_in: Vec<String>,
    /// Bits per second of --uart-in; 8 bits, no parity, a stop bit. It is not the chip's: a wrong one is received wrong.
    #[arg(long, value_name = "RATE", default_value = "9600", requires = "uart_in", value_parser = baud)]
    baud: u64,
    /// End when this comes true: pc=0x1a2 (byte address, on PIC16 a word address), pc=main or pc=main+0x4 (symbol), pc=main.c:12
    /// (source line), fetch=2 (AP101: fetched and not yet executed), 'pin PB5=1' (or 0, or z), 'write data:0x100', 'read xdata:0x7654', 'write buf' (all bytes of a variable),
    /// 'uart "text"'. Repeatable; any of them ends the run.
    #[arg(long, value_name = "COND")]
    until: Vec<String>,
    /// Show memory at the end: data:0x100..0x120 (end excluded), flash:0, sfr:P1, bit:0x20.3; names of registers and of
    /// the program are addresses too, with all bytes of a variable whose size is known: data:buf, data:buf+2, or buf where only
    /// one memory has that name. Repeatable.
    #[arg(long, value_name = "RANGE")]
    peek: Vec<String>,
    /// Names for addresses: for the 8051 family a .map, .cdb or .rst file of SDCC, for the PIC16 family a .cod, .lst or .map
    /// file of gputils. Repeatable.
    #[arg(long, value_name = "FILE")]
    symbols: Vec<String>,
    /// What the EEPROM holds: read before the run, where the file exists, and written back after it, however it ends. Intel HEX
    /// from address 0 on where the name ends in .hex or .eep, else plain bytes.
    #[arg(long, value_name = "FILE")]
    eeprom: Option<String>,
    /// Put a device at the pins of the chip: i2c:24c64@0x50 (24c01 to 24c1024, with resistors at SDA and SCL) or spi:25q32,cs=PB2
    /// (25q80 to 25q128). With ,file=NAME it holds what the file holds, which is written back as with --eeprom. Pins are those
    /// of the chip's interface, or ,sda=PIN,scl=PIN,wp=PIN and ,sck=PIN,mosi=PIN,miso=PIN. Repeatable.
    #[arg(long, value_name = "DEVICE", value_parser = attach::attached)]
    attach: Vec<Attached>,
    /// Write the pins and the bytes sent as a waveform (VCD); - is standard output.
    #[arg(long, value_name = "FILE")]
    vcd: Option<String>,
    /// Write what the chip sends over its first serial port, raw, to a file; with - it alone is standard output.
    #[arg(long, value_name = "FILE")]
    uart: Option<String>,
    /// End well when this was sent; \n \r \t \0 \\ \" \xNN are known. Exit code 1 or 5 when it never comes.
    #[arg(long, value_name = "TEXT", value_parser = |t: &str| unescape(t).map(Text))]
    expect_uart: Option<Text>,
    /// End with exit code 1 when this was sent; escapes as in --expect-uart.
    #[arg(long, value_name = "TEXT", value_parser = |t: &str| unescape(t).map(Text))]
    fail_uart: Option<Text>,
    /// End with exit code 5 after this much of the host's time: 30s, 500ms.
    #[arg(long, value_name = "TIME", value_parser = time::duration)]
    timeout: Option<Duration>,
    /// Tell what the program does that is allowed, but seldom meant, each with its code, place and count. HOW is warn, as it is
    /// without it, or error: a run that would end with exit code 0 then ends with 1. On every chip: RAM that is read before it
    /// was written. On AVR also registers, the stack over data or heap, reserved addresses and bits, baud rates, interrupts
    /// without a service routine, pins that float. On PIC16 also analog pins that are read, latches changed along with others, the stack, PCLATH, service
    /// routines that do not save W, STATUS or PCLATH, SLEEP that does nothing.
    #[arg(long, value_name = "HOW", num_args = 0..=1, require_equals = true, default_missing_value = "warn")]
    #[arg(hide_possible_values = true)]
    lint: Option<Lint>,
    /// One JSON document on standard output.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    avr: avr::Flags,
    #[command(flatten)]
    mcs51: mcs51::Flags,
    #[command(flatten)]
    pic16: pic16::Flags,
    #[command(flatten)]
    ap101: ap101::Flags,
}

/// Bytes (a type of its own, since clap takes a list of bytes for a repeated flag).
#[derive(Debug, Clone)]
struct Text(Vec<u8>);

#[derive(Debug, Clone, Copy)]
enum Ram {
    Fill(RamInit),
    Trap,
}

fn baud(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "write a whole number of bits per second, as 9600".to_owned())
}

fn ram(text: &str) -> Result<Ram, String> {
    match text.split_once(':') {
        None if text == "zero" => Ok(Ram::Fill(RamInit::Zero)),
        None if text == "trap" => Ok(Ram::Trap),
        Some(("random", seed)) => {
            let seed = seed.parse().map_err(|_| format!("`{seed}` is no seed; write a number, as in random:1"))?;
            Ok(Ram::Fill(RamInit::Random(seed)))
        }
        _ => Err("write random:SEED, zero or trap".to_owned()),
    }
}

/// What the flags come to on the chosen chip.
struct Planned {
    clock: Clock,
    plan: Plan,
    drives: Vec<Drive>,
    peek: Vec<(String, Range)>,
}

/// Runs an image.
pub fn run<'a>(args: &'a RunArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let chip = args.mcu.chip;
    let stdout = ("--json", if args.json { "-" } else { "" });
    let file = |file: &'a Option<String>| file.as_deref().unwrap_or("");
    let outputs = [stdout, ("--uart", file(&args.uart)), ("--vcd", file(&args.vcd)), ("--eeprom", file(&args.eeprom))];
    let held = args.attach.iter().map(|attached| ("--attach", file(&attached.file)));
    let used: Vec<_> = outputs.into_iter().chain(held).filter(|(_, file)| !file.is_empty()).collect();
    output::owners(&used)?;
    for file in std::iter::once(&args.image).chain(&args.symbols) {
        output::spares(file, &used)?;
    }
    let to_stdout = used.iter().any(|(_, file)| output::is_stdout(file));
    serial_port(args, chip)?;
    let cod = &args.pic16.cod;
    let mut script = cod.as_deref().map(|file| cod::script(file, chip)).transpose()?;
    let asked = match (&mut script, cod) {
        (Some(script), Some(file)) => Some(cod::clock(script, file, args.clock, chip)?),
        _ => args.clock,
    };
    let start_up = !args.no_start_up && script.is_none();
    if args.no_start_up && matches!(chip.family, Family::Mcs51 | Family::Ap101) {
        let why = format!("--no-start-up is for chips of the AVR and PIC16 families; {} is none", chip.name);
        return Err(Failure::Usage(why));
    }
    let mcs51 = args.mcs51.options(chip)?;
    let ap101 = args.ap101.options(chip, asked)?;
    let pic16 = args.pic16.options(chip, asked.unwrap_or(chip.default_hz), start_up)?;
    // Refused before the image is read, like the others.
    args.avr.wiring(chip, &Image::default(), asked, start_up)?;
    let symbols: Vec<String> = args.symbols.iter().chain(cod).cloned().collect();
    let image = input::image_with_symbols(&args.image, &symbols, chip, terminal)?;
    let avr = args.avr.wiring(chip, &image, asked, start_up)?;
    let hz = ap101::hz(chip, &image, &ap101).unwrap_or(avr.options.hz);
    if hz > chip.max_hz {
        let why = format!("{} runs at up to {} Hz", chip.name, chip.max_hz);
        return Err(Failure::value("--clock <HZ>", &hz.to_string(), &why));
    }
    let eeprom = args.eeprom.as_deref().map(|file| store::eeprom(file, chip, &image)).transpose()?;
    let bench = Bench::new(&args.attach, chip, avr::reset_pin(chip, &avr))?;
    let ram = match args.ram {
        Ram::Fill(init) => init,
        Ram::Trap => RamInit::Zero,
    };
    mcs51::warn(chip, &image, &mcs51);
    avr::tell(chip, &avr, args.clock);
    on_machine(
        chip,
        &image,
        &Setup { ram, bus: args.vcd.is_some(), avr: avr.options, mcs51, pic16, ap101 },
        Headless { args, image: &image, script, hz, avr, pic16, eeprom, bench, to_stdout, terminal },
    )
}

/// Refuses flags that wait for bytes of a serial port on a chip that has none.
fn serial_port(args: &RunArgs, chip: &Chip) -> Result<(), Failure> {
    let given = [
        ("--uart", args.uart.is_some()),
        ("--uart-in", !args.uart_in.is_empty()),
        ("--expect-uart", args.expect_uart.is_some()),
        ("--fail-uart", args.fail_uart.is_some()),
        ("--until 'uart ..'", args.until.iter().any(|text| text.trim().starts_with("uart"))),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        Some((flag, _)) if !family::has_uart(chip) => {
            Err(Failure::Usage(format!("{flag} is for chips with a serial port; {} has none", chip.name)))
        }
        _ => Ok(()),
    }
}

/// A run without a user.
struct Headless<'a> {
    args: &'a RunArgs,
    image: &'a Image,
    /// The messages of a program that checks itself.
    script: Option<Script>,
    hz: u64,
    avr: avr::Wiring,
    pic16: emu_pic16::Options,
    /// The file of the EEPROM, and what it holds.
    eeprom: Option<(Store, Option<Vec<u8>>)>,
    bench: Bench,
    /// Standard output carries something else than the summary.
    to_stdout: bool,
    terminal: &'a Terminal,
}

impl Job for Headless<'_> {
    type Out = Result<u8, Failure>;

    fn on<C: Cpu>(mut self, mut cpu: C) -> Self::Out {
        let store = self.eeprom.take().map(|(store, held)| {
            store::fill(&mut cpu, &held.unwrap_or_default());
            store
        });
        let clock = Clock { hz: self.hz, clocks_per_cycle: cpu.clocks_per_cycle() * self.avr.divider };
        let source = self.source(cpu.chip());
        let job = planned(self.args, &source, clock);
        // Asking for a line of the image may have shown that its debugging information is damaged.
        report(self.terminal, self.image.lines.warnings(), Texts::NONE);
        let told = self.image.lines.warnings().len();
        let job = job?;
        there(&job, &cpu)?;
        let mut board = self.bench.board(cpu.chip(), clock, &job.drives)?;
        let out = self.whole((&mut cpu, &mut board), job);
        report(self.terminal, self.image.lines.warnings().get(told..).unwrap_or_default(), Texts::NONE);
        // However the run has ended: but a command line that makes no sense has run nothing.
        let wrong = matches!(out, Err(Failure::Usage(_)));
        if let Some(store) = store.filter(|_| !wrong) {
            store.keep(&store::cells(&cpu))?;
        }
        if !wrong {
            self.bench.keep(&board)?;
        }
        out
    }
}

impl Headless<'_> {
    /// What is known of the addresses of the program.
    fn source(&self, chip: &'static Chip) -> Source<'_> {
        Source { names: Names { chip, symbols: &self.image.symbols }, lines: &self.image.lines }
    }

    /// The run, and what is told of it.
    fn whole<C: Cpu>(&self, (cpu, board): (&mut C, &mut Board), mut job: Planned) -> Result<u8, Failure> {
        let (args, image, chip) = (self.args, self.image, cpu.chip());
        let source = self.source(chip);
        let filled = image.segments.iter().filter(|s| s.space == chip.ram);
        job.plan.filled =
            filled.map(|s| Range { space: s.space, start: s.addr, end: s.addr + s.bytes.len() as u32 }).collect();
        for (text, range) in &job.peek {
            let width = chip.width(range.space);
            if let Some(addr) = (range.start..range.end).find(|&addr| cpu.peek(range.space, addr * width).is_none()) {
                let why = format!("{} has nothing at {}:0x{addr:x}", chip.name, range.space);
                return Err(Failure::value("--peek <RANGE>", text, &why));
            }
        }
        queue(cpu, &job.drives).map_err(Failure::Usage)?;
        pic16::warn(chip, image, &self.pic16);
        if let Some(script) = &self.script {
            let limits = Limits { cycle: job.plan.limit, hz: self.hz };
            let name = args.pic16.cod.as_deref().unwrap_or_default();
            return cod::judge(cpu, script, (name, source), (limits, &job.drives), args.json);
        }
        board.connect(cpu);
        let ended = recorded(args, (cpu, board), &job)?;
        let held = if ended.reason == Reason::Halted { held(cpu, &job.drives) } else { None };
        let Planned { clock, plan, peek, .. } = &job;
        let story = Story { cpu, source, clock: *clock, plan, ended: &ended, peek, held };
        if let Some(how) = args.lint {
            lint::complain(&story, how, &args.image, self.terminal);
        }
        summary::complain(&story);
        avr::complain(cpu, &self.avr);
        if args.json {
            let mut document = summary::document(&story);
            if args.lint.is_some() {
                document["lints"] = lint::document(&story);
            }
            output::json(&document)?;
        } else if self.to_stdout {
            output::tell(&summary::text(&story));
        } else {
            output::print(summary::text(&story))?;
        }
        let asked = args.time.is_some() || args.cycles.is_some();
        let code = code(&job.plan, &ended, asked);
        Ok(args.lint.map_or(code, |how| lint::code(how, &ended.lints, code)))
    }
}

/// Runs and writes along what `--uart` and `--vcd` ask for.
fn recorded<C: Cpu>(args: &RunArgs, (cpu, board): (&mut C, &mut Board), job: &Planned) -> Result<Ended, Failure> {
    let chip = cpu.chip();
    let uart_file = args.uart.as_deref().filter(|f| !output::is_stdout(f)).map(Pending::new).transpose()?;
    let vcd_file = args.vcd.as_deref().filter(|f| !output::is_stdout(f)).map(Pending::new).transpose()?;
    let vcd_name = args.vcd.as_deref().unwrap_or_default();
    let vcd_error = |error: std::io::Error| Failure::writing(vcd_name, &error);
    let wave = match (&args.vcd, &vcd_file) {
        (None, _) => None,
        (Some(_), Some(file)) => Some(file.writer()?),
        (Some(_), None) => Some(Box::new(std::io::BufWriter::new(std::io::stdout())) as Box<dyn Write>),
    };
    let wave = wave
        .map(|out| Wave::new(out, chip, job.clock, &shown(cpu, chip), family::has_uart(chip)))
        .transpose()
        .map_err(vcd_error)?;

    let raw = args.uart.as_deref().is_some_and(output::is_stdout);
    let (start, mut printed, mut broken) = (Instant::now(), 0, None);
    let ended = run_on(board, cpu, &job.plan, wave, &mut |sent| {
        if raw && broken.is_none() {
            broken = output::print(sent.get(printed..).unwrap_or_default()).err();
            printed = sent.len();
        }
        broken.is_none() && args.timeout.is_none_or(|limit| start.elapsed() < limit)
    })
    .map_err(vcd_error)?;
    if let Some(failure) = broken {
        return Err(failure);
    }
    if let Some(file) = uart_file {
        let mut out = file.writer()?;
        let name = args.uart.as_deref().unwrap_or_default();
        out.write_all(&ended.uart).and_then(|()| out.flush()).map_err(|error| Failure::writing(name, &error))?;
        drop(out);
        file.complete()?;
    }
    vcd_file.map_or(Ok(()), Pending::complete)?;
    Ok(ended)
}

fn planned(args: &RunArgs, source: &Source<'_>, clock: Clock) -> Result<Planned, Failure> {
    let (names, chip) = (&source.names, source.names.chip);
    let time = args.time.as_deref().unwrap_or(DEFAULT_LIMIT);
    let limit = match args.cycles {
        Some(n) if n > time::MAX_CYCLES => {
            return Err(Failure::value("--cycles <N>", &n.to_string(), "at most 2^62 cycles"));
        }
        Some(n) => n,
        None => clock.cycles(time).map_err(|why| Failure::value("--for <TIME>", time, &why))?,
    };
    let mut drives = Vec::new();
    for text in &args.set {
        let put = put(chip, &avr::own_name(chip, &names.with_channel(text)))
            .map_err(|why| Failure::value("--set <PIN=LEVEL>", text, &why))?;
        drives.push(Drive { at: Time::default(), put });
    }
    for text in &args.at {
        let own =
            text.split_once(':').map(|(time, put)| format!("{time}:{}", avr::own_name(chip, &names.with_channel(put))));
        let own = own.as_deref().unwrap_or(text);
        drives.push(drive(chip, clock, own).map_err(|why| Failure::value("--at <TIME:PIN=LEVEL>", text, &why))?);
    }
    let incoming = incoming(args, chip, clock, &drives)?;
    drives.extend(incoming);
    let conditions =
        args.until.iter().map(|t| source.until(t).map_err(|why| Failure::value("--until <COND>", t, &why)));
    let peek = args.peek.iter().map(|text| match names.range(text) {
        Ok(range) => Ok((text.clone(), range)),
        Err(why) => Err(Failure::value("--peek <RANGE>", text, &why)),
    });
    let plan = Plan {
        limit,
        until: conditions.collect::<Result<_, _>>()?,
        expect: args.expect_uart.clone().map(|t| t.0),
        fail: args.fail_uart.clone().map(|t| t.0),
        trap_ram: matches!(args.ram, Ram::Trap),
        filled: Vec::new(),
        lint: args.lint.is_some(),
    };
    Ok(Planned { clock, plan, drives, peek: peek.collect::<Result<_, _>>()? })
}

/// Refuses pins that the machine does not have because its image says so.
fn there<C: Cpu>(job: &Planned, cpu: &C) -> Result<(), Failure> {
    let driven = job.drives.iter().filter_map(|drive| match drive.put {
        Put::Level(pin, _) | Put::Volts(pin, _) | Put::Counts(pin, _) => Some(pin),
        Put::Supply(_) => None,
    });
    let awaited = job.plan.until.iter().filter_map(|until| match until {
        Until::Pin(pin, _) => Some(*pin),
        _ => None,
    });
    match driven.chain(awaited).find(|pin| !cpu.has_pin(*pin)) {
        None => Ok(()),
        Some(pin) => {
            let name = cpu.chip().pins.get(usize::from(pin)).map_or("?", |def| def.name);
            Err(Failure::Usage(format!(
                "{name} is no channel of this machine: the configuration in its image has fewer"
            )))
        }
    }
}

/// What `--uart-in` does at the receive pin, which none of the `others` drives.
fn incoming(args: &RunArgs, chip: &Chip, clock: Clock, others: &[Drive]) -> Result<Vec<Drive>, Failure> {
    if args.uart_in.is_empty() {
        return Ok(Vec::new());
    }
    let text = |typed: &String| -> Result<(Time, Vec<u8>), String> {
        let (time, text) =
            typed.split_once(':').ok_or_else(|| format!("`{typed}` gives no time; write 10ms:{typed}"))?;
        Ok((clock.moment(time)?, unescape(text)?))
    };
    let text = |typed: &String| text(typed).map_err(|why| Failure::value("--uart-in <TIME:TEXT>", typed, &why));
    let texts = args.uart_in.iter().map(text).collect::<Result<Vec<_>, _>>()?;
    let pin = family::receive_pin(chip)
        .ok_or_else(|| Failure::Usage(format!("--uart-in is for chips with a serial port; {} has none", chip.name)))?;
    let drives = |drive: &Drive| matches!(drive.put, Put::Level(driven, _) | Put::Volts(driven, _) if driven == pin);
    if others.iter().any(drives) {
        let name = chip.pins.get(usize::from(pin)).map_or("?", |pin| pin.name);
        return Err(Failure::Usage(format!("{name} is driven by --uart-in, so --set and --at cannot drive it")));
    }
    let baud = |why: String| Failure::value("--baud <RATE>", &args.baud.to_string(), &why);
    let sender = Sender::new(pin, args.baud).map_err(baud)?;
    sender.edges(clock, &texts).map_err(Failure::Usage)
}

/// The exit code: a condition of --until ends the run well unless --expect-uart still waits.
fn code(plan: &Plan, ended: &Ended, asked: bool) -> u8 {
    let waits = plan.expect.is_some() || !plan.until.is_empty();
    match ended.reason {
        Reason::Expected => exit::OK,
        Reason::Until(..) if plan.expect.is_none() => exit::OK,
        Reason::Until(..) | Reason::Failed => exit::FAILED,
        Reason::Halted if waits => exit::FAILED,
        Reason::Halted => exit::OK,
        Reason::Limit if asked && !waits => exit::OK,
        Reason::Limit | Reason::Host => exit::LIMIT,
        Reason::Illegal { .. } | Reason::Fault { .. } => exit::FAULT,
    }
}
