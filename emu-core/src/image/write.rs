//! Writes segments as Intel HEX.

use ihex::checksum;

const DATA_BYTES: u32 = 16;

/// Bytes for a place in an image file.
#[derive(Debug, Clone, Copy)]
pub struct HexSegment<'a> {
    /// The byte address of the first byte.
    pub addr: u32,
    /// The bytes from there.
    pub bytes: &'a [u8],
}

/// Writes Intel HEX. `segments` are byte addresses of the image file with their bytes, in any order; they
/// must not overlap or extend beyond 4 GB. Addresses ascend. A line has up to 16 data bytes and never crosses
/// a multiple of 64 KB; a type 04 record precedes data of another 64 KB. Digits are in upper case, and every
/// line ends with `\n`. [`super::load_hex`] accepts the result.
#[must_use]
pub fn write_hex(segments: &[HexSegment<'_>]) -> String {
    hex_text(segments, false)
}

/// Writes Intel HEX as the tools of gputils do. It is like [`write_hex`], but no line crosses a multiple of
/// 16 bytes. With `extended` (their INHX32, otherwise INHX8M) a type 04 record also precedes the first 64 KB.
#[must_use]
pub fn write_hex_aligned(segments: &[HexSegment<'_>], extended: bool) -> String {
    let mut text = String::new();
    if extended {
        push_record(&mut text, 0, 4, &[0, 0]);
    }
    text + &hex_text(segments, true)
}

/// Returns the text. With `aligned`, no line crosses a multiple of 16 bytes.
fn hex_text(segments: &[HexSegment<'_>], aligned: bool) -> String {
    let mut sorted = segments.to_vec();
    sorted.sort_by_key(|&HexSegment { addr, .. }| addr);
    let mut text = String::new();
    let mut upper = 0;
    for HexSegment { mut addr, mut bytes } in sorted {
        while !bytes.is_empty() {
            if addr >> 16 != upper {
                upper = addr >> 16;
                push_record(&mut text, 0, 4, &(upper as u16).to_be_bytes());
            }
            let longest = if aligned { DATA_BYTES - addr % DATA_BYTES } else { DATA_BYTES };
            let room = longest.min(0x1_0000 - (addr & 0xFFFF)) as usize;
            let (line, rest) = bytes.split_at(room.min(bytes.len()));
            push_record(&mut text, addr as u16, 0, line);
            addr = addr.wrapping_add(line.len() as u32);
            bytes = rest;
        }
    }
    push_record(&mut text, 0, 1, &[]);
    text
}

fn push_record(text: &mut String, offset: u16, kind: u8, data: &[u8]) {
    let [high, low] = offset.to_be_bytes();
    let mut bytes = vec![data.len() as u8, high, low, kind];
    bytes.extend_from_slice(data);
    bytes.push(checksum(&bytes));
    text.push(':');
    bytes.iter().for_each(|byte| text.push_str(&format!("{byte:02X}")));
    text.push('\n');
}
