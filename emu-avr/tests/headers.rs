//! Compares the rows of the chips with the headers of avr-libc; the compiler itself evaluates each name.
//! `cargo test -p plcemu-avr --test headers -- --ignored`; needs avr-gcc and avr-libc.

use emu_avr::chips::SplitBit;
use std::collections::{BTreeMap, BTreeSet};

use emu_avr::chips::{AVR_PARTS, AvrPart, RegisterPresence, RegisterSlot, chip, part};
use emu_avr::periph::external::ExternalSense;

mod gcc;

use gcc::gcc;

/// Names of registers that only the headers have, or only this crate, with the reason.
const BESIDES: &str = "
    MCUSR  another name of MCUCSR: the headers of the ATmega16 and 128 lack it
    MCUCSR the header of the ATmega32 has only the other
    GIMSK  old name of GICR: the header of the ATmega16 lacks it
    GICR   the header of the ATmega32 has only the old one
    SPMCR  old name of SPMCSR: the header of the ATmega128 lacks it
    UCSRC  shares an address with UBRRH, and the header of the ATmega32 has only that
    OCDR   of the on-chip debugger: shares an address with OSCCAL, and the header of the ATmega32 has only that
    MONDR  of the on-chip debugger
    SPCR   the headers of the ATmega164PA, 324A, 324P and 324PA have only SPCR0
    SPCR0  another name of SPCR
    SPSR   the headers of the ATmega164PA, 324A, 324P and 324PA have only SPSR0
    SPSR0  another name of SPSR
    SPDR   the headers of the ATmega164PA, 324A, 324P and 324PA have only SPDR0
    SPDR0  another name of SPDR
    PRR    another name of PRR0: only older headers of the ATmega164 to 644 have it
    EEARH  the header of the ATmega48P leaves it out: there is no use for it
";

/// Bits of registers that are split into several of this crate's registers: chips, register, and each bit by
/// its name in the header.
const BITS: &str = "
    8           | TIMSK  | OCIE2=Timer(2, TIMSK).1 TOIE2=Timer(2, TIMSK).0 TICIE1=Timer(1, TIMSK).5 OCIE1A=Timer(1, TIMSK).1 OCIE1B=Timer(1, TIMSK).2 TOIE1=Timer(1, TIMSK).0 TOIE0=Timer(0, TIMSK).0
    8           | TIFR   | OCF2=Timer(2, TIFR).1 TOV2=Timer(2, TIFR).0 ICF1=Timer(1, TIFR).5 OCF1A=Timer(1, TIFR).1 OCF1B=Timer(1, TIFR).2 TOV1=Timer(1, TIFR).0 TOV0=Timer(0, TIFR).0
    16 32 64 128 162 | TIMSK | OCIE2=Timer(2, TIMSK).1 TOIE2=Timer(2, TIMSK).0 TICIE1=Timer(1, TIMSK).5 OCIE1A=Timer(1, TIMSK).1 OCIE1B=Timer(1, TIMSK).2 TOIE1=Timer(1, TIMSK).0 TOIE0=Timer(0, TIMSK).0 OCIE0=Timer(0, TIMSK).1
    16 32 64 128 162 | TIFR | OCF2=Timer(2, TIFR).1 TOV2=Timer(2, TIFR).0 ICF1=Timer(1, TIFR).5 OCF1A=Timer(1, TIFR).1 OCF1B=Timer(1, TIFR).2 TOV1=Timer(1, TIFR).0 TOV0=Timer(0, TIFR).0 OCF0=Timer(0, TIFR).1
    64 128      | ETIMSK | TICIE3=Timer(3, TIMSK).5 OCIE3A=Timer(3, TIMSK).1 OCIE3B=Timer(3, TIMSK).2 TOIE3=Timer(3, TIMSK).0 OCIE3C=Timer(3, TIMSK).3 OCIE1C=Timer(1, TIMSK).3
    64 128      | ETIFR  | ICF3=Timer(3, TIFR).5 OCF3A=Timer(3, TIFR).1 OCF3B=Timer(3, TIFR).2 TOV3=Timer(3, TIFR).0 OCF3C=Timer(3, TIFR).3 OCF1C=Timer(1, TIFR).3
    162         | ETIMSK | TICIE3=Timer(3, TIMSK).5 OCIE3A=Timer(3, TIMSK).1 OCIE3B=Timer(3, TIMSK).2 TOIE3=Timer(3, TIMSK).0
    162         | ETIFR  | ICF3=Timer(3, TIFR).5 OCF3A=Timer(3, TIFR).1 OCF3B=Timer(3, TIFR).2 TOV3=Timer(3, TIFR).0
    16 32 64 128 162 | TCCR0 | FOC0=Timer(0, TCCRB).7 WGM00=Timer(0, TCCRA).0 COM01=Timer(0, TCCRA).7 COM00=Timer(0, TCCRA).6 WGM01=Timer(0, TCCRA).1 CS02=Timer(0, TCCRB).2 CS01=Timer(0, TCCRB).1 CS00=Timer(0, TCCRB).0
    8 16 32 64 128 162 | TCCR2 | FOC2=Timer(2, TCCRB).7 WGM20=Timer(2, TCCRA).0 COM21=Timer(2, TCCRA).7 COM20=Timer(2, TCCRA).6 WGM21=Timer(2, TCCRA).1 CS22=Timer(2, TCCRB).2 CS21=Timer(2, TCCRB).1 CS20=Timer(2, TCCRB).0
    8 16 32 162 | TCCR1A | COM1A1=Timer(1, TCCRA).7 COM1A0=Timer(1, TCCRA).6 COM1B1=Timer(1, TCCRA).5 COM1B0=Timer(1, TCCRA).4 FOC1A=Timer(1, TCCRC).7 FOC1B=Timer(1, TCCRC).6 WGM11=Timer(1, TCCRA).1 WGM10=Timer(1, TCCRA).0
    162         | TCCR3A | COM3A1=Timer(3, TCCRA).7 COM3A0=Timer(3, TCCRA).6 COM3B1=Timer(3, TCCRA).5 COM3B0=Timer(3, TCCRA).4 FOC3A=Timer(3, TCCRC).7 FOC3B=Timer(3, TCCRC).6 WGM31=Timer(3, TCCRA).1 WGM30=Timer(3, TCCRA).0
    8 16 32 162 | ASSR   | AS2=Timer(2, ASSR).5 TCN2UB=Timer(2, ASSR).4 OCR2UB=Timer(2, ASSR).3 TCR2UB=Timer(2, ASSR).1
    64 128      | ASSR   | AS0=Timer(0, ASSR).5 TCN0UB=Timer(0, ASSR).4 OCR0UB=Timer(0, ASSR).3 TCR0UB=Timer(0, ASSR).1
    8           | SFIOR  | ACME=Adc(ADCSRB).6 PUD=Own(MCUCR).4 PSR2=Own(GTCCR).1 PSR10=Own(GTCCR).0
    16 32       | SFIOR  | ADTS2=Adc(ADCSRB).2 ADTS1=Adc(ADCSRB).1 ADTS0=Adc(ADCSRB).0 ACME=Adc(ADCSRB).6 PUD=Own(MCUCR).4 PSR2=Own(GTCCR).1 PSR10=Own(GTCCR).0
    64 128      | SFIOR  | TSM=Own(GTCCR).7 ACME=Adc(ADCSRB).6 PUD=Own(MCUCR).4 PSR0=Own(GTCCR).1 PSR321=Own(GTCCR).0
    162         | SFIOR  | TSM=Own(GTCCR).7 XMBK=Kept(2).6 XMM2=Kept(2).5 XMM1=Kept(2).4 XMM0=Kept(2).3 PUD=Own(MCUCR).4 PSR2=Own(GTCCR).1 PSR310=Own(GTCCR).0
    64          | ADCSRB | ADTS2=Adc(ADCSRB).2 ADTS1=Adc(ADCSRB).1 ADTS0=Adc(ADCSRB).0
    8 16 32     | MCUCR  | SE=Own(SMCR).0 SM2=Own(SMCR).3 SM1=Own(SMCR).2 SM0=Own(SMCR).1 ISC11=External(EICRA).3 ISC10=External(EICRA).2 ISC01=External(EICRA).1 ISC00=External(EICRA).0
    64 128      | MCUCR  | SRE=Kept(0).7 SRW10=Kept(0).6 SE=Own(SMCR).0 SM1=Own(SMCR).2 SM0=Own(SMCR).1 SM2=Own(SMCR).3 IVSEL=Own(MCUCR).1 IVCE=Own(MCUCR).0
    162         | MCUCR  | SRE=Kept(0).7 SRW10=Kept(0).6 SE=Own(SMCR).0 SM1=Own(SMCR).2 ISC11=External(EICRA).3 ISC10=External(EICRA).2 ISC01=External(EICRA).1 ISC00=External(EICRA).0
    162         | EMCUCR | SM0=Own(SMCR).1 SRL2=Kept(1).6 SRL1=Kept(1).5 SRL0=Kept(1).4 SRW01=Kept(1).3 SRW00=Kept(1).2 SRW11=Kept(1).1 ISC2=External(EICRA).4
    8           | MCUCSR | WDRF=Own(MCUSR).3 BORF=Own(MCUSR).2 EXTRF=Own(MCUSR).1 PORF=Own(MCUSR).0
    16 32       | MCUCSR | JTD=Kept(0).7 ISC2=External(EICRA).4 WDRF=Own(MCUSR).3 BORF=Own(MCUSR).2 EXTRF=Own(MCUSR).1 PORF=Own(MCUSR).0
    64 128      | MCUCSR | JTD=Kept(0).0 WDRF=Own(MCUSR).3 BORF=Own(MCUSR).2 EXTRF=Own(MCUSR).1 PORF=Own(MCUSR).0
    162         | MCUCSR | JTD=Kept(0).0 SM2=Own(SMCR).3 WDRF=Own(MCUSR).3 BORF=Own(MCUSR).2 EXTRF=Own(MCUSR).1 PORF=Own(MCUSR).0
    8           | GICR   | INT1=External(EIMSK).1 INT0=External(EIMSK).0 IVSEL=Own(MCUCR).1 IVCE=Own(MCUCR).0
    16 32       | GICR   | INT1=External(EIMSK).1 INT0=External(EIMSK).0 INT2=External(EIMSK).2 IVSEL=Own(MCUCR).1 IVCE=Own(MCUCR).0
    162         | GICR   | INT1=External(EIMSK).1 INT0=External(EIMSK).0 INT2=External(EIMSK).2 PCIE1=External(PCICR).1 PCIE0=External(PCICR).0 IVSEL=Own(MCUCR).1 IVCE=Own(MCUCR).0
    8           | GIFR   | INTF1=External(EIFR).1 INTF0=External(EIFR).0
    16 32       | GIFR   | INTF1=External(EIFR).1 INTF0=External(EIFR).0 INTF2=External(EIFR).2
    162         | GIFR   | INTF1=External(EIFR).1 INTF0=External(EIFR).0 INTF2=External(EIFR).2 PCIF1=External(PCIFR).1 PCIF0=External(PCIFR).0
    64 128      | UCSR0C | UMSEL0=Usart(0, UCSRC).6 UPM01=Usart(0, UCSRC).5 UPM00=Usart(0, UCSRC).4 USBS0=Usart(0, UCSRC).3 UCSZ01=Usart(0, UCSRC).2 UCSZ00=Usart(0, UCSRC).1 UCPOL0=Usart(0, UCSRC).0
    64 128      | UCSR1C | UMSEL1=Usart(1, UCSRC).6 UPM11=Usart(1, UCSRC).5 UPM10=Usart(1, UCSRC).4 USBS1=Usart(1, UCSRC).3 UCSZ11=Usart(1, UCSRC).2 UCSZ10=Usart(1, UCSRC).1 UCPOL1=Usart(1, UCSRC).0
";

/// Values of names in the header of a chip.
struct Header {
    registers: BTreeMap<String, u32>,
    vectors: BTreeMap<String, u32>,
    names: BTreeMap<String, u32>,
}

/// Names whose values are read in addition to registers and vectors.
const CONSTANTS: &[&str] = &[
    "RAMSTART",
    "RAMEND",
    "FLASHEND",
    "E2END",
    "SPM_PAGESIZE",
    "SIGNATURE_0",
    "SIGNATURE_1",
    "SIGNATURE_2",
    "FUSE_MEMORY_SIZE",
];

impl Header {
    /// Reads the header of `mcu`: the preprocessor gives the names, the compiler their values.
    fn of(mcu: &str) -> Header {
        let macros = gcc(mcu, &["-E", "-dM", "-x", "c", "-"], "#include <avr/io.h>\n");
        let defined: BTreeMap<&str, &str> = macros
            .lines()
            .filter_map(|line| line.strip_prefix("#define ")?.split_once(' '))
            .filter(|(name, _)| !name.contains('('))
            .collect();
        let bytes = |text: &str| text.starts_with("_SFR_IO8") || text.starts_with("_SFR_MEM8");
        let names: BTreeSet<&str> = BITS
            .lines()
            .filter_map(|line| line.rsplit_once('|'))
            .flat_map(|(_, bits)| bits.split(['=', ' ']))
            .filter(|name| defined.contains_key(name))
            .collect();
        let mut source = "#include <avr/io.h>\nvoid f(void) {\n".to_owned();
        let mut ask = |kind: &str, name: &str, value: &str| {
            source += &format!("__asm__ volatile(\"@@ {kind} {name} %0\" :: \"i\"({value}));\n");
        };
        for (name, text) in &defined {
            if bytes(text) {
                ask("register", name, &format!("&{name}"));
            } else if let Some(vector) = name.strip_suffix("_vect_num") {
                ask("vector", vector, name);
            } else if names.contains(name) || pin(name) || pin_change(name) || CONSTANTS.contains(name) {
                ask("name", name, &format!("(long)({name})"));
            }
        }
        source += "}\n";
        let listing = gcc(mcu, &["-S", "-o", "-", "-x", "c", "-"], &source);
        let mut header = Header { registers: BTreeMap::new(), vectors: BTreeMap::new(), names: BTreeMap::new() };
        for line in listing.lines().filter_map(|line| line.trim().strip_prefix("@@ ")) {
            let &[kind, name, value] = &line.split_whitespace().collect::<Vec<_>>()[..] else { panic!("{line}") };
            let value: i64 = value.parse().unwrap_or_else(|_| panic!("{line}"));
            let value = u32::try_from(value & 0xFFFF_FFFF).expect("32 bits");
            match kind {
                "register" => header.registers.insert(name.to_owned(), value),
                "vector" => header.vectors.insert(name.to_owned(), value),
                _ => header.names.insert(name.to_owned(), value),
            };
        }
        header
    }
}

/// Reports whether this is the name of a port pin, such as PB5.
fn pin(name: &str) -> bool {
    matches!(name.as_bytes(), [b'P', b'A'..=b'G', b'0'..=b'7'])
}

/// Reports whether this is the name of a pin change bit, such as PCINT12.
fn pin_change(name: &str) -> bool {
    name.strip_prefix("PCINT").is_some_and(|n| n.parse::<u8>().is_ok())
}

/// Checks that the chip has exactly the port pins and pin change inputs of the header.
fn check_pins(part: &AvrPart, header: &Header, wrong: &mut Vec<String>) {
    let chip = part.chip;
    let there = |id: usize| part.ports[id / 8] >> (id % 8) & 1 == 1 || id == usize::from(part.reset_pin);
    let ours = chip.pins.iter().enumerate().filter(|(id, p)| pin(p.name) && there(*id)).map(|(_, p)| p.name);
    let (ours, mut theirs) = (ours.collect::<BTreeSet<_>>(), BTreeSet::new());
    theirs.extend(header.names.keys().map(String::as_str).filter(|name| pin(name)));
    if ours != theirs {
        wrong.push(format!("{}: pins {:?}", chip.name, ours.symmetric_difference(&theirs).collect::<Vec<_>>()));
    }
    for (name, &bit) in header.names.iter().filter(|(name, _)| pin(name)) {
        if !name.ends_with(&bit.to_string()) {
            wrong.push(format!("{}: {name} is bit {bit}", chip.name));
        }
    }
    // PCINTn is bit n mod 8 of its mask and, on these chips, the same bit of its port.
    let ours: BTreeMap<String, u32> =
        part.pin_changes.iter().map(|&(pin, n)| (format!("PCINT{n}"), u32::from(pin % 8))).collect();
    let theirs = header.names.iter().filter(|(name, _)| pin_change(name));
    let theirs: BTreeMap<String, u32> = theirs.map(|(name, &bit)| (name.clone(), bit)).collect();
    if ours != theirs {
        wrong.push(format!("{}: {ours:?}\n  by the header {theirs:?}", chip.name));
    }
}

fn besides(name: &str) -> bool {
    BESIDES.lines().any(|line| line.split_whitespace().next() == Some(name))
}

fn check_registers(part: &AvrPart, header: &Header, wrong: &mut Vec<String>) {
    let chip = part.chip;
    for (name, &addr) in &header.registers {
        match chip.reg(name) {
            Some(ours) if u32::from(ours) == addr => {}
            None if besides(name) => {}
            ours => wrong.push(format!("{}: {name} is {addr:#x} in the header, ours {ours:x?}", chip.name)),
        }
    }
    for reg in chip.regs {
        if !header.registers.contains_key(reg.name) && !besides(reg.name) {
            wrong.push(format!("{}: the header has no {}", chip.name, reg.name));
        }
        let site = part.register_slots[usize::from(reg.addr)];
        if site == RegisterSlot::Reserved && reg.name != "OCDR" || matches!(site, RegisterSlot::Low(_)) {
            wrong.push(format!("{}: no register at {}", chip.name, reg.name));
        }
    }
    for (addr, site) in part.register_slots.iter().enumerate() {
        let named = chip.regs.iter().any(|reg| usize::from(reg.addr) == addr);
        if !named && !matches!(site, RegisterSlot::Reserved | RegisterSlot::Low(_)) {
            wrong.push(format!("{}: {site:?} at {addr:#x} has no name", chip.name));
        }
    }
}

fn check_vectors(part: &AvrPart, header: &Header, wrong: &mut Vec<String>) {
    let chip = part.chip;
    let ours: BTreeMap<String, u32> =
        chip.vectors.iter().zip(0..).skip(1).map(|(name, number)| ((*name).to_owned(), number)).collect();
    for (name, number) in &header.vectors {
        // Names of the same vector that differ between headers.
        let other = match name.as_str() {
            "SPM_Ready" => "SPM_READY",
            name => name,
        };
        if ours.get(other) != Some(number) {
            wrong.push(format!("{}: vector {name} is {number} in the header, ours {:?}", chip.name, ours.get(other)));
        }
    }
    let known: BTreeSet<u32> = header.vectors.values().copied().collect();
    for (name, number) in &ours {
        // The header of the ATmega128 omits 22, EE_READY.
        if !known.contains(number) && (chip.name, *number) != ("atmega128", 22) {
            wrong.push(format!("{}: the header has no vector {number}, ours is {name}", chip.name));
        }
    }
    if part.interrupt_sources.len() + 1 != chip.vectors.len() {
        wrong.push(format!(
            "{}: {} sources of {} vectors",
            chip.name,
            part.interrupt_sources.len(),
            chip.vectors.len()
        ));
    }
}

fn check_sizes(part: &AvrPart, header: &Header, wrong: &mut Vec<String>) {
    let chip = part.chip;
    let [a, b, c] = part.signature.map(u32::from);
    let fuses = chip.space("fuse").map_or(0, |space| space.size);
    let sizes = [
        ("RAMSTART", u32::from(chip.ram_start)),
        ("RAMEND", u32::from(chip.ram_start + chip.ram_len - 1)),
        ("FLASHEND", chip.flash_bytes - 1),
        ("E2END", u32::from(chip.eeprom_bytes - 1)),
        ("SPM_PAGESIZE", part.spm_kind.page),
        ("SIGNATURE_0", a),
        ("SIGNATURE_1", b),
        ("SIGNATURE_2", c),
        ("FUSE_MEMORY_SIZE", fuses),
    ];
    for (name, ours) in sizes {
        let theirs = header.names.get(name);
        // The headers of the ATmega164A and 164P have each other's signature (Atmel 8272 and 8011, signature
        // bytes).
        if name == "SIGNATURE_2" && ["atmega164a", "atmega164p"].contains(&chip.name) {
            continue;
        }
        if theirs != Some(&ours) && (theirs.is_some() || name != "FUSE_MEMORY_SIZE") {
            wrong.push(format!("{}: {name} is {theirs:x?} in the header, ours {ours:#x}", chip.name));
        }
    }
    if part.spm_kind.flash != chip.flash_bytes {
        wrong.push(format!("{}: {:#x} bytes for SPM", chip.name, part.spm_kind.flash));
    }
}

#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn rows_are_what_the_headers_say() {
    let mut wrong = Vec::new();
    for part in AVR_PARTS {
        let header = Header::of(part.chip.name);
        assert!(header.registers.len() > 50 && header.vectors.len() > 15, "{}", part.chip.name);
        check_registers(part, &header, &mut wrong);
        check_vectors(part, &header, &mut wrong);
        check_sizes(part, &header, &mut wrong);
        check_pins(part, &header, &mut wrong);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every bit of a split register is at the position that the header gives, and maps to the register that the
/// table names; the table lists all split registers.
#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn bits_land_where_they_belong() {
    let mut wrong = Vec::new();
    let mut walked = BTreeSet::new();
    for name in ["8", "16", "32", "64", "128", "162"].map(|name| format!("atmega{name}")) {
        let (part, header) = (part(&name).expect("a part"), Header::of(&name));
        for line in BITS.lines().filter(|line| line.contains('|')) {
            let &[chips, register, bits] = &line.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
                panic!("{line}")
            };
            if !chips.split(' ').any(|chip| name == format!("atmega{chip}")) {
                continue;
            }
            let addr = chip(&name).and_then(|chip| chip.reg(register)).expect("a register");
            let RegisterSlot::Split(ours) = part.register_slots[usize::from(addr)] else {
                panic!("{name}: {register}")
            };
            walked.insert((name.clone(), addr));
            let ours: BTreeMap<u32, String> = ours
                .iter()
                .map(|&SplitBit { bit, slot: site, its_bit: its }| (u32::from(bit), format!("{site:?}.{its}")))
                .collect();
            let theirs: BTreeMap<u32, String> = bits
                .replace(", ", ",")
                .split(' ')
                .map(|bit| {
                    let (bit, place) = bit.split_once('=').expect("bit=place");
                    let number = header.names.get(bit).unwrap_or_else(|| panic!("{name}: no {bit}"));
                    (*number, place.replace(',', ", "))
                })
                .collect();
            if ours != theirs {
                wrong.push(format!("{name}: {register}: {ours:?}\n  by the header {theirs:?}"));
            }
        }
        for (addr, site) in part.register_slots.iter().enumerate() {
            if matches!(site, RegisterSlot::Split(_)) && !walked.contains(&(name.clone(), addr as u16)) {
                wrong.push(format!("{name}: the table has no bits for {addr:#x}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Chips, the difference, and why the row is right. Documents are those of Atmel.
const OTHERWISE: &str = "
    atmega48pa | EEARH has 03, ours 00 | 256 bytes; DS40002061, EEARH
    atmega324pa | EEARH has 0F, ours 03 | 1 KB; 8272, EEARH
    atmega644pa | EEARH has 0F, ours 07 | 2 KB; 8272, EEARH
    atmega48 atmega48a | MCUCR has 13, ours 10 | no boot section, so no IVSEL; 2545 and DS40002061, MCUCR
    atmega48pa | MCUCR has 73, ours 70 | no boot section, so no IVSEL; DS40002061, MCUCR
    atmega328 | MCUCR has 73, ours 13 | BODS only in P and PA; DS40002061, MCUCR
    atmega164a atmega644 atmega644a | MCUCR has F3, ours 93 | BODS only in P and PA; 2593 and 8272, MCUCR
    atmega168a atmega88a | SPMCSR has DF, ours FF | the condition of SIGRD misspells the A; DS40002061, SPMCSR
    atmega48a | SPMCSR has 8F, ours FF | as 88A; RWWSRE clears the page buffer, RWWSB is read-only; DS40002061, SPMCSR
    atmega168 atmega88 | SPMCSR has DF, ours FF | SIGRD as in the A; open until it is read in 2545, SPMCSR
    atmega48 | SPMCSR has 8F, ours FF | as 88; RWWSRE clears the page buffer, RWWSB is read-only; 2545, SPMCSR
    atmega168a atmega88a | MCUCR has 10, ours 13 | IVSEL and IVCE are under a condition that lacks the A; DS40002061, MCUCR
    atmega168 atmega168a atmega88 atmega88a atmega48 atmega48a | TCCR0A has FF, ours F3 | bits of TCCR0B follow; 2545, TCCR0A
    atmega328p atmega328 atmega168p atmega88p atmega48p | TWAMR has 7F, ours FE | TWAM0 is bit 1; DS40002061, TWAMR
    atmega64 atmega128 | XMCRA has FF, ours 7E | bits of XMCRB follow; 2490 and 2467, XMCRA
";

/// The bits of each register by the header of a chip: bits follow the definition of their register, or a
/// comment that names it.
fn named_bits(part: &AvrPart) -> BTreeMap<u16, u8> {
    let files = gcc(part.chip.name, &["-M", "-x", "c", "-"], "#include <avr/io.h>\n");
    let is_of_chip = |path: &&str| path.rsplit('/').next().is_some_and(|file| file.starts_with("iom"));
    let macros = gcc(part.chip.name, &["-E", "-dM", "-x", "c", "-"], "#include <avr/io.h>\n");
    let defined: BTreeSet<&str> = macros.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
    let (mut bits, mut registers): (BTreeMap<u16, u8>, Vec<u16>) = (BTreeMap::new(), Vec::new());
    for path in files.split_whitespace().filter(is_of_chip) {
        let text = String::from_utf8_lossy(&std::fs::read(path).unwrap_or_else(|e| panic!("{path}: {e}"))).into_owned();
        for line in text.lines().map(str::trim) {
            let named = |text: &str| -> Vec<u16> {
                text.split(|c: char| !c.is_ascii_alphanumeric()).filter_map(|word| part.chip.reg(word)).collect()
            };
            // Lines in a condition have a space after the `#`.
            let words: Vec<&str> = line.trim_start_matches('#').split_whitespace().collect();
            match words[..] {
                ["/*", ..] if line.contains("reserved") || line.contains("_vect") => {}
                ["/*", ..] => registers = named(line),
                ["define", name, value, ..] if value.starts_with("_SFR_") => {
                    registers = part.chip.reg(name).into_iter().collect();
                }
                ["define", name, value, ..] => match value.parse::<u8>() {
                    Ok(bit @ 0..8) if !name.ends_with("_num") && defined.contains(name) => {
                        registers.iter().for_each(|addr| *bits.entry(*addr).or_default() |= 1 << bit);
                    }
                    Ok(_) => {}
                    Err(_) => registers.clear(),
                },
                _ => {}
            }
        }
    }
    bits
}

/// Reserved bits are those without a name in the header. Ports and flags are compared as a whole.
#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn reserved_bits_have_no_names() {
    let rows = OTHERWISE.lines().filter(|line| !line.trim().is_empty());
    let rows: Vec<Vec<&str>> = rows.map(|line| line.split('|').map(str::trim).collect()).collect();
    assert!(rows.iter().all(|row| row.len() == 3 && !row[2].is_empty()));
    let (mut wrong, mut count, mut used) = (Vec::new(), 0, BTreeSet::new());
    for part in AVR_PARTS {
        let (presence, mcu) = (RegisterPresence::new(part), part.chip.name);
        for (addr, named) in named_bits(part) {
            let names = part.chip.regs.iter().filter(|reg| reg.addr == addr).map(|reg| reg.name);
            let name = names.clone().next().expect("a name");
            let whole = ["PIN", "DDR", "PORT", "TIFR", "EIFR", "PCIFR"].iter().any(|start| name.starts_with(start));
            let ours = presence.existing_bits(addr, 0xFF);
            count += 1;
            if ours == Some(named) || whole && ours == Some(0xFF) {
                continue;
            }
            let what = format!("{name} has {named:02X}, ours {:02X}", ours.unwrap_or(0));
            let is = |row: &&Vec<&str>| row[1] == what && row[0].split(' ').any(|of| of == mcu);
            match rows.iter().position(|row| is(&row)) {
                Some(row) => _ = used.insert(row),
                None => wrong.push(format!("{mcu} | {what}")),
            }
        }
    }
    let gone: Vec<_> = (0..rows.len()).filter(|row| !used.contains(row)).map(|row| rows[row].join(" | ")).collect();
    assert!(wrong.is_empty() && gone.is_empty(), "{}\nno longer there: {gone:#?}", wrong.join("\n"));
    assert!(count > 1500, "{count} registers");
}

/// The inputs INTn and what each can detect: ISCn1 and ISCn0, or ISCn0 alone.
#[test]
#[ignore = "needs avr-gcc and avr-libc"]
fn senses_of_external_interrupts() {
    let mut wrong = Vec::new();
    for part in AVR_PARTS {
        let macros = gcc(part.chip.name, &["-E", "-dM", "-x", "c", "-"], "#include <avr/io.h>\n");
        let names: BTreeSet<&str> = macros.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
        for n in 0..8 {
            let has = |name: String| names.contains(name.as_str());
            let theirs = (has(format!("INT{n}_vect")), has(format!("ISC{n}1")));
            let own = part.external_kind.sense(n);
            let ours = (own.is_some(), own.is_some_and(|sense| sense != ExternalSense::EdgeWithoutClock));
            // The ATmega16, 32 and 162 call the one bit of INT2 ISC2.
            if ours != theirs || (ours == (true, false)) != has(format!("ISC{n}")) {
                wrong.push(format!("{}: INT{n} {own:?}, by the header {theirs:?}", part.chip.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
