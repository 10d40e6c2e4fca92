//! A model of the interrupt system as the manual describes it, one machine cycle at a time, with a core that
//! has a dozen instructions (user's manual, "Interrupts", "How interrupts are handled", "Timer/counters",
//! "Timer 2"). It shares no code with the crate.

/// The instructions of the model's core.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Do {
    Nop,
    IncDptr,
    Mul,
    /// SETB or CLR of a bit of IE or IP.
    EnableBit(u8, bool),
    PriorityBit(u8, bool),
    Enable(u8),
    Priority(u8),
    /// SETB or CLR of a flag.
    Flag(usize, bool),
    Idle,
    Reti,
    /// Jump to the start of the routine.
    Again,
}

/// Flags by number.
pub const FLAGS: [&str; 8] = ["IE0", "TF0", "IE1", "TF1", "RI", "TI", "TF2", "EXF2"];
const IE_BITS: [&str; 8] = ["EX0", "ET0", "EX1", "ET1", "ES", "ET2", "", "EA"];
const IP_BITS: [&str; 6] = ["PX0", "PT0", "PX1", "PT1", "PS", "PT2"];

impl Do {
    pub fn text(self, begin: &str) -> String {
        let set = |on| if on { "setb" } else { "clr" };
        match self {
            Do::Nop => "nop".into(),
            Do::IncDptr => "inc DPTR".into(),
            Do::Mul => "mul AB".into(),
            Do::EnableBit(bit, on) => format!("{} {}", set(on), IE_BITS[usize::from(bit)]),
            Do::PriorityBit(bit, on) => format!("{} {}", set(on), IP_BITS[usize::from(bit)]),
            Do::Enable(value) => format!("mov IE,#{value}"),
            Do::Priority(value) => format!("mov IP,#{value}"),
            Do::Flag(flag, on) => format!("{} {}", set(on), FLAGS[flag]),
            Do::Idle => "mov PCON,#1".into(),
            Do::Reti => "reti".into(),
            Do::Again => format!("ljmp {begin}"),
        }
    }

    fn cycles(self) -> u32 {
        match self {
            Do::Mul => 4,
            Do::Nop | Do::EnableBit(..) | Do::PriorityBit(..) | Do::Flag(..) => 1,
            _ => 2,
        }
    }

    /// Whether another instruction is executed before an interrupt.
    fn holds(self) -> bool {
        matches!(self, Do::Reti | Do::EnableBit(..) | Do::PriorityBit(..) | Do::Enable(_) | Do::Priority(_))
    }
}

/// Pins that the model samples: INT0, INT1, T0, T2EX.
pub const PINS: [&str; 4] = ["P3.2", "P3.3", "P3.4", "P1.1"];

/// The state before cycle 1, and all inputs from outside.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The main program and the six routines.
    pub routines: Vec<Vec<Do>>,
    /// Edges of INT0, INT1 instead of levels.
    pub edges: [bool; 2],
    /// GATE of timers 0 and 1; timer 0 counts T0.
    pub gate: [bool; 2],
    pub counter: bool,
    /// Whether both timers are in mode 2 instead of mode 1.
    pub reload: bool,
    /// TL and TH of both timers.
    pub start: [[u8; 2]; 2],
    pub timer2: u16,
    pub rcap: u16,
    pub ie: u8,
    pub ip: u8,
    /// The alternative reading: what is sampled in a cycle and not cleared at its end is polled in that
    /// cycle.
    pub sample_now: bool,
    /// Cycle, pin, level, in order of time.
    pub drives: Vec<(u64, usize, bool)>,
}

/// What the core is doing.
#[derive(Clone, Copy, PartialEq)]
enum Now {
    Op(Do, u32),
    Call(usize, u32),
    Asleep,
}

/// Runs the model. Returns the calls of routines: first cycle, and number of the source, 1 to 6.
pub fn run(setup: &Setup, cycles: u64) -> Vec<(u64, u8)> {
    let mut calls = Vec::new();
    let (mut ie, mut ip) = (setup.ie, setup.ip);
    let mut flags = [false; 8];
    let mut sampled = [false; 8];
    let mut pins = [true; 4];
    let mut last_pins = pins;
    let mut fell = false;
    let mut timers = setup.start;
    let mut timer2 = setup.timer2;
    let mut in_progress = [false; 2];
    let mut at = (0, 0);
    let mut stack = Vec::new();
    let fetch = |at: &mut (usize, usize)| {
        let op: Do = setup.routines[at.0][at.1];
        at.1 += 1;
        Now::Op(op, op.cycles())
    };
    let mut now = fetch(&mut at);
    let mut drives = setup.drives.iter().peekable();
    for c in 0..cycles {
        // S1P1.
        while let Some(&&(_, pin, level)) = drives.peek().filter(|drive| drive.0 <= c) {
            pins[pin] = level;
            drives.next();
        }
        // S2P2 and S3P1; the setup takes effect from cycle 1 on.
        let mut overflow2 = false;
        if c > 0 {
            timer2 = timer2.wrapping_add(1);
            overflow2 = timer2 == 0;
            if overflow2 {
                timer2 = setup.rcap;
                flags[6] = true;
            }
            for n in 0..2 {
                let counts = if n == 0 && setup.counter { fell } else { true };
                if counts && (!setup.gate[n] || pins[n]) && count(&mut timers[n], setup.reload) {
                    flags[1 + 2 * n] = true;
                }
            }
        }
        // S5P2: except for TF2, what is polled in this cycle was sampled in the one before.
        let mut polled = sampled;
        polled[6] |= overflow2;
        for n in 0..2 {
            if !setup.edges[n] {
                flags[2 * n] = !pins[n];
            } else if last_pins[n] && !pins[n] {
                flags[2 * n] = true;
            }
        }
        fell = last_pins[2] && !pins[2];
        if last_pins[3] && !pins[3] {
            flags[7] = true;
            timer2 = setup.rcap;
        }
        last_pins = pins;
        sampled = flags;

        // The end of the cycle, S6P2.
        let mut ends = false;
        let mut held = false;
        match &mut now {
            Now::Asleep => ends = true,
            Now::Call(source, left) => {
                *left -= 1;
                if *left == 1 && *source <= 4 && (*source % 2 == 0 || setup.edges[*source / 2]) {
                    flags[*source - 1] = false;
                }
                ends = *left == 0;
            }
            Now::Op(op, left) => {
                *left -= 1;
                if *left == 0 {
                    (ends, held) = (true, op.holds());
                    match *op {
                        Do::EnableBit(bit, on) => ie = ie & !(1 << bit) | u8::from(on) << bit,
                        Do::PriorityBit(bit, on) => ip = ip & !(1 << bit) | u8::from(on) << bit,
                        Do::Enable(value) => ie = value,
                        Do::Priority(value) => ip = value,
                        Do::Flag(flag, on) => flags[flag] = on,
                        Do::Reti => {
                            at = stack.pop().unwrap_or((0, 0));
                            in_progress[usize::from(in_progress[1])] = false;
                        }
                        Do::Again => at.1 = 0,
                        _ => {}
                    }
                }
            }
        }
        if !ends {
            continue;
        }
        if setup.sample_now {
            polled = sampled;
            // A level follows the pin: a program cannot clear it.
            let levels =
                [(0, setup.edges[0]), (2, setup.edges[1])].into_iter().filter(|level| !level.1).map(|level| level.0);
            let kept = levels.fold(flags, |mut flags, n| {
                flags[n] = sampled[n];
                flags
            });
            polled.iter_mut().zip(kept).for_each(|(polled, flag)| *polled &= flag);
        }
        // RETI and writes of IE and IP hold interrupts, so it does not matter that they are already executed.
        let chosen = choose(polled, ie, ip, in_progress);
        let sleeps = now == Now::Asleep || matches!(now, Now::Op(Do::Idle, _));
        now = match chosen.filter(|_| !held) {
            Some(source) => {
                calls.push((c + 1, source as u8));
                in_progress[usize::from(ip >> (source - 1) & 1)] = true;
                stack.push(at);
                at = (source, 0);
                Now::Call(source, 2)
            }
            None if sleeps => Now::Asleep,
            None => fetch(&mut at),
        };
    }
    calls
}

/// Counts once. Returns true at an overflow.
fn count(timer: &mut [u8; 2], reload: bool) -> bool {
    timer[0] = timer[0].wrapping_add(1);
    if timer[0] != 0 {
        return false;
    }
    if reload {
        timer[0] = timer[1];
        return true;
    }
    timer[1] = timer[1].wrapping_add(1);
    timer[1] == 0
}

/// The source that is served: the first one in polling order of the highest level that is not in progress.
fn choose(flags: [bool; 8], ie: u8, ip: u8, in_progress: [bool; 2]) -> Option<usize> {
    let requests = [flags[0], flags[1], flags[2], flags[3], flags[4] || flags[5], flags[6] || flags[7]];
    if ie & 0x80 == 0 || in_progress[1] {
        return None;
    }
    let of_level = |high: bool| {
        (0..6usize).find(|&n| requests[n] && ie >> n & 1 != 0 && (ip >> n & 1 != 0) == high).map(|n| n + 1)
    };
    of_level(true).or_else(|| if in_progress[0] { None } else { of_level(false) })
}
