//! Requests for memory as bytes, and for program memory as instructions.

use emu_debug::debug::{ExpressionPlace, UserAction};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::error::DapError;
use crate::listing::hex_words;
use crate::protocol::{DapRequest, RequestError};

/// Maximum number of bytes per request.
const MAX_BYTES: i64 = 1 << 20;

/// Maximum number of instructions per answer.
const MOST_INSTRUCTIONS: i64 = 10_000;

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct MemoryArguments {
    memory_reference: String,
    offset: Option<i64>,
    count: i64,
    data: String,
    allow_partial: bool,
    instruction_offset: Option<i64>,
    instruction_count: i64,
}

impl DapMachine {
    /// Parses a memory reference to a memory and a byte address in it: `data:0x100`, `buf`, or an address of
    /// program memory.
    fn parse_memory_reference(&self, text: &str) -> Result<(&'static str, i64), DapError> {
        let scope = &self.session.scope;
        let chip = scope.chip();
        let plain = emu_debug::address_names::parse_number(text.trim());
        let text = plain.map_or_else(|| text.to_owned(), |number| format!("{}:0x{number:x}", chip.code_space));
        let range = scope.parse_range(&text)?;
        Ok((range.space, i64::from(range.start) * i64::from(chip.bytes_per_address(range.space))))
    }

    /// The program word of an address plus an offset, in the units in which the chip counts code addresses.
    ///
    /// # Errors
    /// The result is not an address of program memory.
    pub fn code_word(&self, text: &str, offset: i64) -> Result<u32, DapError> {
        let scope = &self.session.scope;
        let (chip, names) = (scope.chip(), scope.source().names);
        let word = names.parse_program_word(text)?;
        let address = i64::from(chip.code_address(word)).saturating_add(offset);
        let address =
            u32::try_from(address).map_err(|_| DapError::AddressOverflow { address: text.to_owned(), offset })?;
        Ok(names.parse_program_word(&format!("0x{address:x}"))?)
    }

    /// The memory reference of a byte, in the units in which the memory is addressed.
    pub fn memory_reference(&self, space: &str, byte: u32) -> String {
        format!("{space}:0x{:x}", byte / self.session.scope.chip().bytes_per_address(space))
    }
}

impl DebugAdapter<'_> {
    /// Answers `readMemory`: bytes of a memory in base64.
    pub(crate) fn read_memory(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let MemoryArguments { memory_reference, offset, count, .. } = request.parse_arguments()?;
        if !(0..=MAX_BYTES).contains(&count) {
            return Err(RequestError::not_possible(format!("count is 0 to {MAX_BYTES} bytes")));
        }
        let machine = self.machine()?;
        let (space, start) = machine.parse_memory_reference(&memory_reference).map_err(RequestError::not_found)?;
        let start = start.saturating_add(offset.unwrap_or(0));
        let target = machine.session.machine();
        let byte = |n: i64| u32::try_from(start.saturating_add(n)).ok().and_then(|at| target.peek(space, at));
        let found: Vec<u8> = (0..count).map_while(byte).collect();
        let width = i64::from(machine.session.scope.chip().bytes_per_address(space));
        let mut answer = json!({ "address": format!("0x{:x}", start.max(0) / width) });
        if !found.is_empty() {
            answer["data"] = encode_base64(&found).into();
        }
        if (found.len() as i64) < count {
            answer["unreadableBytes"] = (count - found.len() as i64).into();
        }
        Ok(answer)
    }

    /// Answers `writeMemory`: writes bytes given in base64.
    pub(crate) fn write_memory(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let MemoryArguments { memory_reference, offset, data, allow_partial, .. } = request.parse_arguments()?;
        let bytes = decode_base64(&data).ok_or_else(|| RequestError::not_possible("data is not base64"))?;
        if bytes.len() as i64 > MAX_BYTES {
            return Err(RequestError::not_possible(format!("at most {MAX_BYTES} bytes are written at once")));
        }
        let machine = self.machine()?;
        let (space, start) = machine.parse_memory_reference(&memory_reference).map_err(RequestError::not_found)?;
        let start = start.saturating_add(offset.unwrap_or(0));
        let there = |n: usize| {
            let at = u32::try_from(start.saturating_add(n as i64)).ok();
            at.filter(|at| machine.session.machine().peek(space, *at).is_some())
        };
        let places: Vec<u32> = (0..bytes.len()).map_while(there).collect();
        if places.len() < bytes.len() && !allow_partial {
            let text = format!("{} of {} bytes are beyond {space}", bytes.len() - places.len(), bytes.len());
            return Err(RequestError::not_possible(text));
        }
        for (addr, byte) in places.iter().zip(&bytes) {
            let place = ExpressionPlace::Memory { space, addr: *addr, bytes: 1, signed: false };
            machine.act(UserAction::Set(place, (*byte).into()))?;
        }
        self.invalidate_client();
        Ok(json!({ "bytesWritten": places.len() }))
    }

    /// Answers `disassemble`: instructions around an address.
    pub(crate) fn disassemble(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let MemoryArguments { memory_reference, offset, instruction_offset, instruction_count, .. } =
            request.parse_arguments()?;
        if !(0..=MOST_INSTRUCTIONS).contains(&instruction_count) {
            return Err(RequestError::not_possible(format!("instructionCount is 0 to {MOST_INSTRUCTIONS}")));
        }
        let client = self.client.clone();
        let machine = self.machine()?;
        let base = machine.code_word(&memory_reference, offset.unwrap_or(0)).map_err(RequestError::not_found)?;
        let skip = instruction_offset.unwrap_or(0);
        let back = usize::try_from(skip.saturating_neg().max(0)).unwrap_or(usize::MAX);
        let mut found = Vec::new();
        // Instructions before the first one are reported as invalid, because the client expects the requested
        // number.
        let there = (0..=back.min(MOST_INSTRUCTIONS as usize)).rev().find_map(|n| match n {
            0 => Some((0, base)),
            n => machine.listing().instruction_before(base, n).map(|word| (n, word)),
        });
        let (reached, mut word) = there.unwrap_or((0, base));
        let missing = back.saturating_sub(reached).min(instruction_count as usize);
        found.extend((0..missing).map(|_| invalid_instruction()));
        let mut left = skip.max(0);
        let (chip, words) = (machine.session.scope.chip(), machine.words());
        while (found.len() as i64) < instruction_count {
            if word >= words {
                found.push(invalid_instruction());
                continue;
            }
            let read = |n: u32| machine.session.word(word.saturating_add(n));
            let line = (chip.isa.disassemble)(&[read(0), read(1), read(2)], word);
            let len = (line.len as u32).max(1);
            if left > 0 {
                left -= 1;
            } else {
                found.push(machine.instruction(word, len, &line.text, &client));
            }
            word = word.saturating_add(len);
        }
        Ok(json!({ "instructions": found }))
    }
}

impl DapMachine {
    /// Number of words of program memory.
    fn words(&self) -> u32 {
        let chip = self.session.scope.chip();
        chip.flash_bytes / chip.word_bytes.max(1)
    }

    fn instruction(&self, word: u32, len: u32, text: &str, client: &crate::adapter::ClientCapabilities) -> Value {
        let scope = &self.session.scope;
        let mut body = json!({
            "address": format!("0x{:04x}", scope.chip().code_address(word)),
            "instructionBytes": hex_words(&self.session, word, len),
            "instruction": text,
        });
        let byte = word.saturating_mul(scope.chip().word_bytes);
        if let Some(name) = scope.source().names.nearest_symbol(byte).filter(|name| !name.contains("+0x")) {
            body["symbol"] = name.into();
        }
        let source = scope.source();
        let begins = source.line_at(word).filter(|line| line.addr == byte);
        if let Some(line) = begins {
            body["location"] = self.source_of(line);
            body["line"] = client.line(line.line).into();
        } else if let Some((ladder, line)) =
            self.ladder.as_ref().and_then(|ladder| Some((ladder, ladder.line_beginning_at(word)?)))
        {
            body["location"] = ladder.source();
            body["line"] = client.line(line).into();
        }
        body
    }
}

/// The placeholder for an instruction outside of program memory.
fn invalid_instruction() -> Value {
    json!({ "address": "0x0", "instruction": "", "presentationHint": "invalid" })
}

/// The digits of base64 (RFC 4648, section 4).
const BASE64_DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

fn encode_base64(bytes: &[u8]) -> String {
    let group = |three: &[u8]| {
        let bits = three.iter().chain([&0; 3]).take(3).fold(0u32, |bits, byte| bits << 8 | u32::from(*byte));
        let digit = |n: usize| match n <= three.len() {
            true => char::from(BASE64_DIGITS[(bits >> (18 - 6 * n) & 63) as usize]),
            false => '=',
        };
        (0..4).map(digit).collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let bare = text.trim_end_matches('=');
    if !text.len().is_multiple_of(4) || text.len() - bare.len() > 2 {
        return None;
    }
    let mut bytes = Vec::new();
    let (mut bits, mut have) = (0u32, 0);
    for digit in bare.bytes() {
        bits = bits << 6 | BASE64_DIGITS.iter().position(|known| *known == digit)? as u32;
        have += 6;
        if have >= 8 {
            have -= 8;
            bytes.push((bits >> have) as u8);
            bits &= (1 << have) - 1;
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::{decode_base64, encode_base64};

    #[test]
    fn base64() {
        // RFC 4648, section 10.
        let known =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")];
        for (bytes, text) in known {
            assert_eq!(encode_base64(bytes.as_bytes()), text);
            assert_eq!(decode_base64(text).as_deref(), Some(bytes.as_bytes()), "{text}");
        }
        for byte in 0..=255u8 {
            assert_eq!(decode_base64(&encode_base64(&[byte, !byte])), Some(vec![byte, !byte]));
        }
        for wrong in ["Z", "Zg", "Zg=", "Z===", "Zg=a", "Z\u{e4}=="] {
            assert_eq!(decode_base64(wrong), None, "{wrong}");
        }
    }
}
