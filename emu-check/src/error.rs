//! Why a check cannot be done: a name or value of a scenario, shards of a campaign, the scans of a foreign image.

use emu_core::cpu::{ProgramFault, StopReason};

use crate::fuzz::CampaignShard;

/// Why something cannot be checked. `Display` is the cause, one sentence without a full stop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CheckError {
    /// A scenario names no symbol of the program.
    #[error(
        "the program has no symbol `{name}`{}",
        if *.of_chip { "; pins and memories are for `emu run` of what it compiles to" } else { "" }
    )]
    UnknownSymbol {
        /// The name.
        name: String,
        /// It has the form of a name of a pin or a place in memory.
        of_chip: bool,
    },
    /// A scenario gives a symbol a value that it cannot hold.
    #[error("`{name}` takes {low} to {high}, not `{value}`")]
    ValueOutOfRange {
        /// The symbol.
        name: String,
        /// The least that it holds.
        low: i64,
        /// The most that it holds.
        high: i64,
        /// The value as the scenario has it.
        value: String,
    },
    /// A scenario sets an input that the program does not read.
    #[error("`{name}` is no input of the program")]
    NotAnInput {
        /// The symbol.
        name: String,
    },
    /// The machine beside the program takes no bytes.
    #[error("{reason}")]
    CannotSend {
        /// The machine's reason.
        reason: String,
    },
    /// A scenario sends bytes, and the program takes none.
    #[error("the program has no UART_RECV that would take bytes")]
    NoReceiver,
    /// A scenario waits for bytes, and the program sends none.
    #[error("the program has no element that sends bytes")]
    NoSender,
    /// A scenario wants a snapshot of a ladder program.
    #[error("snapshots are of images on chips; a ladder program is played scan by scan")]
    NoSnapshots,
    /// No records are given to add.
    #[error("there is nothing to add")]
    NoRecords,
    /// Records are of campaigns with different plans.
    #[error("the records are of different campaigns")]
    DifferentCampaigns,
    /// A record has a shard that its plan cannot have.
    #[error("there is no shard {}/{} of {programs} programs with {} of them done", .shard.index, .shard.of, .shard.done)]
    NoSuchShard {
        /// The shard.
        shard: CampaignShard,
        /// Programs of the plan.
        programs: u64,
    },
    /// Two records are of the same shard.
    #[error("shard {}/{} is there twice", .shard.index, .shard.of)]
    DuplicateShard {
        /// The shard.
        shard: CampaignShard,
    },
    /// Two shards of different splits have a program in common.
    #[error(
        "shards {}/{} and {}/{} hold the same programs, the first is program {first}",
        .a.index, .a.of, .b.index, .b.of
    )]
    OverlappingShards {
        /// One shard.
        a: CampaignShard,
        /// The other.
        b: CampaignShard,
        /// The first program that both hold.
        first: u64,
    },
    /// Two shards are of different splits.
    #[error("shards {}/{} and {}/{} are of different splits", .a.index, .a.of, .b.index, .b.of)]
    DifferentSplits {
        /// One shard.
        a: CampaignShard,
        /// The other.
        b: CampaignShard,
    },
    /// A foreign image clears the flag of a timer at another rate.
    #[error("a timer's flag is cleared every {mean} machine cycles, and CYCLE is {period}")]
    OtherPeriod {
        /// Machine cycles from one clearing to the next, on average.
        mean: u64,
        /// CYCLE in machine cycles.
        period: u64,
    },
    /// A foreign image clears no flag of a timer at a steady rate.
    #[error("no timer's flag is cleared again and again, every {period} machine cycles as CYCLE asks")]
    NoTimerFlag {
        /// CYCLE in machine cycles.
        period: u64,
    },
    /// A foreign image clears the flag of its timer no more.
    #[error("the instruction that clears the flag does not come again ({stop:?})")]
    FlagStaysSet {
        /// What ended the run.
        stop: StopReason,
    },
    /// A foreign image has no loop that polls the flag of its timer.
    #[error("the program does not wait for the flag in a loop, or has no time left to wait")]
    NoWaitLoop,
    /// A foreign image polls the flag of its timer and does not branch on it.
    #[error("the program does the same whether the poll at 0x{poll:04X} finds the timer's flag or not")]
    PollWithoutEffect {
        /// Address of the poll.
        poll: u32,
    },
    /// What seems to be the start of a scan is executed at another rate than the flag is cleared.
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
        /// Machine cycles from one supposed start to the next, on average.
        mean: u64,
        /// How many periods were seen.
        count: u64,
    },
    /// What seems to be a scan is executed at another rate than CYCLE asks for.
    #[error(
        "where scans begin is not found: the flag of the timer is cleared every {period} machine cycles, but what seems \
         to be a scan comes every {mean_clocks:.0} clocks, where CYCLE asks for {wanted_clocks:.0}"
    )]
    OtherScanRate {
        /// Machine cycles from one clearing of the flag to the next.
        period: u64,
        /// Clocks from one supposed scan to the next, on average.
        mean_clocks: f64,
        /// CYCLE in clocks.
        wanted_clocks: f64,
    },
    /// A foreign image halts before its first scan.
    #[error("the program halts before any scan")]
    HaltsBeforeScan,
    /// A foreign image executes a word that is no instruction.
    #[error("0x{word:04X} at program word 0x{pc:04X} is no instruction")]
    IllegalInstruction {
        /// The word.
        word: u16,
        /// Where it is, in program words.
        pc: u32,
    },
    /// A foreign image does what the model does not carry out.
    #[error("{fault}, at program word 0x{pc:04X}")]
    ProgramFault {
        /// What it does.
        fault: ProgramFault,
        /// Where, in program words.
        pc: u32,
    },
    /// A run stopped though no breakpoint is set.
    #[error("the program stopped where nobody asked for")]
    UnexpectedStop,
    /// A compiled sketch did not come to its next scan.
    #[error("{stop:?} at 0x{address:04X}")]
    SketchStopped {
        /// What ended the run.
        stop: StopReason,
        /// Byte address of the next instruction.
        address: u32,
    },
}
