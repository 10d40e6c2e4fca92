//! `emu debug --gdb`: the session serves a client of gdb's protocol instead of a user.

use std::net::TcpListener;

use clap::Args;
use emu_debug::debug::DebugSession;
use emu_gdb::{GdbOptions, MonitorHandler, parse_address, serve};
use ladder_view::LadderView;

use super::open::OpenedSession;
use crate::shared::fail::VerbFailure;
use crate::shared::output::print_to_stderr;

/// Its flags.
#[derive(Debug, Args)]
pub struct GdbArgs {
    /// Serve a client of gdb's remote protocol instead: :1234 on this machine only, HOST:PORT as written; port 0 is any free one.
    /// Standard error tells the port. It ends with exit code 0 when the client has gone.
    #[arg(long = "gdb", value_name = "ADDR", conflicts_with_all = ["files", "commands", "batch"])]
    addr: Option<String>,
    /// With --gdb: when a client has gone, the next one may come, and finds the machine where it stands.
    #[arg(long = "gdb-persist", requires = "addr")]
    persist: bool,
}

impl GdbArgs {
    /// The place where a client may come, if one is wanted; taken before anything else is done.
    ///
    /// # Errors
    /// It is no address, or not to be had.
    pub fn listener(&self) -> Result<Option<TcpListener>, VerbFailure> {
        let Some(text) = &self.addr else { return Ok(None) };
        let addr = parse_address(text).map_err(|why| VerbFailure::Usage(format!("--gdb {why}")))?;
        let listener = TcpListener::bind(addr);
        listener.map(Some).map_err(|error| VerbFailure::Usage(format!("--gdb cannot listen on {addr}: {error}")))
    }

    /// Serves until the client has gone.
    pub fn serve(&self, mut opened: OpenedSession, listener: &TcpListener) -> Result<u8, VerbFailure> {
        let monitor = opened.view.take().map(|view| -> Box<MonitorHandler> {
            Box::new(move |session: &mut DebugSession, text: &str| ladder(&view, session, text))
        });
        let options = GdbOptions { persist: self.persist, monitor };
        let ended = serve(&mut opened.session, listener, options, &mut |line| print_to_stderr(&format!("{line}\n")));
        ended.map(|_| 0).map_err(|error| VerbFailure::Usage(format!("--gdb cannot go on: {error}")))
    }
}

/// Commands behind `monitor` for a ladder program.
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
