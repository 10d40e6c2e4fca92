//! Names of Atmel's include files that the chip's data does not give, or gives another value: fuse and lock
//! bits, bits of old names, limits of the boot section.

use emu_core::chip::Chip;

/// Chips (`8` is the ATmega8 with its file `m8def.inc`), and names with values: `LB1=0`, or `CAL0-6` for
/// `CAL0` to `CAL6` with the values 0 to 6.
#[rustfmt::skip]
const NAMES: &[(&str, &str)] = &[
    ("8 16 32 64 128 162 48 88 168 328P 644", "BLB01=2 BLB02=3 BLB11=4 BLB12=5 CKSEL0-3 EESAVE=3 LB1=0 LB2=1 RWW_START_ADDR=0 SIGNATURE_000=0x1e SPIEN=5"),
    ("8 16 32 64 128 162 88 168 328P 644", "BOOTRST=0 BOOTSZ0=1 BOOTSZ1=2"),
    ("8 16 64 128 162 48 88 168 328P 644", "SUT0=4 SUT1=5"),
    ("8 16 32 64 128 162 644", "CAL0-6 EEDR0-7 PWM10-1 SPDR0-7 TCNT2_0-7"),
    ("8 16 32 64 128 162", "CTC10=3 CTC11=4 CTC2=3 OCR2_0-7 PWM2=6"),
    ("8 16 32 64 128 644", "CAL7=7 TWBR0-7 TWD0-7"),
    ("16 32 64 128 162 644", "JTAGEN=6 OCDEN=7 TCNT0_0-7"),
    ("162 48 88 168 328P 644", "CKOUT=6 PSR10=0 WDTON=4"),
    ("8 16 32 64 128", "BODEN=6 BODLEVEL=7"),
    ("8 16 162 88 168", "EEADRBITS=9"),
    ("8 48 88 168 328P", "RSTDISBL=7"),
    ("16 32 64 128 162", "ASB=6 ASRE=4 CTC0=3 OCR0_0-7 PWM0=6"),
    ("16 32 64 128 644", "ADCH0-7 ADCL0-7"),
    ("16 48 88 168 328P", "EXTREF=1"),
    ("48 88 168 328P 644", "BODLEVEL0-2 CKDIV8=7 PSR2=1 TOIE2A=0 TWAMR0=1 TWAMR1=2 TWAMR2=3 TWAMR3=4 TWAMR4=5 TWAMR5=6 TWAMR6=7 UMSEL0=6 UMSEL1=7"),
    ("8 16 32 162", "UBRRHI=0x20 UCR=0xa USR=0xb"),
    ("8 16 32 644", "CTC1=3"),
    ("8 16 64 128", "CKOPT=4 ENI2C=2 I2EA=6 I2EN=2 I2GCE=0 I2IE=0 I2INT=7 I2S3-7 I2STA=5 I2STO=4 I2WC=3 TWS0-1"),
    ("8 64 128 162", "WDTCSR=0x21 WDTOE=4"),
    ("48 88 168 328P", "DWEN=6"),
    ("8 16 32", "CHR9=2 UDR0-7 UPE=2"),
    ("8 16 162", "EEWEE=2"),
    ("16 32 64", "ADFR=5"),
    ("16 162 168", "FIRSTBOOTSTART=0x1f80 FOURTHBOOTSTART=0x1c00 LARGEBOOTSTART=0x1c00 NRWW_START_ADDR=0x1c00 NRWW_STOP_ADDR=0x1fff"),
    ("16 162 168", "RWW_STOP_ADDR=0x1bff SECONDBOOTSTART=0x1f00 SIGNATURE_001=0x94 SMALLBOOTSTART=0x1f80 THIRDBOOTSTART=0x1e00"),
    ("32 64 128", "SIGNATURE_002=2"),
    ("64 128 162", "PSR1=0"),
    ("48 88 168", "OCROA_0-7"),
    ("8 16", "I2AR=2 I2BR=0 I2CR=0x36 I2DR=3 I2SR=1"),
    ("8 88", "FIRSTBOOTSTART=0xf80 FOURTHBOOTSTART=0xc00 LARGEBOOTSTART=0xc00 NRWW_START_ADDR=0xc00 NRWW_STOP_ADDR=0xfff RWW_STOP_ADDR=0xbff"),
    ("8 88", "SECONDBOOTSTART=0xf00 SIGNATURE_001=0x93 SMALLBOOTSTART=0xf80 THIRDBOOTSTART=0xe00"),
    ("16 32", "WDDE=4"),
    ("16 162", "IDRD=7 OCDR0-7"),
    ("32 328P", "EEADRBITS=0xa FIRSTBOOTSTART=0x3f00 FOURTHBOOTSTART=0x3800 LARGEBOOTSTART=0x3800 NRWW_START_ADDR=0x3800 NRWW_STOP_ADDR=0x3fff"),
    ("32 328P", "RWW_STOP_ADDR=0x37ff SECONDBOOTSTART=0x3e00 SIGNATURE_001=0x95 SMALLBOOTSTART=0x3f00 THIRDBOOTSTART=0x3c00"),
    ("64 128", "CTC30=3 CTC31=4 GICR=0x39 GIFR=0x38 GIMSK=0x39 I2AR=0x72 I2BR=0x70 I2CR=0x74 I2DR=0x73 I2SR=0x71 PSR2=0 PSR3=0 PWM30-1 UDR00-7"),
    ("64 128", "UDR10-7 WDTON=0"),
    ("64 644", "EEADRBITS=0xb FIRSTBOOTSTART=0x7e00 FOURTHBOOTSTART=0x7000 LARGEBOOTSTART=0x7000 NRWW_START_ADDR=0x7000 NRWW_STOP_ADDR=0x7fff"),
    ("64 644", "RWW_STOP_ADDR=0x6fff SECONDBOOTSTART=0x7c00 SIGNATURE_001=0x96 SMALLBOOTSTART=0x7e00 THIRDBOOTSTART=0x7800"),
    ("162 644", "UDR0_0-7"),
    ("48 88", "OC0Baddr=0x1f"),
    ("328P 644", "_UBRR0-1"),
    ("8", "ADHSM=4 SIGNATURE_002=7 TCNT00-7 WTDON=6"),
    ("16", "ADHSM=3 SIGNATURE_002=3 SPMCSR=0x37"),
    ("64", "CompMode=1"),
    ("128", "EEADRBITS=0xc FIRSTBOOTSTART=0xfe00 FOURTHBOOTSTART=0xf000 LARGEBOOTSTART=0xf000 M103C=1 NRWW_START_ADDR=0xf000"),
    ("128", "NRWW_STOP_ADDR=0xffff RWW_STOP_ADDR=0xefff SECONDBOOTSTART=0xfc00 SIGNATURE_001=0x97 SMALLBOOTSTART=0xfe00"),
    ("128", "THIRDBOOTSTART=0xf800"),
    ("162", "AINBG=6 BODLEVEL0=1 BODLEVEL1=2 BODLEVEL2=3 CHR91=2 CLKDIV8=7 DOR=3 EIMSK=0x3b FE=4 GIMSK=0x3b JDT=7 M161C=4 MCUSR=0x34"),
    ("162", "PINE3=3 PSR0=0 RXB8=1 RXC=7 RXCIE=7 RXEN=4 SIGNATURE_002=4 SM=4 SRW=6 TXB8=0 TXC=6 TXCIE=6 TXEN=3 U2X=1 UBRR=9 UBRR0=9 UBRR1=0"),
    ("162", "UCPOL=0 UCSZ0=1 UCSZ1=2 UCSZ2=2 UDR=0xc UDR1_0-7 UDRE=5 UDRIE=5 UMSEL=6 UPM0=4 UPM1=5 URSEL=7 USBS=3"),
    ("48", "EEADRBITS=8 EEMWE=2 EEWE=1 NRWW_START_ADDR=0 NRWW_STOP_ADDR=0x7ff RWW_STOP_ADDR=0 SIGNATURE_001=0x92 SIGNATURE_002=5"),
    ("88", "SIGNATURE_002=0xa"),
    ("168", "SIGNATURE_002=6"),
    ("328P", "SIGNATURE_002=0xf"),
    ("644", "EEAR0-7 EEAR10=2 EEAR11=3 EEAR8=0 EEAR9=1 GPIOR00-7 GPIOR10-7 GPIOR20-7 OCR0A_0-7 OCR0B_0-7 OCR2A_0-7 OCR2B_0-7"),
    ("644", "SIGNATURE_002=9 UBRR2-7 UBRR10=2 UBRR11=3 UBRR8=0 UBRR9=1 UDORD0=2"),
];

/// Returns the names of the chip's file with their values.
pub(super) fn further_names(chip: &Chip) -> impl Iterator<Item = (String, i64)> {
    let number = chip.name.trim_start_matches("atmega");
    let rows = NAMES.iter().filter(move |(chips, _)| chips.split(' ').any(|own| own.eq_ignore_ascii_case(number)));
    rows.flat_map(|(_, names)| names.split(' ')).flat_map(entry)
}

/// Returns the names of one entry.
fn entry(text: &str) -> Vec<(String, i64)> {
    if let Some((name, value)) = text.split_once('=') {
        let value = match value.strip_prefix("0x") {
            Some(digits) => i64::from_str_radix(digits, 16),
            None => value.parse(),
        };
        return value.into_iter().map(|value| (name.to_owned(), value)).collect();
    }
    let range = text.split_once('-').and_then(|(first, last)| {
        let (stem, digit) = first.split_at_checked(first.len().checked_sub(1)?)?;
        Some((stem, digit.parse().ok()?..=last.parse().ok()?))
    });
    range.into_iter().flat_map(|(stem, numbers)| numbers.map(move |n: i64| (format!("{stem}{n}"), n))).collect()
}
