//! Full-screen views on a terminal, or as text pictures with `--keys`; and `emu sim --watch`, the interactive
//! panel of a program.

use std::io::{self, IsTerminal};

use clap::Args;
use emu_tui::panel::{LadderPanel, PanelPace, SPEEDS};
use emu_tui::{Rect, ScreenStyle, ScreenView, ScriptStep, key, key_script, screen};
use ladder::LadderProgram;
use ladder_eval::Evaluator;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use crate::shared::report::MessageStyle;
use crate::shared::scan_inputs::{ScanChange, SimInput};
use crate::shared::usage_error::UsageError;

/// Valid widths and heights of a picture.
const SIZES: std::ops::RangeInclusive<u16> = 1..=screen::MAX_SCREEN_SIDE;

/// A size of the screen.
#[derive(Debug, Clone, Copy)]
struct ScreenSize {
    columns: u16,
    lines: u16,
}

/// The default size of a picture.
const DEFAULT_SIZE: ScreenSize = ScreenSize { columns: 80, lines: 24 };

/// Flags of the full-screen view.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// Show a full screen: inputs as switches on keys, outputs as lamps, timers, counters, rungs with power
    /// flow, and a waveform. A key runs a scan; ? lists the keys. --set works with it.
    #[arg(long = "watch", id = "full", conflicts_with_all = ["scans", "at", "inputs", "uart_in", "scenario", "stimulus", "csv", "vcd", "wave", "json"])]
    full: bool,
    /// With --watch: start running at once, one scan per cycle time of the wall clock.
    #[arg(long, requires = "full")]
    realtime: bool,
    /// With --watch: the speed relative to the wall clock, 0.001 to 1000.
    #[arg(long, requires = "full", value_name = "FACTOR", value_parser = parse_speed)]
    speed: Option<f64>,
    #[command(flatten)]
    played: ScriptedKeys,
}

/// Flags that run a full-screen view without a terminal.
#[derive(Debug, Args)]
pub struct ScriptedKeys {
    /// With a full screen, without a terminal: play these keys and print the last picture. Words: 1, g,
    /// space, enter, pgdn, alt-1, :Xa=1, wait:500ms. A word with *N is played N times: 'space*20 1 space'.
    #[arg(long, requires = "full", value_name = "KEYS", value_parser = key::parse_keys, allow_hyphen_values = true)]
    keys: Option<std::vec::Vec<ScriptStep>>,
    /// With --keys: width and height of the picture, in columns and lines.
    #[arg(long, requires = "keys", value_name = "WxH", value_parser = parse_size)]
    size: Option<ScreenSize>,
}

impl ScriptedKeys {
    /// Returns true if the command line gives the keys.
    pub fn is_given(&self) -> bool {
        self.keys.is_some()
    }
}

impl WatchArgs {
    /// Returns true if the view is requested.
    pub fn is_requested(&self) -> bool {
        self.full
    }
}

fn parse_speed(text: &str) -> Result<f64, UsageError> {
    let speed = text.parse().ok().filter(|speed| SPEEDS.contains(speed));
    speed.ok_or_else(|| UsageError::malformed(format!("a number from {} to {}", SPEEDS.start(), SPEEDS.end())))
}

fn parse_size(text: &str) -> Result<ScreenSize, UsageError> {
    let side = |text: &str| text.parse().ok().filter(|side| SIZES.contains(side));
    let sides = text.split_once('x');
    let size = sides.and_then(|(width, height)| Some(ScreenSize { columns: side(width)?, lines: side(height)? }));
    size.ok_or_else(|| {
        UsageError::malformed(format!("columns x lines, as in 80x24, each {} to {}", SIZES.start(), SIZES.end()))
    })
}

/// Shows the panel of a program until the user leaves it.
pub fn show_panel(
    args: &WatchArgs,
    program: &LadderProgram,
    evaluator: Evaluator,
    changes: &[ScanChange],
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    if args.realtime && program.settings.cycle_us == 0 {
        return Err(VerbFailure::Usage("--realtime: the program has no cycle time (CYCLE=)".to_owned()));
    }
    let mut evaluator = evaluator;
    for change in changes.iter().filter(|change| !matches!(change.input, SimInput::Level(..))) {
        change.apply(&mut evaluator);
    }
    let name = program.file.rsplit('/').next().unwrap_or(&program.file).to_owned();
    let pace = if args.realtime { PanelPace::Real } else { PanelPace::Paused };
    let mut panel = LadderPanel::new(&name, program.clone(), evaluator).with_pace(pace, args.speed.unwrap_or(1.0));
    for change in changes {
        if let SimInput::Level(symbol, level) = change.input {
            panel.set_level(symbol, level);
        }
    }
    show_view(&mut panel, &args.played, "--watch", style)
}

/// Shows a full-screen view until the user leaves it, or prints the picture after the scripted keys. `flag`
/// is the flag that requested the view.
pub fn show_view(
    app: &mut dyn ScreenView,
    played: &ScriptedKeys,
    flag: &str,
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let look = ScreenStyle { color: style.screen };
    if let Some(steps) = &played.keys {
        let ScreenSize { columns: width, lines: height } = played.size.unwrap_or(DEFAULT_SIZE);
        let picture = key_script::play_keys(app, steps, Rect::new(0, 0, width, height), look);
        output::print(key_script::picture_text(&picture, look))?;
        return Ok(exit::OK);
    }
    if !io::stdout().is_terminal() {
        let why = format!("{flag} is for a terminal, and standard output is not one; --keys plays keys without one");
        return Err(VerbFailure::Usage(why));
    }
    match screen::show(app, look) {
        Ok(screen::ScreenEnd::Quit) => Ok(exit::OK),
        Ok(screen::ScreenEnd::Signal(signal)) => {
            screen::exit_by_signal(signal);
            Ok(exit::OK)
        }
        Err(error) => Err(VerbFailure::write_failed("-", &error)),
    }
}
