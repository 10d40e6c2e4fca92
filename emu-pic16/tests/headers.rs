//! Compares the rows of the chips with the files of the installed gputils: every register, bit, bad address
//! and configuration value of `p16*.inc`, and the memories of `16*_g.lkr`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use emu_core::Cpu;
use emu_core::cpu::RamInit;
use emu_core::image::Image;
use emu_core::pins::PinId;
use emu_pic16::Pic16;
use emu_pic16::chips::{ALIASES, FileSlot, OscillatorMode, PIC16_PARTS, Pic16Part, SfrBit};
use emu_pic16::periph::map::Sfr;

/// Directory of the files in Debian's package `gputils`.
const SHARE: &str = "/usr/share/gputils";

/// Chip, the difference, and why the file is wrong.
const FAULTS: &str = "
    pic16c84   | bits PORTA RA0 RA1 RA2 RA3 RA4                | not in the header; DS30445 section 5.1
    pic16c84   | bits PORTB RB0 RB1 RB2 RB3 RB4 RB5 RB6 RB7    | not in the header; DS30445 section 5.2
    pic16c84   | bits TRISA TRISA0 TRISA1 TRISA2 TRISA3 TRISA4 | not in the header; DS30445 section 5.1
    pic16c84   | bits TRISB TRISB0 TRISB1 TRISB2 TRISB3 TRISB4 TRISB5 TRISB6 TRISB7 | not in the header; DS30445 section 5.2
    pic16c84   | ram lacks 8C-AF    | mapped in bank 0; DS30445 figure 4-2
    pic16f873  | ram 110-11F        | unimplemented; DS30292 figure 2-4
    pic16f873  | ram 190-19F        | unimplemented; DS30292 figure 2-4
    pic16f873  | not shared F0-FF   | bytes of their own; DS30292 figure 2-4
    pic16f873  | not shared 1F0-1FF | shows F0-FF; DS30292 figure 2-4
    pic16f873a | ram 110-11F        | unimplemented; DS39582 figure 2-4
    pic16f873a | ram 190-19F        | unimplemented; DS39582 figure 2-4
    pic16f873a | not shared F0-FF   | bytes of their own; DS39582 figure 2-4
    pic16f873a | not shared 1F0-1FF | shows F0-FF; DS39582 figure 2-4
    pic16f874  | ram 110-11F        | unimplemented; DS30292 figure 2-4
    pic16f874  | ram 190-19F        | unimplemented; DS30292 figure 2-4
    pic16f874  | not shared F0-FF   | bytes of their own; DS30292 figure 2-4
    pic16f874  | not shared 1F0-1FF | shows F0-FF; DS30292 figure 2-4
    pic16f874a | ram 110-11F        | unimplemented; DS39582 figure 2-4
    pic16f874a | ram 190-19F        | unimplemented; DS39582 figure 2-4
    pic16f874a | not shared F0-FF   | bytes of their own; DS39582 figure 2-4
    pic16f874a | not shared 1F0-1FF | shows F0-FF; DS39582 figure 2-4
";

/// Content of a header.
#[derive(Default)]
struct Header {
    regs: BTreeMap<String, u16>,
    bits: Bits,
    config: BTreeMap<String, u16>,
    max_ram: u16,
    bad: BTreeSet<u16>,
}

/// Bit numbers by register and name.
type Bits = BTreeMap<String, BTreeMap<String, u16>>;

/// Returns the numbers between `H'` and `'` in a line.
fn numbers(line: &str) -> Vec<u16> {
    line.split("H'").skip(1).map(|s| u16::from_str_radix(s.split('\'').next().unwrap(), 16).unwrap()).collect()
}

fn header(name: &str) -> Header {
    let path = format!("{SHARE}/header/p{}.inc", name.strip_prefix("pic").unwrap());
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let (mut h, mut section) = (Header::default(), String::new());
    for line in text.lines() {
        let line = line.split_once(';').map_or(line, |(code, comment)| {
            if let Some(title) = comment.strip_prefix("-----") {
                section = title.trim_matches(|c| c == '-' || c == ' ').to_string();
            } else if comment.trim() == "Configuration Bits" {
                section = "CONFIG".into();
            }
            code
        });
        let mut words = line.split_whitespace();
        match (words.next(), words.next(), numbers(line).as_slice()) {
            (Some("__MAXRAM"), _, &[n]) => h.max_ram = n,
            (Some("__BADRAM"), ..) => {
                for ends in line.split(',').map(numbers) {
                    h.bad.extend(ends[0]..=ends[ends.len() - 1]);
                }
            }
            (Some(equate), Some("EQU"), &[n]) => {
                let equate = equate.to_string();
                if let Some(reg) = section.strip_suffix(" Bits") {
                    h.bits.entry(reg.into()).or_default().insert(equate, n);
                } else if section.starts_with("Bank") || section == "Register Files" {
                    h.regs.insert(equate, n);
                } else if equate.starts_with('_') || section.starts_with("CONFIG") {
                    h.config.insert(equate, n);
                } else {
                    assert!(["W", "F"].contains(&equate.as_str()), "{name}: {equate} is in no section");
                }
            }
            (Some(w), ..) if w.starts_with("__MAXRAM") => panic!("{name}: not read: {line}"),
            _ => {}
        }
    }
    h
}

/// Formats addresses as ranges.
fn ranges(what: &str, addrs: impl IntoIterator<Item = u16>) -> Vec<String> {
    let mut runs: Vec<(u16, u16)> = Vec::new();
    for a in addrs {
        match runs.last_mut() {
            Some(last) if last.1 + 1 == a => last.1 = a,
            _ => runs.push((a, a)),
        }
    }
    runs.iter().map(|(a, b)| format!("{what} {a:X}-{b:X}")).collect()
}

fn check_registers(part: &Pic16Part, h: &Header, diff: &mut Vec<String>) -> usize {
    let mut ours: BTreeMap<String, u16> = part.chip.regs.iter().map(|r| (r.name.to_string(), r.addr)).collect();
    ours.extend(ALIASES.iter().filter_map(|&(name, sfr)| Some((name.to_string(), part.addr(sfr)?))));
    diff.extend(ours.iter().filter(|o| h.regs.get(o.0) != Some(o.1)).map(|o| format!("register {} {:X}", o.0, o.1)));
    diff.extend(h.regs.iter().filter(|o| ours.get(o.0) != Some(o.1)).map(|o| format!("no register {} {:X}", o.0, o.1)));
    h.regs.len()
}

/// Returns the registers of `a` with the bits that `b` does not have there.
fn minus(a: &Bits, b: &Bits, what: &str) -> Vec<String> {
    let mut out = Vec::new();
    for (reg, bits) in a {
        let lost: Vec<_> = bits.iter().filter(|x| b.get(reg).and_then(|r| r.get(x.0)) != Some(x.1)).collect();
        if !lost.is_empty() {
            out.push(format!("{what} {reg} {}", lost.iter().map(|x| x.0.as_str()).collect::<Vec<_>>().join(" ")));
        }
    }
    out
}

fn check_bits(part: &Pic16Part, h: &Header, diff: &mut Vec<String>) -> usize {
    let name = |sfr: Sfr| part.chip.regs.iter().find(|r| Some(r.addr) == part.addr(sfr)).unwrap().name;
    let mut ours = Bits::new();
    for &SfrBit { sfr, name: bit, bit: n } in part.bits {
        ours.entry(name(sfr).into()).or_default().insert(bit.into(), n.into());
    }
    diff.extend(minus(&ours, &h.bits, "bits"));
    diff.extend(minus(&h.bits, &ours, "no bits"));
    h.bits.values().map(BTreeMap::len).sum()
}

fn check_bad(part: &Pic16Part, h: &Header, diff: &mut Vec<String>) -> usize {
    let nothing: BTreeSet<u16> = (0..=h.max_ram).filter(|&a| part.file_slot(a) == FileSlot::None).collect();
    diff.extend(ranges("good", nothing.difference(&h.bad).copied()));
    diff.extend(ranges("bad", h.bad.difference(&nothing).copied()));
    let banks = if h.max_ram < 0x100 { 0x100 } else { 0x200 };
    diff.extend(ranges("above MAXRAM", (h.max_ram + 1..banks).filter(|&a| part.file_slot(a) != FileSlot::None)));
    usize::from(h.max_ram) + 1
}

/// Registers with the bits, in hexadecimal, that do not read as they were written, and why. Sections are of
/// the reference manual of the family, DS33023.
const NOT_KEPT: &str = "
    INDF    | FF | the register that FSR selects; 6.3.2
    PORTA   | FF | reads pins, and TRISA has the bits; 9.2
    PORTB   | FF | reads pins, and TRISB has the bits; 9.3
    PORTC   | FF | reads pins, and TRISC has the bits; 9.4
    PORTD   | FF | reads pins, and TRISD has the bits; 9.5
    PORTE   | FF | reads pins, and TRISE has the bits; 9.6
    TRISA   | E0 | the header of the 16C84 names no bits; DS30445 section 5.1
    TRISE   | C0 | IBF and OBF are read-only; 9.6
    PCLATH  | E0 | five bits, without names in the headers; 6.2.2
    PIR1    | 30 | RCIF and TXIF are read-only; 8.2
    T1CON   | 40 | T1RUN is read-only; DS30487 register 7-1
    RCSTA   | 07 | FERR, OERR and RX9D are read-only; 18.2
    RCREG   | FF | read-only; 18.2
    SSPSTAT | 3F | only SMP and CKE can be written; 17.2
    ADCON0  | 04 | GO is not set by the write that sets ADON; 23.2
    CMCON   | C0 | C1OUT and C2OUT are read-only; 20.2
    EEDATH  | C0 | a program word has 14 bits; DS30292 section 4.3
    EEADRH  | FC | the high bits of a program address, without names in the headers; DS30292 section 4.1
    EECON1  | 03 | RD ends at once, and WR needs its sequence; 7.2
    EECON2  | FF | not a physical register; 7.2
";

/// The bits of the register at `addr` that can be read as ones after a write of ones or of zeros to a copy of
/// `fresh`.
fn kept_bits(fresh: &Pic16, addr: u16) -> u8 {
    [0x00, 0xFF].into_iter().fold(0, |seen, value| {
        let mut cpu = fresh.clone();
        cpu.poke("data", addr.into(), value);
        seen | cpu.peek("data", addr.into()).unwrap_or(0)
    })
}

/// Every register keeps the bits that the header names, except those in `NOT_KEPT`, and reads the others as
/// 0; `used` collects the rows of `NOT_KEPT` that apply.
fn check_masks(part: &'static Pic16Part, h: &Header, used: &mut BTreeSet<String>, diff: &mut Vec<String>) -> usize {
    let fresh = Pic16::new(&part.chip, &Image::default(), RamInit::Zero);
    for &(addr, sfr) in part.sfr {
        let name = part.chip.regs.iter().find(|reg| Some(reg.addr) == part.addr(sfr)).expect("a name").name;
        let named = h.bits.get(name).map(|bits| bits.values().fold(0, |mask, &bit| mask | 1 << bit));
        let (theirs, ours) = (named.unwrap_or(0xFF), kept_bits(&fresh, addr));
        let row = not_kept().find(|row| row.0 == name);
        used.extend(row.filter(|_| ours != theirs).map(|row| row.0.to_owned()));
        if ours & !theirs != 0 || theirs & !ours & !row.map_or(0, |row| row.1) != 0 {
            diff.push(format!("mask {name} {theirs:02X}, ours {ours:02X}"));
        }
    }
    part.sfr.len()
}

/// The rows of `NOT_KEPT`: register and bits. Every row has a reason.
fn not_kept() -> impl Iterator<Item = (&'static str, u8)> {
    NOT_KEPT.lines().filter(|line| !line.trim().is_empty()).map(|line| {
        let &[name, bits, why] = &line.split('|').map(str::trim).collect::<Vec<_>>()[..] else { panic!("{line}") };
        assert!(why.contains(';') || why.contains("read-only"), "{line}");
        (name, u8::from_str_radix(bits, 16).expect("bits"))
    })
}

/// Returns the number of words that a name such as `_WRT_PROTECT_256` or `_WRT_HALF` protects; the argument
/// is the part after `_WRT_`.
fn protected_words(rest: &str, words: u16) -> u16 {
    match rest.trim_start_matches("PROTECT_").trim_start_matches("ENABLE_") {
        "OFF" => 0,
        "ALL" => words,
        "HALF" => words / 2,
        "1FOURTH" => words / 4,
        n => n.parse().unwrap_or_else(|_| panic!("_WRT_{rest}")),
    }
}

/// Reports whether a value of the header has, by the row, the meaning of its name; None if the name is
/// unknown.
fn means(part: &Pic16Part, name: &str, v: u16) -> Option<bool> {
    use OscillatorMode as O;
    let c = &part.config;
    let words = u16::try_from(part.chip.flash_bytes / 2).unwrap();
    let clear = |mask: u16| mask != 0 && v == 0x3FFF & !mask;
    let within = |mask: u16| mask != 0 && v | mask == 0x3FFF;
    let is = |osc: O, ports: u8| {
        within(c.fosc.0) && c.oscillator_mode(v) == osc && (c.osc_ports.is_empty() || c.ports_of_oscillator(v) == ports)
    };
    let pin = |id: PinId, name: &str| part.chip.pins.get(usize::from(id)).is_some_and(|p| p.name == name);
    let ccp = |name: &str| within(c.ccpmx.0) && c.ccp1(v).is_some_and(|id| pin(id, name));
    let writes = |first: u16| within(c.wrt.0) && (0..words).all(|a| c.may_write(v, a) == (a >= first));
    let protects = |first: u16| within(c.cp) && (0..words).all(|a| c.may_write(v, a) == (a < first));
    // On the 87X WRT is a single bit that permits: if on, all words may be written.
    let permission = c.wrt.0.count_ones() == 1;
    Some(match name {
        "_FOSC_LP" | "_LP_OSC" => is(O::Lp, 0),
        "_FOSC_XT" | "_XT_OSC" => is(O::Xt, 0),
        "_FOSC_HS" | "_HS_OSC" => is(O::Hs, 0),
        "_FOSC_EC" | "_FOSC_ECIO" | "_EXTCLK" | "_EXTCLK_OSC" => is(O::Ec, 0x40),
        "_FOSC_INTOSCIO" | "_INTRC_OSC_NOCLKOUT" | "_INTOSC_OSC_NOCLKOUT" | "_INTRC_IO" => is(O::Internal, 0xC0),
        "_FOSC_INTOSCCLK" | "_INTRC_OSC_CLKOUT" | "_INTOSC_OSC_CLKOUT" | "_INTRC_CLKOUT" => is(O::Internal, 0x80),
        "_FOSC_ERIO" | "_ER_OSC_NOCLKOUT" | "_FOSC_EXTRCIO" | "_RC_OSC_NOCLKOUT" | "_EXTRC_IO" => is(O::Rc, 0x40),
        "_FOSC_ERCLK" | "_ER_OSC_CLKOUT" | "_FOSC_EXTRCCLK" | "_RC_OSC_CLKOUT" | "_EXTRC_CLKOUT" => is(O::Rc, 0),
        "_FOSC_EXTRC" | "_RC_OSC" | "_FOSC_RC" => is(O::Rc, 0),
        "_WDTE_OFF" | "_WDT_OFF" => clear(c.wdte),
        "_PWRTE_ON" => within(c.pwrte.0) && c.has_power_up_timer(v & !c.boren),
        "_PWRTE_OFF" => within(c.pwrte.0) && !c.has_power_up_timer(v & !c.boren),
        "_BOREN_OFF" | "_BODEN_OFF" => clear(c.boren),
        "_LVP_OFF" => clear(c.lvp),
        "_MCLRE_OFF" | "_MCLR_OFF" => clear(c.mclre),
        "_CPD_ON" | "_DATA_CP_ON" | "DATA_CP_ON" => clear(c.cpd),
        "_CP_ON" | "_CP_ALL" | "_CP_All" => clear(c.cp) && (c.cp_first.1.is_empty() || protects(0)),
        "_CP_75" | "_CP_50" => within(c.cp),
        "_CP_HALF" => protects(words / 2),
        "_CP_UPPER_256" => protects(words - 256),
        "_CCPMX_RB3" | "_CCP1_RB3" => ccp("RB3"),
        "_CCPMX_RB2" | "_CCP1_RB2" => ccp("RB2"),
        "_CCPMX_RB0" | "_CCP1_RB0" => ccp("RB0"),
        "_FCMEN_OFF" => clear(c.fcmen),
        "_IESO_OFF" => clear(c.ieso),
        "_WRT_ON" | "_WRT_ALL" | "_WRT_ENABLE_ON" if permission => writes(0),
        "_WRT_OFF" | "_WRT_ENABLE_OFF" if permission => writes(words),
        "_WDTE_ON" | "_WDT_ON" | "_BOREN_ON" | "_BODEN_ON" | "_LVP_ON" | "_MCLRE_ON" | "_MCLR_ON" => v == 0x3FFF,
        "_CPD_OFF" | "_DATA_CP_OFF" | "DATA_CP_OFF" | "_CP_OFF" | "_FCMEN_ON" | "_IESO_ON" | "_DEBUG_OFF" => {
            v == 0x3FFF
        }
        // The debugger is not part of the row.
        "_DEBUG_ON" => v == 0x37FF,
        "_CONFIG" | "_CONFIG1" => c.words.first() == Some(&v),
        "_CONFIG2" => c.words.get(1) == Some(&v),
        "_DEVID1" => v == 0x2006 && part.device_id.is_some(),
        "_IDLOC0" => v == 0x2000,
        "_IDLOC1" => v == 0x2001,
        "_IDLOC2" => v == 0x2002,
        "_IDLOC3" => v == 0x2003,
        _ => return name.strip_prefix("_WRT_").map(|rest| writes(protected_words(rest, words))),
    })
}

fn check_config(part: &Pic16Part, h: &Header, diff: &mut Vec<String>) -> usize {
    for (name, &v) in &h.config {
        if means(part, name, v) != Some(true) {
            diff.push(format!("config {name} {v:04X}"));
        }
    }
    h.config.len()
}

/// Every number that the header names is a constant of this crate; every constant is in some header of the
/// family, and has the meaning of its name on this chip.
fn check_names(part: &Pic16Part, h: &Header, known: &BTreeSet<String>, diff: &mut Vec<String>) -> usize {
    let all = (part.chip.constants)();
    let ours: BTreeMap<&str, i32> = all.iter().map(|one| (one.name, one.value)).collect();
    diff.extend(
        all.iter().filter(|o| ours.get(o.name) != Some(&o.value)).map(|o| format!("two meanings of {}", o.name)),
    );
    let bits = h.bits.values().flatten();
    for (name, &value) in bits.chain(&h.config) {
        if ours.get(name.as_str()) != Some(&value.into()) {
            diff.push(format!("name {name} {value:04X}"));
        }
    }
    for (name, value) in ours {
        let value = u16::try_from(value).unwrap();
        let here = h.config.contains_key(name)
            || part.bits.iter().any(|bit| bit.name == name)
            || ALIASES.iter().any(|alias| alias.0 == name)
            || ["W", "F"].contains(&name);
        if !(here || known.contains(name) && means(part, name, value) == Some(true)) {
            diff.push(format!("our name {name} {value:04X}"));
        }
    }
    h.config.len() + h.bits.values().map(BTreeMap::len).sum::<usize>()
}

fn check_linker(part: &Pic16Part, diff: &mut Vec<String>) -> usize {
    let path = format!("{SHARE}/lkr/{}_g.lkr", part.chip.name.strip_prefix("pic").unwrap());
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let (mut rom, mut eeprom, mut ram, mut lines) = (0, 0, BTreeSet::new(), 0);
    let mut shared: BTreeMap<&str, u16> = BTreeMap::new();
    for line in text.lines() {
        let field = |key: &str| line.split_whitespace().find_map(|w| w.strip_prefix(key));
        let number = |key: &str| field(key).map(|n| u16::from_str_radix(n.trim_start_matches("0x"), 16).unwrap());
        let kind = line.split_whitespace().next().filter(|k| !k.starts_with("//"));
        let (Some(kind), Some(name), Some(first), Some(last)) =
            (kind, field("NAME="), number("START="), number("END="))
        else {
            continue;
        };
        lines += 1;
        match kind {
            "CODEPAGE" if name.starts_with("page") => rom += u32::from(last - first) + 1,
            "CODEPAGE" if name == "eedata" => eeprom += last - first + 1,
            "DATABANK" | "SHAREBANK" if name.starts_with("gpr") => {
                ram.extend(first..=last);
                if kind == "SHAREBANK" {
                    let seen = *shared.entry(name).or_insert(first);
                    let apart = (first..=last).filter(|&a| part.file_slot(a) != part.file_slot(seen + (a - first)));
                    diff.extend(ranges("not shared", apart));
                }
            }
            _ => {}
        }
    }
    if rom != part.chip.on_chip_flash_bytes / 2 {
        diff.push(format!("program words {rom}"));
    }
    if eeprom != part.chip.eeprom_bytes {
        diff.push(format!("bytes of EEPROM {eeprom}"));
    }
    let banks = if part.has(Sfr::PIR1) { 0x200 } else { 0x100 };
    let ours: BTreeSet<u16> = (0..banks).filter(|&a| matches!(part.file_slot(a), FileSlot::Ram(_))).collect();
    diff.extend(ranges("ram lacks", ours.difference(&ram).copied()));
    diff.extend(ranges("ram", ram.difference(&ours).copied()));
    lines
}

#[test]
#[ignore = "needs gputils"]
fn rows_are_what_the_headers_say() {
    let mut expected: BTreeSet<(String, String)> = BTreeSet::new();
    for line in FAULTS.lines().filter(|l| !l.trim().is_empty()) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        assert_eq!(cells.len(), 3, "{line}");
        assert!(expected.insert((cells[0].into(), cells[1].into())), "twice: {line}");
    }
    let (mut found, mut counts, mut used) = (BTreeSet::new(), [0; 7], BTreeSet::new());
    let known: BTreeSet<String> =
        PIC16_PARTS.iter().flat_map(|part| header(part.chip.name).config.into_keys()).collect();
    for part in PIC16_PARTS {
        let (h, mut diff) = (header(part.chip.name), Vec::new());
        counts[0] += check_registers(part, &h, &mut diff);
        counts[1] += check_bits(part, &h, &mut diff);
        counts[2] += check_bad(part, &h, &mut diff);
        counts[3] += check_config(part, &h, &mut diff);
        counts[4] += check_linker(part, &mut diff);
        counts[5] += check_names(part, &h, &known, &mut diff);
        counts[6] += check_masks(part, &h, &mut used, &mut diff);
        found.extend(diff.into_iter().map(|d| (part.chip.name.to_string(), d)));
    }
    let [regs, bits, addrs, config, lines, names, masks] = counts;
    println!(
        "{} chips: {regs} registers, {bits} bits, {addrs} addresses, {config} configuration values, {lines} lines of linker \
         scripts, {names} names, {masks} masks; {} differences that are the files' faults",
        PIC16_PARTS.len(),
        found.len()
    );
    assert_eq!(used, not_kept().map(|row| row.0.to_owned()).collect(), "rows of NOT_KEPT without a difference");
    let new: Vec<_> = found.difference(&expected).collect();
    let gone: Vec<_> = expected.difference(&found).collect();
    assert!(new.is_empty() && gone.is_empty(), "not in the list: {new:#?}\nno longer there: {gone:#?}");
    assert!(
        regs > 700 && bits > 3000 && addrs > 8000 && config > 700 && lines > 250 && names > 3700 && masks > 900,
        "too little was read"
    );
}
