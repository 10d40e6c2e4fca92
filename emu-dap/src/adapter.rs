//! Requests to answers.

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

/// A machine ready to be debugged.
pub struct OpenedMachine {
    /// It, and where it has been.
    pub session: DebugSession,
    /// The ladder program in it.
    pub view: Option<ladder_view::LadderView>,
}

/// Makes a machine of what `launch` asks for; the error is for people.
pub type OpenMachine<'a> = dyn Fn(&LaunchArguments) -> Result<OpenedMachine, LaunchError> + 'a;

/// How far the conversation has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ConversationStage {
    /// Nothing was said.
    Created,
    /// After `initialize`.
    Initialized,
    /// After `launch`: the client says which breakpoints there are.
    Configuring,
    /// After `configurationDone`.
    Debugging,
    /// After `disconnect`.
    Disconnected,
}

/// What this client understands.
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
    /// A line of ours as the client counts it.
    pub fn line(&self, line: u32) -> i64 {
        i64::from(line) - i64::from(!self.lines_start_at1)
    }

    /// A line of the client as we count it; 0 for one that cannot be.
    pub fn line_from_client(&self, line: i64) -> u32 {
        u32::try_from(line.saturating_add(i64::from(!self.lines_start_at1))).unwrap_or(0)
    }

    /// The first column.
    pub fn column(&self) -> i64 {
        i64::from(self.columns_start_at1)
    }
}

/// The machine that is debugged, with what was made of it.
pub(crate) struct DapMachine {
    pub session: DebugSession,
    pub ladder: Option<LadderSource>,
    /// Made when it is first asked for.
    pub listing: Option<DisassemblyListing>,
    /// Bytes sent and resets up to this cycle were told.
    pub events_reported_to: u64,
    /// Why it stands.
    pub stop: StopEvent,
    /// The image, without folders.
    pub name: String,
    /// Folder of the image.
    pub folder: std::path::PathBuf,
    /// Objects of C of whose parts the client was told since the machine moved last, and their expressions.
    pub expandable_objects: std::cell::RefCell<Vec<(String, emu_debug::debug::ObjectExpr)>>,
}

impl DapMachine {
    /// The listing; made anew where program memory may have changed.
    pub fn listing(&mut self) -> &DisassemblyListing {
        let DapMachine { session, ladder, listing, .. } = self;
        listing.get_or_insert_with(|| DisassemblyListing::new(session, ladder.as_ref()))
    }

    /// Gives what an expression stands for another value.
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

    /// Does something from outside. What was told of the future that is gone now counts no more.
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
    pub(crate) client: ClientCapabilities,
    pub(crate) machine: Option<DapMachine>,
    pub(crate) points: BreakpointTable,
    pub(crate) run: Option<PendingRun>,
    events: Vec<(&'static str, Value)>,
    seq: i64,
}

/// Requests that a machine that runs can take.
#[rustfmt::skip]
const WHILE_RUNNING: &[&str] = &[
    "breakpointLocations", "configurationDone", "dataBreakpointInfo", "disconnect", "loadedSources", "pause", "restart",
    "setBreakpoints", "setDataBreakpoints", "setExceptionBreakpoints", "setFunctionBreakpoints", "setInstructionBreakpoints",
    "source", "terminate", "threads",
];

impl<'a> DebugAdapter<'a> {
    /// A conversation that begins.
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

    /// The client has gone; nothing more is to be said.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.stage == ConversationStage::Disconnected
    }

    /// The machine runs: [`DebugAdapter::run_slice`] is to be called until it does not.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.run.is_some() && !self.is_finished()
    }

    /// Takes a message; gives the response and the events that follow from it, in order.
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

    /// Answers a message that was no JSON.
    pub fn reject_garbled(&mut self, why: &str) -> Vec<Value> {
        vec![self.response(0, "", Err(RequestError::new(protocol::MALFORMED, why)))]
    }

    /// Runs on until the machine stands, `go_on` says no (it is asked about every millisecond), or a slice of a few hundredths of a second is over;
    /// gives the events.
    pub fn run_slice(&mut self, go_on: &mut dyn FnMut() -> bool) -> Vec<Value> {
        self.advance_run(go_on);
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

    /// An event, to go out behind the response.
    pub(crate) fn event(&mut self, name: &'static str, body: Value) {
        self.events.push((name, body));
    }

    /// Something for the user to read.
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

    /// The request has its place at this point of the conversation.
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
                format!("{command} is for a machine that stands; pause it first"),
            ));
        }
        Ok(())
    }

    /// The machine, which is there from `launch` on.
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
            let text = format!("sources have paths here, not the format `{}`", client.path_format);
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
                "launch wants `program`: a HEX or ELF image, or a ladder program",
            )
            .shown_to_user());
        }
        let opened = (self.open)(&arguments).map_err(|why| RequestError::new(protocol::LAUNCH, why).shown_to_user())?;
        let path = std::path::Path::new(&arguments.program);
        let name = path.file_name().map_or(arguments.program.clone(), |name| name.to_string_lossy().into_owned());
        let folder = path.parent().map(std::path::Path::to_path_buf).unwrap_or_default();
        self.machine = Some(DapMachine {
            expandable_objects: std::cell::RefCell::default(),
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

    /// Stands before the first instruction, or runs from there.
    fn begin_debugging(&mut self) {
        if self.launched.stop_on_entry {
            self.report_stop(StopEvent::entry());
        } else {
            self.run = Some(PendingRun::Continue);
        }
    }

    /// The program is not to be stopped by breakpoints.
    pub(crate) fn is_without_breakpoints(&self) -> bool {
        self.launched.no_debug
    }

    /// Everything anew, from the files as they are now.
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

/// The one thread.
pub(crate) const THREAD: i64 = 1;
