//! `emu dap`: the debug adapter for editors.

use std::io;
use std::net::{TcpListener, TcpStream};

use clap::{Args, Parser};
use emu_dap::{LaunchArguments, LaunchError, OpenedMachine, serve};

use crate::shared::codes::{PROTOCOL, file_error};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use crate::shared::report::{FileTexts, MessageStyle};
use crate::verbs::debug::open;
use crate::verbs::debug::open::DebugSubject;

const EXAMPLES: &str = "\
Examples:
  emu dap                  for an editor that starts it
  emu dap --listen :4711   for an editor that connects over TCP

The editor says in its `launch` request what is debugged; docs/dap.md shows how for VS Code, Neovim and Emacs.

Exit codes: 0 the editor disconnected, or its input or connection ended; 2 a usage error; 3 a message does not
follow the protocol.";

/// Flags of `emu dap`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DapArgs {
    /// Wait for an editor at this address instead of using standard input and output: :4711 on this machine,
    /// 0.0.0.0:4711 for all machines, :0 for a free port, which is printed on standard error. The program
    /// serves one editor and ends.
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<String>,
}

/// The flags of `emu debug`, as a `launch` request gives them.
#[derive(Debug, Parser)]
#[command(name = "launch", no_binary_name = true)]
struct LaunchFlags {
    #[command(flatten)]
    subject: DebugSubject,
}

/// Serves one editor.
pub fn dap(args: &DapArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    crate::shared::input::reserve_stdin();
    let open = |arguments: &LaunchArguments| open_machine(arguments, style);
    let (served, from) = match &args.listen {
        None => (serve(io::stdin(), &mut io::stdout(), &open), "-"),
        Some(address) => {
            let stream = accept_client(address)?;
            let failed = |why: io::Error| VerbFailure::Usage(format!("the connection failed: {why}"));
            let mut output = stream.try_clone().map_err(failed)?;
            let served = serve(stream, &mut output, &open);
            _ = output.shutdown(std::net::Shutdown::Both);
            (served, address.as_str())
        }
    };
    match served {
        Ok(()) => Ok(exit::OK),
        Err(why) => {
            let hint = "an editor talks to `emu dap`; docs/dap.md shows how";
            Err(VerbFailure::Refused(vec![file_error(PROTOCOL, from, why.to_string(), hint)], FileTexts::default()))
        }
    }
}

/// Waits for one client connection.
fn accept_client(address: &str) -> Result<TcpStream, VerbFailure> {
    let whole = if address.starts_with(':') { format!("127.0.0.1{address}") } else { address.to_owned() };
    let refused = |why: &io::Error| {
        VerbFailure::invalid_flag_value("--listen <ADDRESS>", address, &format!("{why}; write :4711"))
    };
    let listener = TcpListener::bind(&whole).map_err(|why| refused(&why))?;
    let own = listener.local_addr().map_err(|why| refused(&why))?;
    output::print_to_stderr(&format!("listening on {own}\n"));
    let (stream, _) = listener.accept().map_err(|why| refused(&why))?;
    _ = stream.set_nodelay(true);
    Ok(stream)
}

/// Builds the machine. Diagnostics are drawn on standard error, and sent to the editor as one sentence each.
fn open_machine(arguments: &LaunchArguments, style: &MessageStyle) -> Result<OpenedMachine, LaunchError> {
    let launch = LaunchFlags::try_parse_from(launch_flags(arguments)).map_err(|why| {
        let text = why.to_string();
        text.lines().take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
    })?;
    let found = open::open_session(&launch.subject, style).map_err(|failure| failure_text(&failure))?;
    Ok(OpenedMachine { session: found.session, view: found.view })
}

/// Returns the flags of `emu debug` for a `launch` request.
fn launch_flags(arguments: &LaunchArguments) -> Vec<String> {
    let mut flags = Vec::new();
    let mut flag = |name: &str, value: &Option<String>| {
        flags.extend(value.iter().map(|value| format!("--{name}={value}")));
    };
    flag("mcu", &arguments.mcu);
    flag("map", &arguments.map);
    flag("ladder", &arguments.ladder);
    flag("clock", &arguments.clock);
    flag("history", &arguments.history);
    flags.extend(arguments.symbols.iter().map(|file| format!("--symbols={file}")));
    flags.extend(arguments.args.iter().cloned());
    flags.extend(["--".to_owned(), arguments.program.clone()]);
    flags
}

/// Returns the text of a failure to build the machine, for the editor.
fn failure_text(failure: &VerbFailure) -> String {
    match failure {
        VerbFailure::Usage(text) => text.clone(),
        VerbFailure::Pipe => "standard output is closed".to_owned(),
        VerbFailure::Refused(diagnostics, _) => {
            let errors = diagnostics.iter().filter(|diagnostic| diagnostic.is_error());
            let lines = errors.map(|d| {
                let place =
                    if d.pos.line > 0 { format!("{}:{}:{}", d.file, d.pos.line, d.pos.column) } else { d.file.clone() };
                format!("{}: {place}: {}; {}", d.code, d.cause, d.hint)
            });
            lines.collect::<Vec<_>>().join("\n")
        }
    }
}
