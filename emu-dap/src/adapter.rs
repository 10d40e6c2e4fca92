//! The debug adapter: dispatches requests and builds responses and events.

use std::collections::BTreeSet;

use emu_core::cpu::ResetCause;
use emu_debug::debug::{DebugSession, UserAction};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::breakpoints::BreakpointTable;
use crate::error::LaunchError;
use crate::ladder_source::LadderSource;
use crate::listing::DisassemblyListing;
use crate::protocol::{self, DapRequest, LaunchArguments, RequestError};
use crate::runs::PendingRun;
use crate::stop_events::StopEvent;

/// A machine that is ready to be debugged.
pub struct OpenedMachine {
    /// The session with the machine and its history.
    pub session: DebugSession,
    /// The view of the ladder program in it, if it has one.
    pub view: Option<ladder_view::LadderView>,
}

/// Makes a machine from the arguments of `launch`; the error is a message for the user.
pub type OpenMachine<'a> = dyn Fn(&LaunchArguments) -> Result<OpenedMachine, LaunchError> + 'a;

/// The stage of the conversation with the client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ConversationStage {
    /// Nothing has been received.
    Created,
    /// After `initialize`.
    Initialized,
    /// After `launch`: the client sends its breakpoints.
    Configuring,
    /// After `configurationDone`.
    Debugging,
    /// After `disconnect`.
    Disconnected,
}

/// The capabilities that the client reported in `initialize`.
#[derive(Debug, Clone, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct ClientCapabilities {
    lines_start_at1: bool,
    columns_start_at1: bool,
    path_format: String,
    pub supports_invalidated_event: bool,
}

impl Default for ClientCapabilities {
    fn default() -> ClientCapabilities {
        let path_format = "path".to_owned();
        ClientCapabilities {
            lines_start_at1: true,
            columns_start_at1: true,
            path_format,
            supports_invalidated_event: false,
        }
    }
}

impl ClientCapabilities {
    /// Converts a line number, from 1, to the client's numbering.
    pub fn line(&self, line: u32) -> i64 {
        i64::from(line) - i64::from(!self.lines_start_at1)
    }

    /// Converts the client's line number to a number from 1; 0 if it is invalid.
    pub fn line_from_client(&self, line: i64) -> u32 {
        u32::try_from(line.saturating_add(i64::from(!self.lines_start_at1))).unwrap_or(0)
    }

    /// The number of the first column in the client's numbering.
    pub fn column(&self) -> i64 {
        i64::from(self.columns_start_at1)
    }
}

/// The debugged machine, with data derived from it.
pub(crate) struct DapMachine {
    pub session: DebugSession,
    /// The ladder program, if the machine has one.
    pub ladder: Option<LadderSource>,
    /// The disassembly, made at the first request.
    pub listing: Option<DisassemblyListing>,
    /// Bytes sent and resets up to this machine cycle have been reported.
    pub events_reported_to: u64,
    /// The reason of the last stop.
    pub stop: StopEvent,
    /// Name of the image without folders.
    pub name: String,
    /// Folder of the image.
    pub folder: std::path::PathBuf,
    /// C objects whose parts the client may request until the machine moves, with their expressions.
    pub expandable_objects: std::cell::RefCell<Vec<(String, emu_debug::debug::ObjectExpr)>>,
    /// Number of inlined functions that begin at the current instruction and are not entered yet: they are
    /// not frames.
    pub not_entered: usize,
}

impl DapMachine {
    /// The disassembly; it is made again after program memory may have changed.
    pub fn listing(&mut self) -> &DisassemblyListing {
        let DapMachine { session, ladder, listing, .. } = self;
        listing.get_or_insert_with(|| DisassemblyListing::new(session, ladder.as_ref()))
    }

    /// Assigns a value to an expression.
    pub fn assign(
        &mut self,
        expr: &emu_debug::debug::DebugExpression,
        value: emu_debug::debug::ExpressionValue,
    ) -> Result<(), RequestError> {
        self.session.assign(expr, value).map_err(RequestError::not_possible)?;
        self.events_reported_to = self.events_reported_to.min(self.session.machine().cycle());
        self.listing = None;
        Ok(())
    }

    /// Performs an action of the user. The events of a future that this action discards may be reported
    /// again.
    pub fn act(&mut self, action: UserAction) -> Result<(), RequestError> {
        self.session.apply_action(action).map_err(RequestError::not_possible)?;
        self.events_reported_to = self.events_reported_to.min(self.session.machine().cycle());
        self.listing = None;
        Ok(())
    }
}

/// One conversation with a client: requests go in, responses and events come out.
pub struct DebugAdapter<'a> {
    open: &'a OpenMachine<'a>,
    stage: ConversationStage,
    launched: LaunchArguments,
    /// What the client can do, and how it counts lines.
    pub(crate) client: ClientCapabilities,
    /// The machine under debug; None before `launch`.
    pub(crate) machine: Option<DapMachine>,
    /// The breakpoints of the client.
    pub(crate) points: BreakpointTable,
    /// The requested run; `None` if the machine is stopped.
    pub(crate) run: Option<PendingRun>,
    events: Vec<(&'static str, Value)>,
    seq: i64,
}

/// Requests that are allowed while the machine runs.
#[rustfmt::skip]
const WHILE_RUNNING: &[&str] = &[
    "breakpointLocations", "configurationDone", "dataBreakpointInfo", "disconnect", "loadedSources", "pause", "restart",
    "setBreakpoints", "setDataBreakpoints", "setExceptionBreakpoints", "setFunctionBreakpoints", "setInstructionBreakpoints",
    "source", "terminate", "threads",
];

impl<'a> DebugAdapter<'a> {
    /// Starts a conversation.
    #[must_use]
    pub fn new(open: &'a OpenMachine<'a>) -> DebugAdapter<'a> {
        DebugAdapter {
            open,
            stage: ConversationStage::Created,
            launched: LaunchArguments::default(),
            client: ClientCapabilities::default(),
            machine: None,
            points: BreakpointTable::default(),
            run: None,
            events: Vec::new(),
            seq: 0,
        }
    }

    /// True after `disconnect`; no more messages are sent.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.stage == ConversationStage::Disconnected
    }

    /// True if the machine runs: the caller must call [`DebugAdapter::run_slice`] until it does not.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.run.is_some() && !self.is_finished()
    }

    /// Handles a message; returns the response and the events caused by it, in order.
    pub fn handle(&mut self, message: &Value) -> Vec<Value> {
        let answer = match DapRequest::parse(message) {
            Err(rejected) => self.response(rejected.seq, &rejected.command, Err(rejected.error)),
            Ok(request) => {
                let result = self.check_stage(&request.command).and_then(|()| self.dispatch(&request));
                self.response(request.seq, &request.command, result)
            }
        };
        let mut out = vec![answer];
        out.append(&mut self.take_events());
        out
    }

    /// Answers a message that is not valid JSON.
    pub fn reject_garbled(&mut self, why: &str) -> Vec<Value> {
        vec![self.response(0, "", Err(RequestError::new(protocol::MALFORMED, why)))]
    }

    /// Continues the run until the machine stops, `keep_running` returns false (it is called about every
    /// millisecond), or a slice of 20 ms is over. Returns the events.
    pub fn run_slice(&mut self, keep_running: &mut dyn FnMut() -> bool) -> Vec<Value> {
        self.advance_run(keep_running);
        self.take_events()
    }

    fn response(&mut self, seq: i64, command: &str, result: Result<Value, RequestError>) -> Value {
        self.seq += 1;
        let mut response = json!({
            "seq": self.seq, "type": "response", "request_seq": seq, "success": result.is_ok(), "command": command,
        });
        match result {
            Ok(Value::Null) => {}
            Ok(body) => response["body"] = body,
            Err(wrong) => {
                response["message"] = wrong.message().into();
                response["body"] = wrong.body();
            }
        }
        response
    }

    /// Queues an event, to be sent after the response.
    pub(crate) fn event(&mut self, name: &'static str, body: Value) {
        self.events.push((name, body));
    }

    /// Queues output for the user.
    pub(crate) fn output(&mut self, category: &str, text: &str) {
        self.event("output", json!({ "category": category, "output": text }));
    }

    fn take_events(&mut self) -> Vec<Value> {
        let events = std::mem::take(&mut self.events);
        let number = |(name, body): (&str, Value)| {
            self.seq += 1;
            let mut event = json!({ "seq": self.seq, "type": "event", "event": name });
            if !body.is_null() {
                event["body"] = body;
            }
            event
        };
        events.into_iter().map(number).collect()
    }

    /// Checks that the request is allowed at this stage of the conversation.
    fn check_stage(&self, command: &str) -> Result<(), RequestError> {
        let early = |text: String| Err(RequestError::new(protocol::TOO_EARLY, text));
        let wanted = match (self.stage, command) {
            (_, "disconnect") => return Ok(()),
            (ConversationStage::Created, "initialize") | (ConversationStage::Initialized, "launch" | "attach") => {
                return Ok(());
            }
            (ConversationStage::Created, _) => return early(format!("{command} came before initialize")),
            (_, "initialize")
            | (ConversationStage::Configuring | ConversationStage::Debugging, "launch" | "attach") => {
                return early(format!("{command} came twice"));
            }
            (ConversationStage::Initialized, _) => return early(format!("{command} came before launch")),
            (_, wanted) => wanted,
        };
        if self.run.is_some() && !WHILE_RUNNING.contains(&wanted) {
            return Err(RequestError::new(
                protocol::RUNNING,
                format!("{command} needs a stopped machine; pause it first"),
            ));
        }
        Ok(())
    }

    /// The machine, which exists after `launch`.
    pub(crate) fn machine(&mut self) -> Result<&mut DapMachine, RequestError> {
        self.machine.as_mut().ok_or_else(|| RequestError::new(protocol::TOO_EARLY, "no program was launched"))
    }

    fn dispatch(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        if let Some(thread) = request.arguments.get("threadId").and_then(Value::as_i64).filter(|id| *id != THREAD) {
            return Err(RequestError::not_found(format!("there is no thread {thread}")));
        }
        match request.command.as_str() {
            "initialize" => self.initialize(request),
            "launch" => self.launch(request),
            "attach" => {
                Err(RequestError::not_possible("there is no machine to attach to: a program is launched")
                    .shown_to_user())
            }
            "configurationDone" => self.configured(),
            "restart" => self.restart(request),
            "disconnect" => self.disconnect(),
            "terminate" => self.terminate(),
            "threads" => self.threads(),
            "setBreakpoints" => self.set_breakpoints(request),
            "setFunctionBreakpoints" => self.set_function_breakpoints(request),
            "setInstructionBreakpoints" => self.set_instruction_breakpoints(request),
            "setDataBreakpoints" => self.set_data_breakpoints(request),
            "setExceptionBreakpoints" => Ok(json!({ "breakpoints": [] })),
            "dataBreakpointInfo" => self.data_breakpoint_info(request),
            "breakpointLocations" => self.breakpoint_locations(request),
            "continue" => self.begin_run(PendingRun::Continue, json!({ "allThreadsContinued": true })),
            "next" => self.next(request, false),
            "stepIn" => self.next(request, true),
            "stepOut" => self.step_out(request),
            "stepBack" => self.step_back(request),
            "reverseContinue" => self.begin_run(PendingRun::ReverseContinue, Value::Null),
            "pause" => self.pause(),
            "goto" => self.goto(request),
            "gotoTargets" => self.goto_targets(request),
            "stackTrace" => self.stack_trace(request),
            "scopes" => self.scopes(request),
            "variables" => self.variables(request),
            "setVariable" => self.set_variable(request),
            "evaluate" => self.evaluate(request),
            "setExpression" => self.set_expression(request),
            "exceptionInfo" => self.exception_info(),
            "disassemble" => self.disassemble(request),
            "readMemory" => self.read_memory(request),
            "writeMemory" => self.write_memory(request),
            "source" => self.source(request),
            "loadedSources" => self.loaded_sources(),
            "emu/step" => self.emu_step(request),
            "emu/why" => self.emu_why(request),
            "emu/draw" => self.emu_draw(request),
            "emu/drive" => self.emu_drive(request),
            "emu/gotoCycle" => self.emu_goto_cycle(request),
            "emu/reset" => self.emu_reset(),
            other => Err(RequestError::new(protocol::UNKNOWN, format!("there is no request `{other}`"))),
        }
    }

    fn initialize(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let client: ClientCapabilities = request.parse_arguments()?;
        if client.path_format != "path" {
            let text = format!("the only supported path format is `path`, not `{}`", client.path_format);
            return Err(RequestError::new(protocol::ARGUMENTS, text));
        }
        self.client = client;
        self.stage = ConversationStage::Initialized;
        let can: BTreeSet<&str> = [
            "supportsBreakpointLocationsRequest",
            "supportsConditionalBreakpoints",
            "supportsConfigurationDoneRequest",
            "supportsDataBreakpoints",
            "supportsDisassembleRequest",
            "supportsEvaluateForHovers",
            "supportsExceptionInfoRequest",
            "supportsFunctionBreakpoints",
            "supportsGotoTargetsRequest",
            "supportsHitConditionalBreakpoints",
            "supportsInstructionBreakpoints",
            "supportsLoadedSourcesRequest",
            "supportsLogPoints",
            "supportsReadMemoryRequest",
            "supportsRestartRequest",
            "supportsSetExpression",
            "supportsSetVariable",
            "supportsStepBack",
            "supportsSteppingGranularity",
            "supportsTerminateRequest",
            "supportsValueFormattingOptions",
            "supportsWriteMemoryRequest",
        ]
        .into();
        Ok(can.into_iter().map(|name| (name.to_owned(), Value::Bool(true))).collect::<serde_json::Map<_, _>>().into())
    }

    fn launch(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let arguments: LaunchArguments = request.parse_arguments().map_err(RequestError::shown_to_user)?;
        self.open(arguments)?;
        self.stage = ConversationStage::Configuring;
        let name = self.machine()?.name.clone();
        self.event("process", json!({ "name": name, "startMethod": "launch", "isLocalProcess": false }));
        self.event("initialized", Value::Null);
        Ok(Value::Null)
    }

    fn open(&mut self, arguments: LaunchArguments) -> Result<(), RequestError> {
        if arguments.program.is_empty() {
            return Err(RequestError::new(
                protocol::ARGUMENTS,
                "launch needs `program`: a HEX or ELF image, or a ladder program",
            )
            .shown_to_user());
        }
        let opened = (self.open)(&arguments).map_err(|why| RequestError::new(protocol::LAUNCH, why).shown_to_user())?;
        let path = std::path::Path::new(&arguments.program);
        let name = path.file_name().map_or(arguments.program.clone(), |name| name.to_string_lossy().into_owned());
        let folder = path.parent().map(std::path::Path::to_path_buf).unwrap_or_default();
        self.machine = Some(DapMachine {
            expandable_objects: std::cell::RefCell::default(),
            not_entered: 0,
            events_reported_to: opened.session.machine().cycle(),
            ladder: opened.view.map(LadderSource::new),
            session: opened.session,
            listing: None,
            stop: StopEvent::entry(),
            name,
            folder,
        });
        self.run = None;
        self.launched = arguments;
        Ok(())
    }

    fn configured(&mut self) -> Result<Value, RequestError> {
        if self.stage == ConversationStage::Configuring {
            self.stage = ConversationStage::Debugging;
            self.begin_debugging();
        }
        Ok(Value::Null)
    }

    /// Reports the stop before the first instruction, or starts the run.
    fn begin_debugging(&mut self) {
        if self.launched.stop_on_entry {
            self.report_stop(StopEvent::entry());
        } else {
            self.run = Some(PendingRun::Continue);
        }
    }

    /// True if breakpoints must not stop the program.
    pub(crate) fn is_without_breakpoints(&self) -> bool {
        self.launched.no_debug
    }

    /// Starts again with the current contents of all files.
    fn restart(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        #[derive(Default, Deserialize)]
        #[serde(default)]
        struct RestartArguments {
            arguments: Option<LaunchArguments>,
        }
        let RestartArguments { arguments } = request.parse_arguments()?;
        let arguments = arguments.unwrap_or_else(|| self.launched.clone());
        self.open(arguments)?;
        self.reinstall_breakpoints();
        if self.stage == ConversationStage::Debugging {
            self.begin_debugging();
        }
        Ok(Value::Null)
    }

    fn disconnect(&mut self) -> Result<Value, RequestError> {
        self.run = None;
        self.stage = ConversationStage::Disconnected;
        Ok(Value::Null)
    }

    fn terminate(&mut self) -> Result<Value, RequestError> {
        self.run = None;
        self.event("terminated", Value::Null);
        Ok(Value::Null)
    }

    fn threads(&mut self) -> Result<Value, RequestError> {
        let name = self.machine()?.session.scope.chip().name;
        Ok(json!({ "threads": [{ "id": THREAD, "name": name }] }))
    }

    fn emu_reset(&mut self) -> Result<Value, RequestError> {
        self.machine()?.act(UserAction::Reset(ResetCause::External))?;
        self.report_stop(StopEvent::goto("reset"));
        Ok(Value::Null)
    }
}

/// The id of the only thread.
pub(crate) const THREAD: i64 = 1;
