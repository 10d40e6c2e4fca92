//! `emu-fuzz`: executes the fuzz targets with nothing but Rust. `fuzz/run.sh` executes them under libFuzzer.

#![forbid(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use emu_fuzz::run::{DriverOptions, TargetRun, memory_limited_command, regressions, run_targets};
use emu_fuzz::worker::{WorkerBudget, replay_input, run_worker};
use emu_fuzz::{FuzzError, FuzzTarget, Mutator, TARGETS, find_target};

const USAGE: &str = "\
emu-fuzz list                                     the targets
emu-fuzz run [TARGET..] [--seconds S | --executions N] [--seed N] [--save FOLDER]
                                                  executes targets, all of them by default: S seconds (60) in all, or N executions each;
                                                  findings are files in FOLDER (fuzz/found)
emu-fuzz replay TARGET FILE..                     executes inputs once, under the limits of time and memory
emu-fuzz seeds TARGET FOLDER                      writes the seeds and regressions of a target, for libFuzzer
emu-fuzz dictionary TARGET                        prints its words as a dictionary of libFuzzer

Exit codes: 0 nothing was found; 1 an input is a finding; 2 usage error.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match run_command(&arguments) {
        Ok(code) => ExitCode::from(code),
        Err(why) => {
            eprintln!("{why}\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn run_command(arguments: &[&str]) -> Result<u8, FuzzError> {
    match arguments {
        ["list"] => {
            TARGETS.iter().for_each(|target| println!("{:<16} {}", target.name, target.description));
            Ok(0)
        }
        ["run", rest @ ..] => execute_targets(rest),
        ["replay", name, files @ ..] if !files.is_empty() => replay_files(find_target(name)?, files),
        ["replay-here", name, file] => {
            let input = std::fs::read(file).map_err(|source| FuzzError::File { path: (*file).to_owned(), source })?;
            println!("{file}: no finding, {:?}", replay_input(find_target(name)?, &input));
            Ok(0)
        }
        ["seeds", name, folder] => write_seeds(find_target(name)?, Path::new(folder))
            .map_err(|source| FuzzError::File { path: (*folder).to_owned(), source }),
        ["dictionary", name] => {
            for word in (find_target(name)?.dictionary)() {
                println!("\"{}\"", dictionary_escape(word.as_bytes()));
            }
            Ok(0)
        }
        ["work", name, rest @ ..] => {
            let CommandFlags { seed, budget, current, .. } = CommandFlags::read(rest)?;
            let (budget, current) = (budget.ok_or(FuzzError::NoBudget)?, current.ok_or(FuzzError::NoInputFile)?);
            println!("{}", run_worker(find_target(name)?, seed, budget, &current)?);
            Ok(0)
        }
        _ => Err(FuzzError::UnknownCommand),
    }
}

/// Flags of the commands `run` and `work`.
struct CommandFlags<'a> {
    seed: u64,
    budget: Option<WorkerBudget>,
    current: Option<PathBuf>,
    save: PathBuf,
    names: Vec<&'a str>,
}

impl<'a> CommandFlags<'a> {
    fn read(arguments: &[&'a str]) -> Result<CommandFlags<'a>, FuzzError> {
        let save = emu_fuzz::workspace_root().join("fuzz/found");
        let mut flags = CommandFlags { seed: 1, budget: None, current: None, save, names: Vec::new() };
        let mut rest = arguments.iter();
        while let Some(&word) = rest.next() {
            if !word.starts_with('-') {
                flags.names.push(word);
                continue;
            }
            let value = *rest.next().ok_or_else(|| FuzzError::MissingValue { flag: word.to_owned() })?;
            let number = || {
                value
                    .parse::<u64>()
                    .map_err(|_| FuzzError::BadNumber { flag: word.to_owned(), value: value.to_owned() })
            };
            match word {
                "--seed" => flags.seed = number()?,
                "--executions" => flags.budget = Some(WorkerBudget::Executions(number()?)),
                "--seconds" => flags.budget = Some(WorkerBudget::Time(Duration::from_secs(number()?))),
                "--milliseconds" => flags.budget = Some(WorkerBudget::Time(Duration::from_millis(number()?))),
                "--save" => flags.save = PathBuf::from(value),
                "--current" => flags.current = Some(PathBuf::from(value)),
                _ => return Err(FuzzError::UnknownFlag { flag: word.to_owned() }),
            }
        }
        Ok(flags)
    }
}

fn execute_targets(arguments: &[&str]) -> Result<u8, FuzzError> {
    let flags = CommandFlags::read(arguments)?;
    let named = flags.names.iter().map(|name| find_target(name)).collect::<Result<Vec<_>, _>>()?;
    let targets: Vec<&'static FuzzTarget> = if named.is_empty() { TARGETS.iter().collect() } else { named };
    // All targets share the time; as many targets run in parallel as there are processors.
    let at_once = std::thread::available_parallelism().map_or(1, usize::from).min(targets.len());
    let budget = match flags.budget.unwrap_or(WorkerBudget::Time(Duration::from_secs(60))) {
        WorkerBudget::Time(time) => WorkerBudget::Time(time * at_once as u32 / targets.len() as u32),
        budget => budget,
    };
    let seed = flags.seed;
    let tell = |ended: &TargetRun| match (&ended.finding, ended.executions) {
        (Some((what, file)), _) => {
            let (name, file) = (ended.target.name, file.display());
            println!("{name:<16} FINDING: {what}\n  replay: cargo run --release -p emu-fuzz -- replay {name} {file}");
            println!("  keep:   mkdir -p fuzz/regressions/{name} && cp {file} fuzz/regressions/{name}/");
        }
        (None, executions) => println!("{:<16} {:>9} executions", ended.target.name, executions.unwrap_or(0)),
    };
    let start = Instant::now();
    let ended = run_targets(&DriverOptions { targets, seed, budget, findings_folder: flags.save }, &tell)?;
    let executions: u64 = ended.iter().filter_map(|ended| ended.executions).sum();
    let findings = ended.iter().filter(|ended| ended.finding.is_some()).count();
    println!(
        "{executions} executions of {} targets in {} s, seed {seed}, {findings} findings",
        ended.len(),
        start.elapsed().as_secs()
    );
    Ok(u8::from(findings > 0))
}

/// Executes each input in a separate process, so that an input that crashes its process is reported too.
fn replay_files(target: &FuzzTarget, files: &[&str]) -> Result<u8, FuzzError> {
    let mut found = 0;
    for file in files {
        let status = memory_limited_command(&["replay-here", target.name, file]).status()?;
        if !status.success() {
            println!("{file}: FINDING ({status})");
            found = 1;
        }
    }
    Ok(found)
}

fn write_seeds(target: &FuzzTarget, folder: &Path) -> std::io::Result<u8> {
    std::fs::create_dir_all(folder)?;
    let mutator = Mutator::new(target, 0, regressions(target.name));
    for (number, seed) in mutator.seeds().iter().enumerate() {
        std::fs::write(folder.join(format!("seed-{number:05}")), seed)?;
    }
    Ok(0)
}

/// Escapes bytes in the format of libFuzzer's dictionaries.
fn dictionary_escape(bytes: &[u8]) -> String {
    let one = |byte: &u8| match byte {
        b'"' | b'\\' => format!("\\{}", char::from(*byte)),
        0x20..=0x7E => char::from(*byte).to_string(),
        byte => format!("\\x{byte:02X}"),
    };
    bytes.iter().map(one).collect()
}
