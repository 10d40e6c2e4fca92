//! The transport: a thread reads requests, so that a request can interrupt a running machine.

use std::collections::VecDeque;
use std::io::{BufReader, Read, Write};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use serde_json::Value;

use crate::adapter::{DebugAdapter, OpenMachine};
use crate::error::DapError;
use crate::framing::{self, IncomingMessage};

/// A message or error from the reading thread.
type ReceivedMessage = Result<IncomingMessage, DapError>;

/// Requests that have been received, the oldest first.
struct RequestInbox {
    from: Receiver<ReceivedMessage>,
    waiting: VecDeque<ReceivedMessage>,
}

impl RequestInbox {
    /// True if no request has been received. The end of the thread counts as a request, so that its last
    /// message is handled.
    fn is_empty(&mut self) -> bool {
        match self.from.try_recv() {
            Ok(read) => self.waiting.push_back(read),
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return false,
        }
        self.waiting.is_empty()
    }

    /// The next message; waits for it if `wait`.
    fn next(&mut self, wait: bool) -> Option<ReceivedMessage> {
        if let Some(read) = self.waiting.pop_front() {
            return Some(read);
        }
        if wait {
            return Some(self.from.recv().unwrap_or(Ok(IncomingMessage::End)));
        }
        match self.from.try_recv() {
            Ok(read) => Some(read),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Ok(IncomingMessage::End)),
        }
    }
}

/// Serves one client until it disconnects, its input ends, or the connection is lost.
///
/// # Errors
/// The input does not follow the framing of the protocol, or the output cannot be written.
pub fn serve(
    input: impl Read + Send + 'static,
    output: &mut dyn Write,
    open: &OpenMachine<'_>,
) -> Result<(), DapError> {
    let (to, from) = channel();
    thread::spawn(move || {
        let mut input = BufReader::new(input);
        loop {
            let read = framing::read_message(&mut input);
            let last = !matches!(read, Ok(IncomingMessage::Message(_) | IncomingMessage::Garbled(_)));
            if to.send(read).is_err() || last {
                return;
            }
        }
    });
    let mut inbox = RequestInbox { from, waiting: VecDeque::new() };
    let mut adapter = DebugAdapter::new(open);
    // Returns false if the client has disconnected.
    let mut send =
        |messages: Vec<Value>| match messages.iter().try_for_each(|message| framing::write_message(output, message)) {
            Ok(()) => Ok(true),
            Err(why) if framing::is_disconnect(&why) => Ok(false),
            Err(why) => Err(DapError::UnwritableOutput(why)),
        };
    while !adapter.is_finished() {
        let there = match inbox.next(!adapter.is_running()) {
            Some(Ok(IncomingMessage::Message(message))) => send(adapter.handle(&message))?,
            Some(Ok(IncomingMessage::Garbled(why))) => send(adapter.reject_garbled(&why))?,
            Some(Ok(IncomingMessage::End)) => false,
            Some(Err(error)) => return Err(error),
            None => send(adapter.run_slice(&mut || inbox.is_empty()))?,
        };
        if !there {
            break;
        }
    }
    Ok(())
}
