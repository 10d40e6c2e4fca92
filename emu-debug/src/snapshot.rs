//! Snapshot files: the state of a machine, and its configuration (docs/formats/snapshot.md).
//!
//! A header identifies chip, program and options of the state; a checksum covers everything. A file that is
//! damaged, truncated or for another machine is refused here, before it reaches a machine.

use diag::{Diagnostic, DiagnosticCode, Pos, Severity};
use emu_core::image::Image;

/// The first bytes of every such file.
const MAGIC: &[u8; 8] = b"\x89EMUSNP\n";

/// The version that is written, and the only one that is read. It increases when the contents of a header or
/// a state change.
const VERSION: u16 = 2;

/// Code of a file that is not a snapshot.
pub const NO_SNAPSHOT: &str = "SNP001";
/// Code of a snapshot that ends early.
pub const CUT_SHORT: &str = "SNP002";
/// Code of a snapshot that was changed after it was written.
pub const CHECKSUM: &str = "SNP003";
/// Code of a snapshot in the format of another version.
pub const OTHER_VERSION: &str = "SNP004";
/// Code of a snapshot of another chip.
pub const OTHER_CHIP: &str = "SNP005";
/// Code of a snapshot of a machine with another program.
pub const OTHER_PROGRAM: &str = "SNP006";
/// Code of a snapshot of a machine with another configuration.
pub const OTHER_OPTIONS: &str = "SNP007";
/// Code of a snapshot whose contents are not a state of the machine.
pub const NO_STATE: &str = "SNP008";

/// All codes.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: NO_SNAPSHOT, title: "the file is not a snapshot",
        explain: "It does not begin like the files that --snapshot-out writes. Fix: give the name of such a file." },
    DiagnosticCode { code: CUT_SHORT, title: "a snapshot is truncated",
        explain: "The file has fewer bytes than its header says, so it was copied in part. emu itself writes a snapshot completely or not at \
                  all. Fix: copy it again, or make it again." },
    DiagnosticCode { code: CHECKSUM, title: "a snapshot is damaged",
        explain: "Its checksum (CRC-32 over all bytes before it) does not match: bytes were changed, usually by a copy as text. \
                  Fix: copy it again, or make it again." },
    DiagnosticCode { code: OTHER_VERSION, title: "a snapshot of another version",
        explain: "A version of emu with another snapshot format wrote it. Fix: use that version, or make it again." },
    DiagnosticCode { code: OTHER_CHIP, title: "a snapshot of another chip",
        explain: "A state only fits the chip that it was taken from. Fix: name that chip with --mcu." },
    DiagnosticCode { code: OTHER_PROGRAM, title: "a snapshot of another program",
        explain: "The image contains other bytes than the image of the snapshot. The file format (HEX or ELF) and the \
                  symbols do not matter. Fix: give the image of the snapshot, or make the snapshot again." },
    DiagnosticCode { code: OTHER_OPTIONS, title: "a snapshot of a machine with another configuration",
        explain: "Clock, fuses, configuration word, wiring, and the contents of RAM after power-up belong to a machine and not to its \
                  state. The message gives the differences. Fix: give the flags with which the snapshot was made." },
    DiagnosticCode { code: NO_STATE, title: "a snapshot without a state of this machine",
        explain: "The file is complete, but its contents cannot be the state of such a machine. Another build of emu, \
                  or another program, made it. Fix: make it again." },
];

/// The header of a snapshot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SnapshotHeader {
    /// Name of the chip.
    pub chip: String,
    /// [`image_hash`] of the image.
    pub program: u64,
    /// The configuration of the machine: the command-line options that affect it, with their values, such as
    /// `--clock 8000000 --x2`.
    pub options: String,
    /// Machine cycle at which it was taken.
    pub cycle: u64,
}

/// Returns a hash of the bytes of an image, however they are divided into segments.
#[must_use]
pub fn image_hash(image: &Image) -> u64 {
    let mut segments: Vec<_> = image.segments.iter().collect();
    segments.sort_by_key(|segment| (segment.space, segment.addr));
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    let mut mix = |byte: u8| hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3);
    for segment in segments {
        for (addr, &byte) in (u64::from(segment.addr)..).zip(&segment.bytes) {
            segment.space.bytes().chain(addr.to_le_bytes()).for_each(&mut mix);
            mix(byte);
        }
    }
    hash
}

/// Returns true if a file begins as every snapshot does.
#[must_use]
pub fn is_snapshot(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Returns the file of a snapshot; `state` comes from [`Cpu::save`](emu_core::Cpu::save).
#[must_use]
pub fn encode_snapshot(header: &SnapshotHeader, state: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    for text in [&header.chip, &header.options] {
        body.extend((text.len() as u32).to_le_bytes());
        body.extend(text.as_bytes());
    }
    body.extend(header.program.to_le_bytes());
    body.extend(header.cycle.to_le_bytes());
    body.extend(state);
    let mut file = MAGIC.to_vec();
    file.extend(VERSION.to_le_bytes());
    file.extend((body.len() as u64).to_le_bytes());
    file.extend(body);
    file.extend(crc32(&file).to_le_bytes());
    file
}

/// The content of a snapshot file.
#[derive(Debug, PartialEq, Eq)]
pub struct DecodedSnapshot<'a> {
    /// What the file says about its machine.
    pub header: SnapshotHeader,
    /// The state of the machine.
    pub state: &'a [u8],
}

/// Returns header and state of the file `name` with these bytes.
///
/// # Errors
/// The fault of the file.
pub fn decode_snapshot<'a>(name: &str, bytes: &'a [u8]) -> Result<DecodedSnapshot<'a>, Diagnostic> {
    let wrong = |code, cause: String, hint: &str| Err(fault(name, code, cause, hint));
    const AGAIN: &str = "copy it again, or make it again with --snapshot-out";
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        let cut = !bytes.is_empty() && MAGIC.starts_with(bytes);
        return match cut {
            true => wrong(CUT_SHORT, format!("ends after {} bytes, in the middle of its head", bytes.len()), AGAIN),
            false => wrong(NO_SNAPSHOT, "is not a snapshot".to_owned(), "give a file that --snapshot-out has written"),
        };
    };
    let mut fields = FieldReader(rest);
    let (Some(version), Some(len)) = (fields.number(2), fields.number(8)) else {
        return wrong(CUT_SHORT, format!("ends after {} bytes, in the middle of its head", bytes.len()), AGAIN);
    };
    let expected_bytes = len.saturating_add(4);
    let bytes_left = fields.0.len() as u64;
    if version != u64::from(VERSION) {
        let cause = format!("is a snapshot of version {version}, and this emu knows version {VERSION}");
        return wrong(OTHER_VERSION, cause, "use the emu that wrote it, or make it again");
    }
    if bytes_left < expected_bytes {
        return wrong(CUT_SHORT, format!("ends {} bytes early", expected_bytes - bytes_left), AGAIN);
    }
    let Some((front, sum)) = bytes.split_last_chunk::<4>().filter(|_| bytes_left == expected_bytes) else {
        return wrong(CHECKSUM, format!("has {} bytes after its end", bytes_left - expected_bytes), AGAIN);
    };
    let (computed, stored) = (crc32(front), u32::from_le_bytes(*sum));
    if computed != stored {
        return wrong(CHECKSUM, format!("is damaged: its checksum is {computed:08x}, and it says {stored:08x}"), AGAIN);
    }
    let mut fields = FieldReader(fields.0.get(..len as usize).unwrap_or_default());
    let mut read_header = || {
        let (chip, options) = (fields.text()?, fields.text()?);
        let (program, cycle) = (fields.number(8)?, fields.number(8)?);
        Some(DecodedSnapshot { header: SnapshotHeader { chip, program, options, cycle }, state: fields.0 })
    };
    read_header().ok_or_else(|| invalid_state(name))
}

/// The state of a machine in a snapshot file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MachineState<'a> {
    /// The cycle of the machine.
    pub cycle: u64,
    /// The bytes of the state.
    pub state: &'a [u8],
}

/// Returns the state in the file and its cycle, if it belongs to the machine that `expected` describes (the
/// cycle is ignored).
///
/// # Errors
/// The fault of the file, or the difference between the machine and the file.
pub fn decode_snapshot_for<'a>(
    name: &str,
    bytes: &'a [u8],
    expected: &SnapshotHeader,
) -> Result<MachineState<'a>, Diagnostic> {
    let DecodedSnapshot { header, state } = decode_snapshot(name, bytes)?;
    let (code, cause, hint) = if header.chip != expected.chip {
        let cause = format!("is a snapshot of {}, and the chip is {}", header.chip, expected.chip);
        (OTHER_CHIP, cause, "name the chip of the snapshot with --mcu")
    } else if header.program != expected.program {
        let cause = "is a snapshot of another program".to_owned();
        (OTHER_PROGRAM, cause, "give the image with which it was made, or make it again")
    } else if header.options != expected.options {
        (
            OTHER_OPTIONS,
            option_difference(&header.options, &expected.options),
            "give the flags with which it was made, or make it again",
        )
    } else {
        return Ok(MachineState { cycle: header.cycle, state });
    };
    Err(fault(name, code, cause, hint))
}

/// Describes the options that only one of two configurations has.
fn option_difference(file_options: &str, machine_options: &str) -> String {
    let split = |options: &str| options.split(" --").map(|flag| flag.trim_start_matches("--").to_owned()).collect();
    let (file_options, machine_options): (Vec<String>, Vec<String>) = (split(file_options), split(machine_options));
    let only_in_first = |some: &[String], others: &[String]| {
        let flags: Vec<_> = some.iter().filter(|flag| !others.contains(flag)).map(|flag| format!("--{flag}")).collect();
        flags.join(" ")
    };
    match (only_in_first(&file_options, &machine_options), only_in_first(&machine_options, &file_options)) {
        (has, lacks) if has.is_empty() => format!("is of a machine without `{lacks}`"),
        (has, lacks) if lacks.is_empty() => format!("is of a machine with `{has}`, and this one is without"),
        (has, other) => format!("is of a machine with `{has}`, and this one has `{other}`"),
    }
}

/// Returns the diagnostic for an intact file whose contents are not a state of the machine.
#[must_use]
pub fn invalid_state(name: &str) -> Diagnostic {
    fault(name, NO_STATE, "does not contain a state of this machine".to_owned(), "make it again with --snapshot-out")
}

fn fault(name: &str, code: &'static str, cause: String, hint: &str) -> Diagnostic {
    Diagnostic::new(Severity::Error, code, name, Pos::default(), cause, hint)
}

/// The bytes that are still to be read.
struct FieldReader<'a>(&'a [u8]);

impl FieldReader<'_> {
    fn bytes(&mut self, len: usize) -> Option<&[u8]> {
        let (bytes, rest) = self.0.split_at_checked(len)?;
        self.0 = rest;
        Some(bytes)
    }

    fn number(&mut self, bytes: usize) -> Option<u64> {
        Some(self.bytes(bytes)?.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte)))
    }

    fn text(&mut self) -> Option<String> {
        let len = self.number(4)?;
        String::from_utf8(self.bytes(usize::try_from(len).ok()?)?.to_vec()).ok()
    }
}

/// Computes the CRC-32 of IEEE 802.3.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (SnapshotHeader, Vec<u8>) {
        let head = SnapshotHeader { chip: "atmega328p".into(), program: 7, options: "16 MHz".into(), cycle: 1234 };
        let file = encode_snapshot(&head, &[1, 2, 3, 0, 255]);
        (head, file)
    }

    #[test]
    fn comes_back() {
        let (head, file) = sample();
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        assert_eq!(
            decode_snapshot("x", &file),
            Ok(DecodedSnapshot { header: head.clone(), state: &[1, 2, 3, 0, 255] })
        );
        assert_eq!(
            decode_snapshot_for("x", &file, &SnapshotHeader { cycle: 0, ..head }),
            Ok(MachineState { cycle: 1234, state: &[1, 2, 3, 0, 255] })
        );
    }

    #[test]
    fn what_differs_is_named() {
        let cases = [
            ("--clock 8 --ram zero", "--clock 9 --ram zero", "with `--clock 8`, and this one has `--clock 9`"),
            ("--clock 8 --x2", "--clock 8", "with `--x2`, and this one is without"),
            ("--clock 8", "--clock 8 --no-start-up", "without `--no-start-up`"),
        ];
        for (own, wanted, says) in cases {
            assert_eq!(option_difference(own, wanted), format!("is of a machine {says}"));
        }
    }

    #[test]
    fn no_damage_passes() {
        let (_, file) = sample();
        for len in 0..file.len() {
            let code = decode_snapshot("x", &file[..len]).map_err(|d| d.code);
            assert_eq!(code, Err(if len == 0 { NO_SNAPSHOT } else { CUT_SHORT }), "cut to {len}");
        }
        for at in 0..8 * file.len() {
            let mut damaged = file.clone();
            damaged[at / 8] ^= 1 << (at % 8);
            assert!(decode_snapshot("x", &damaged).is_err(), "bit {at}");
        }
        let longer: Vec<u8> = file.iter().copied().chain([0]).collect();
        assert_eq!(decode_snapshot("x", &longer).map_err(|d| d.code), Err(CHECKSUM));
    }
}
