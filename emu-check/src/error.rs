//! Errors of this crate: scenarios that do not fit a program, campaign shards, and foreign images whose scans
//! cannot be found.

use emu_core::cpu::{ProgramError, ProgramFault, StopReason};

use crate::fuzz::CampaignShard;

/// The reason why something cannot be checked. `Display` gives the cause as one sentence without a full stop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CheckError {
    /// A scenario names a symbol that the program does not have.
    #[error(
        "the program has no symbol `{name}`{}",
        if *.of_chip { "; pins and memories are for `emu run` of what it compiles to" } else { "" }
    )]
    UnknownSymbol {
        /// The name in the scenario.
        name: String,
        /// True if the name has the form of a pin or a memory location.
        of_chip: bool,
    },
    /// A scenario gives a symbol a value that it cannot hold.
    #[error("`{name}` takes {low} to {high}, not `{value}`")]
    ValueOutOfRange {
        /// The symbol.
        name: String,
        /// The smallest value of the symbol.
        low: i64,
        /// The largest value of the symbol.
        high: i64,
        /// The value in the scenario.
        value: String,
    },
    /// A scenario sets an input that the program does not read.
    #[error("`{name}` is not an input of the program")]
    NotAnInput {
        /// The symbol.
        name: String,
    },
    /// The compared machine cannot take bytes.
    #[error("{reason}")]
    CannotSend {
        /// The reason that the machine reports.
        reason: String,
    },
    /// A scenario sends bytes, but the program does not receive any.
    #[error("the program has no UART_RECV to receive bytes")]
    NoReceiver,
    /// A scenario waits for bytes, but the program does not send any.
    #[error("the program has no element that sends bytes")]
    NoSender,
    /// A scenario takes a snapshot of a ladder program.
    #[error("snapshots need an image on a chip; this scenario runs on a ladder program")]
    NoSnapshots,
    /// There are no records to add up.
    #[error("no record of a campaign was given")]
    NoRecords,
    /// The records come from campaigns with different plans.
    #[error("the records are of different campaigns")]
    DifferentCampaigns,
    /// A record has a shard that is impossible in its plan.
    #[error("there is no shard {}/{} of {programs} programs with {} of them done", .shard.index, .shard.of, .shard.done)]
    NoSuchShard {
        /// The shard.
        shard: CampaignShard,
        /// Number of programs in the plan.
        programs: u64,
    },
    /// Two records are of the same shard.
    #[error("shard {}/{} was given twice", .shard.index, .shard.of)]
    DuplicateShard {
        /// The shard.
        shard: CampaignShard,
    },
    /// Two shards of different splits contain the same program.
    #[error(
        "shards {}/{} and {}/{} contain the same programs, the first is program {first}",
        .a.index, .a.of, .b.index, .b.of
    )]
    OverlappingShards {
        /// The first shard.
        a: CampaignShard,
        /// The second shard.
        b: CampaignShard,
        /// The first program that both contain.
        first: u64,
    },
    /// Two shards belong to different splits.
    #[error("shards {}/{} and {}/{} are of different splits", .a.index, .a.of, .b.index, .b.of)]
    DifferentSplits {
        /// The first shard.
        a: CampaignShard,
        /// The second shard.
        b: CampaignShard,
    },
    /// A foreign image clears the flag of a timer at a rate that differs from CYCLE.
    #[error("a timer's flag is cleared every {mean} machine cycles, and CYCLE is {period}")]
    OtherPeriod {
        /// Mean machine cycles from one clearing to the next.
        mean: u64,
        /// CYCLE in machine cycles.
        period: u64,
    },
    /// A foreign image does not clear the flag of any timer at a steady rate.
    #[error("no timer flag is cleared every {period} machine cycles, as CYCLE requires")]
    NoTimerFlag {
        /// CYCLE in machine cycles.
        period: u64,
    },
    /// A foreign image stops clearing the flag of its timer.
    #[error("the instruction that clears the timer's flag is not executed again: {}", stop_text(*.stop))]
    FlagStaysSet {
        /// What ended the run.
        stop: StopReason,
    },
    /// A foreign image has no loop that polls the flag of its timer.
    #[error("the program does not wait for the flag in a loop, or has no time left to wait")]
    NoWaitLoop,
    /// A foreign image polls the flag of its timer but does not branch on it.
    #[error("the program does the same whether the poll at 0x{poll:04X} finds the timer's flag or not")]
    PollWithoutEffect {
        /// Address of the poll.
        poll: u32,
    },
    /// The supposed start of a scan is executed at a different rate than the flag is cleared.
    #[error(
        "where scans begin is not found: the flag that is polled at 0x{poll:04X} is cleared every {period} machine \
         cycles, but what seems to be the start of a scan, 0x{start:04X}, comes every {mean} ({count} times)"
    )]
    ScanStartNotFound {
        /// Address of the poll.
        poll: u32,
        /// Machine cycles from one clearing of the flag to the next.
        period: u64,
        /// Address of the supposed start.
        start: u32,
        /// Mean machine cycles from one supposed start to the next.
        mean: u64,
        /// Number of periods that were observed.
        count: u64,
    },
    /// The supposed scan is executed at a different rate than CYCLE requires.
    #[error(
        "where scans begin is not found: the flag of the timer is cleared every {period} machine cycles, but what seems \
         to be a scan comes every {mean_clocks:.0} clocks, where CYCLE requires {wanted_clocks:.0}"
    )]
    OtherScanRate {
        /// Machine cycles from one clearing of the flag to the next.
        period: u64,
        /// Mean clocks from one supposed scan to the next.
        mean_clocks: f64,
        /// CYCLE in clocks.
        wanted_clocks: f64,
    },
    /// A foreign image halts before its first scan.
    #[error("the program halts before any scan")]
    HaltsBeforeScan,
    /// A foreign image executes a word that is not an instruction.
    #[error("0x{word:04X} at program word 0x{pc:04X} is not an instruction")]
    IllegalInstruction {
        /// The program word.
        word: u16,
        /// Its address, in program words.
        pc: u32,
    },
    /// A foreign image does something that the emulator does not support.
    #[error("{fault}, at program word 0x{pc:04X}")]
    ProgramFault {
        /// The unsupported action.
        fault: ProgramFault,
        /// Its address, in program words.
        pc: u32,
    },
    /// A run stopped although no breakpoint is set.
    #[error("the program stopped without a request")]
    UnexpectedStop,
    /// A compiled sketch did not reach its next scan.
    #[error("the sketch stopped at byte address 0x{address:04X}: {}", stop_text(*.stop))]
    SketchStopped {
        /// What ended the run.
        stop: StopReason,
        /// Byte address of the next instruction.
        address: u32,
    },
}

/// Describes a stop in a message.
pub(crate) fn stop_text(stop: StopReason) -> String {
    match stop {
        StopReason::Limit => "the time limit was reached".to_owned(),
        StopReason::Halted => "the chip halted".to_owned(),
        StopReason::Breakpoint { .. } | StopReason::Probe => "a stop that was not requested".to_owned(),
        StopReason::Error(ProgramError::Illegal { word, .. }) => format!("illegal instruction 0x{word:04X}"),
        StopReason::Error(ProgramError::Fault { fault, .. }) => fault.to_string(),
    }
}
