//! `emu wave`: draws a waveform (VCD) as text or as a picture.

mod read;
mod scale;
mod svg;
mod text;

use clap::Args;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use crate::shared::output::RequestedOutput;
use diag::nearest;
use read::{WaveFile, WaveSignal};

const EXAMPLES: &str = "\
Examples:
  emu run blink.hex --mcu atmega328p --for 2s --vcd blink.vcd
  emu wave blink.vcd --only PB5
  emu wave blink.vcd --only 'PB*' --only TCNT0 --from 10ms --to 12ms --svg blink.svg";

/// Maximum number of signals in one drawing.
const MAX_SIGNALS: usize = 1000;

/// Default width of the text in columns, and of the picture in pixels.
const COLUMNS: u32 = 80;
const PIXELS: u32 = 1200;

/// Flags of `emu wave`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct WaveArgs {
    /// A waveform in the VCD format, from emu or any other tool; - is standard input.
    #[arg(value_name = "FILE.vcd")]
    file: String,
    /// Draw a picture (SVG, light and dark) to this file; - is standard output. Default: draw as text.
    #[arg(long, value_name = "OUT")]
    svg: Option<String>,
    /// Draw only this signal, by its name, with or without its scopes (PB5, signals.TCNT0); * matches any
    /// text (PB*). Repeatable; the signals are drawn in the given order.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Start at this time: 10ms, 2.5us, or 1000c (ticks of the file's time scale).
    #[arg(long, value_name = "TIME")]
    from: Option<String>,
    /// End at this time.
    #[arg(long, value_name = "TIME")]
    to: Option<String>,
    /// Width: columns of the text, 80 by default, or pixels of the picture, 1200 by default.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(20..=20_000))]
    width: Option<u32>,
}

/// The selected signals and time range, in ticks of the file's time scale.
struct WaveDrawing<'a> {
    waves: &'a WaveFile,
    signals: Vec<&'a WaveSignal>,
    from: u64,
    /// Greater than `from`.
    to: u64,
}

/// Draws a waveform.
pub fn wave(args: &WaveArgs) -> Result<u8, VerbFailure> {
    if let Some(file) = &args.svg {
        output::check_input_not_overwritten(&args.file, &[RequestedOutput::new("--svg", file)])?;
    }
    let waves = read::read(&args.file, &args.only)?;
    let time = |flag: &str, text: &Option<String>| {
        let time = text
            .as_ref()
            .map(|text| waves.scale.ticks(text).map_err(|why| VerbFailure::invalid_flag_value(flag, text, &why)));
        time.transpose()
    };
    let from = time("--from <TIME>", &args.from)?.unwrap_or(waves.start);
    if let Some(text) = args.from.as_ref().filter(|_| from > waves.end) {
        return Err(VerbFailure::invalid_flag_value(
            "--from <TIME>",
            text,
            &format!("the file ends at {}", waves.scale.text(waves.end)),
        ));
    }
    let to = time("--to <TIME>", &args.to)?.unwrap_or(waves.end.max(from.saturating_add(1)));
    if from >= to {
        return Err(VerbFailure::Usage("--from is not before --to".to_owned()));
    }
    let signals = chosen_signals(args, &waves)?;
    let drawing = WaveDrawing { waves: &waves, signals, from, to };
    match &args.svg {
        Some(file) => {
            let picture = svg::draw(&drawing, args.width.unwrap_or(PIXELS));
            output::write_files(&[(file, picture.as_bytes())])?;
        }
        None => output::print(text::draw(&drawing, args.width.unwrap_or(COLUMNS)))?,
    }
    Ok(exit::OK)
}

/// Draws a complete waveform as text. The picture is drawn too, but discarded.
pub fn draw_as_text(bytes: &[u8]) -> Result<String, VerbFailure> {
    let waves = read::read_bytes("wave", bytes)?;
    let (from, to) = (waves.start, waves.end.max(waves.start.saturating_add(1)));
    let drawing = WaveDrawing { waves: &waves, signals: waves.signals.iter().take(MAX_SIGNALS).collect(), from, to };
    _ = svg::draw(&drawing, PIXELS);
    Ok(text::draw(&drawing, COLUMNS))
}

/// Returns the selected signals in drawing order.
fn chosen_signals<'a>(args: &WaveArgs, waves: &'a WaveFile) -> Result<Vec<&'a WaveSignal>, VerbFailure> {
    let mut chosen: Vec<&WaveSignal> = Vec::new();
    for pattern in &args.only {
        let found: Vec<&WaveSignal> = waves.signals.iter().filter(|signal| signal.is_named(pattern)).collect();
        if found.is_empty() {
            let names = waves.signals.iter().map(|signal| signal.name.as_str());
            let hint = nearest(pattern, names).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
            return Err(VerbFailure::invalid_flag_value(
                "--only <NAME>",
                pattern,
                &format!("there is no such signal{hint}"),
            ));
        }
        chosen.extend(found);
    }
    if args.only.is_empty() {
        chosen.extend(&waves.signals);
    }
    if chosen.len() > MAX_SIGNALS {
        let why = format!(
            "{} signals are more than the {MAX_SIGNALS} that are drawn at once; name some with --only",
            chosen.len()
        );
        return Err(VerbFailure::Usage(why));
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::codes::TOO_LARGE_WAVE;

    fn code(text: &str) -> &'static str {
        match draw_as_text(text.as_bytes()) {
            Err(VerbFailure::Refused(faults, _)) => faults.first().map_or("", |fault| fault.code),
            _ => "",
        }
    }

    /// A file of 1 MB must not need gigabytes of memory: names in deep scopes, and values of wide signals.
    #[test]
    fn what_a_small_file_makes_large_is_refused() {
        let scope = format!("$scope module {} $end\n", "s".repeat(1000));
        let signals: String = (0..100).map(|n| format!("$var wire 1 ! a{n} $end\n")).collect();
        assert_eq!(code(&(scope.repeat(1000) + &signals + "$enddefinitions $end\n")), TOO_LARGE_WAVE);
        let changes = "b0 !\nb1 !\n".repeat(10_000);
        assert_eq!(code(&format!("$var wire 65536 ! a $end\n$enddefinitions $end\n#0\n{changes}")), TOO_LARGE_WAVE);
    }
}
