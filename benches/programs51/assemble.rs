//! Assembles a text: an instruction a line, `;` begins a comment, `name:` in front a label; `.org` moves on, `.ascii "TEXT"` is a
//! text without any of `;:"`.

use emu_8051::isa::assemble;
use emu_core::image::{Image, Segment};

/// Assembles a program from address 0.
///
/// # Errors
/// The first line that is no instruction, with its number and the cause.
pub fn image(source: &str) -> Result<Image, String> {
    let mut labels = source.lines().filter_map(|line| Some((split(line).0?, None))).collect();
    // Twice: at first a label that is not known yet stands where it is used, which is in reach and as long as the right place.
    pass(source, &mut labels)?;
    let bytes = pass(source, &mut labels)?;
    Ok(Image { segments: vec![Segment { space: "code", addr: 0, bytes }], ..Image::default() })
}

/// The label in front of a line, and its instruction.
fn split(line: &str) -> (Option<&str>, &str) {
    let code = line.split(';').next().unwrap_or("").trim();
    code.split_once(':').map_or((None, code), |(label, rest)| (Some(label), rest.trim()))
}

fn pass(source: &str, labels: &mut Vec<(&str, Option<usize>)>) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    for (number, line) in (1..).zip(source.lines()) {
        let (label, code) = split(line);
        if let Some((_, place)) = labels.iter_mut().find(|(name, _)| Some(*name) == label) {
            *place = Some(bytes.len());
        }
        if let Some(place) = code.strip_prefix(".org ") {
            let place = emu_core::table::number(place.trim()).and_then(|p| usize::try_from(p).ok());
            bytes.resize(place.filter(|&p| p >= bytes.len()).ok_or(format!("line {number}: `{line}`"))?, 0xFF);
        } else if let Some(text) = code.strip_prefix(".ascii ") {
            bytes.extend(text.trim().trim_matches('"').bytes());
        } else if !code.is_empty() {
            let words = code.split_inclusive([' ', ',']).map(|word| {
                let bare = word.trim_start_matches('#').trim_end_matches([' ', ',']);
                let known = labels.iter().find(|(name, _)| *name == bare);
                known
                    .map_or(word.to_owned(), |(_, place)| word.replace(bare, &place.unwrap_or(bytes.len()).to_string()))
            });
            let words =
                assemble(&words.collect::<String>(), bytes.len() as u32).map_err(|e| format!("line {number}: {e}"))?;
            bytes.extend(words.into_iter().map(|word| word as u8));
        }
    }
    Ok(bytes)
}
