//! Finds the chip that a source names.

use diag::text::readable;

use crate::dialect::{chip_of_list, pic16::bare_chip_name};

/// Returns the chip that a source names, in the spelling of the command line (`pic16f873`, `atmega328p`). It
/// comes from `list p=` or `processor` of a PIC, `.device` of an AVR, or the vendor's file that the source
/// includes (`p16f873.inc`, `m328pdef.inc`, `89c4051.mcu`, `reg52.h`). A chip of that name may not exist.
#[must_use]
pub fn named_chip(source: &[u8]) -> Option<String> {
    let text = readable(source);
    let codes =
        || text.lines().filter_map(|line| line.split([';', '/']).next()?.trim().split_once(char::is_whitespace));
    let named = codes().find_map(|(word, rest)| match word.to_ascii_lowercase().as_str() {
        "processor" => Some(format!("pic{}", bare_chip_name(rest))),
        "list" => Some(format!("pic{}", bare_chip_name(rest.split(',').find_map(processor_of)?))),
        ".device" => Some(rest.trim().to_ascii_lowercase()),
        _ => None,
    });
    named.or_else(|| {
        // `$include(reg52.inc)` has no blank.
        let includes = text.lines().filter_map(|line| {
            let code = line.split(';').next()?.trim();
            let at = code.find(|c: char| c.is_whitespace() || matches!(c, '(' | '<' | '"'))?;
            Some((code.get(..at)?.trim_start_matches(['#', '.', '$']).to_ascii_lowercase(), code.get(at..)?))
        });
        let mut includes = includes.filter(|(word, _)| matches!(word.as_str(), "include" | "inc" | "ic"));
        includes.find_map(|(_, rest)| chip_of_include(rest))
    })
}

/// Returns the value of `p=` in an argument of LIST.
pub(crate) fn processor_of(part: &str) -> Option<&str> {
    part.split_once('=').filter(|(key, _)| key.trim().eq_ignore_ascii_case("p")).map(|(_, value)| value)
}

/// Returns the chip of a vendor's file: `<p16f84a.inc>`, `"m8def.inc"`, `(89c4051.mcu)`.
fn chip_of_include(rest: &str) -> Option<String> {
    let file = rest.trim().trim_matches(['"', '<', '>', '\'', '(', ')', ' ']).to_ascii_lowercase();
    if let Some(chip) = chip_of_list(file.rsplit(['/', '\\']).next().unwrap_or_default()) {
        return Some(chip.to_owned());
    }
    let stem = file.strip_suffix(".inc")?;
    let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
    match (stem.strip_prefix('p'), stem.strip_suffix("def").and_then(|stem| stem.strip_prefix('m'))) {
        (Some(rest), _) if is_number(rest) => Some(format!("pic{rest}")),
        (_, Some(rest)) if is_number(rest) => Some(format!("atmega{rest}")),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::named_chip;

    #[test]
    fn sources_name_chips() {
        let cases: [(&[u8], Option<&str>); 14] = [
            (b" list p=16f84a\n", Some("pic16f84a")),
            (b" LIST r=dec, P=PIC16F877 ; \xE9\r\n", Some("pic16f877")),
            (b" processor 16f873\n", Some("pic16f873")),
            (b"#include <p16F877A.inc>\n nop\n", Some("pic16f877a")),
            (b" include \"p16f84a.inc\"\n list p=16f84\n", Some("pic16f84")),
            (b".include \"m328Pdef.inc\" ; \xE9\n", Some("atmega328p")),
            (b".device ATmega8\n", Some("atmega8")),
            (b" include \"panel.inc\"\n; list p=16f84\n", None),
            (b"$NOMOD51\n$INCLUDE (89C4051.MCU) ; pins\n", Some("at89c4051")),
            (b"$include(reg52.inc)\n", Some("8052")),
            (b"#include <at89x51.h>\n", Some("at89c51")),
            (b" .include \"..\\inc\\89s52.inc\"\n", Some("at89s52")),
            (b"$include (lcd52.inc)\n", None),
            (b"", None),
        ];
        for (source, wanted) in cases {
            assert_eq!(named_chip(source).as_deref(), wanted, "{}", String::from_utf8_lossy(source));
        }
    }
}
