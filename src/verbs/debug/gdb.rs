//! `emu debug --gdb`: serves a gdb client instead of a command line.

use std::net::TcpListener;

use clap::Args;
use emu_debug::debug::DebugSession;
use emu_gdb::{GdbOptions, MonitorHandler, parse_address, serve};
use ladder_view::LadderView;

use super::open::OpenedSession;
use crate::shared::fail::VerbFailure;
use crate::shared::output::print_to_stderr;

/// Flags of the gdb server.
#[derive(Debug, Args)]
pub struct GdbArgs {
    /// Serve a client of gdb's remote protocol instead: :1234 on this machine only, HOST:PORT as written;
    /// port 0 selects any free one. Standard error shows the port. The program ends with exit code 0 when the
    /// client has disconnected.
    #[arg(long = "gdb", value_name = "ADDR", conflicts_with_all = ["files", "commands", "batch"])]
    addr: Option<String>,
    /// With --gdb: when a client has disconnected, the next one can connect and finds the machine as the
    /// previous one left it.
    #[arg(long = "gdb-persist", requires = "addr")]
    persist: bool,
}

impl GdbArgs {
    /// Opens the listening socket, if `--gdb` is given.
    ///
    /// # Errors
    /// The address is malformed or cannot be used.
    pub fn listener(&self) -> Result<Option<TcpListener>, VerbFailure> {
        let Some(text) = &self.addr else { return Ok(None) };
        let addr = parse_address(text).map_err(|why| VerbFailure::Usage(format!("--gdb {why}")))?;
        let listener = TcpListener::bind(addr);
        listener.map(Some).map_err(|error| VerbFailure::Usage(format!("--gdb cannot listen on {addr}: {error}")))
    }

    /// Serves until the client has disconnected. Returns the exit code.
    pub fn serve(&self, mut opened: OpenedSession, listener: &TcpListener) -> Result<u8, VerbFailure> {
        let monitor = opened.view.take().map(|view| -> Box<MonitorHandler> {
            Box::new(move |session: &mut DebugSession, text: &str| ladder(&view, session, text))
        });
        let options = GdbOptions { persist: self.persist, monitor };
        let ended = serve(&mut opened.session, listener, options, &mut |line| print_to_stderr(&format!("{line}\n")));
        ended.map(|_| 0).map_err(|error| VerbFailure::Usage(format!("--gdb cannot continue: {error}")))
    }
}

/// Executes `monitor` commands for a ladder program. Returns `None` for other commands.
fn ladder(view: &LadderView, session: &DebugSession, text: &str) -> Option<Vec<String>> {
    let (word, rest) = text.split_once(' ').unwrap_or((text, ""));
    match word.trim_end_matches('?') {
        "why" => {
            let follow = session.follower()?;
            Some(view.explain_value(follow, session.machine(), rest.trim()).unwrap_or_else(|why| vec![why.to_string()]))
        }
        "rung" => Some(view.draw(session.follower(), session.machine(), false)),
        "values" => {
            let show = |(name, value): (String, Option<i64>)| {
                format!("{name} = {}", value.map_or("?".to_owned(), |value| value.to_string()))
            };
            Some(view.values(session.machine()).into_iter().map(show).collect())
        }
        _ => None,
    }
}
