//! The transport: a thread reads requests, so that one that comes in interrupts a machine that runs.

use std::collections::VecDeque;
use std::io::{BufReader, Read, Write};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use serde_json::Value;

use crate::adapter::{Adapter, Opener};
use crate::frame::{self, Incoming};

/// What the thread has read.
type Received = Result<Incoming, String>;

/// Requests that are there, the oldest first.
struct Inbox {
    from: Receiver<Received>,
    waiting: VecDeque<Received>,
}

impl Inbox {
    /// Nothing is there yet. That the thread is gone is told when its last message was read.
    fn is_empty(&mut self) -> bool {
        match self.from.try_recv() {
            Ok(read) => self.waiting.push_back(read),
            Err(TryRecvError::Empty) => {}
            Err(TryRecvError::Disconnected) => return false,
        }
        self.waiting.is_empty()
    }

    /// The next message; waits for it if `wait`.
    fn next(&mut self, wait: bool) -> Option<Received> {
        if let Some(read) = self.waiting.pop_front() {
            return Some(read);
        }
        if wait {
            return Some(self.from.recv().unwrap_or(Ok(Incoming::End)));
        }
        match self.from.try_recv() {
            Ok(read) => Some(read),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Ok(Incoming::End)),
        }
    }
}

/// Serves one client until it disconnects, its input ends or its connection is gone.
///
/// # Errors
/// The input is not framed as the protocol wants it, or the output takes no more: one sentence.
pub fn serve(input: impl Read + Send + 'static, output: &mut dyn Write, open: &Opener<'_>) -> Result<(), String> {
    let (to, from) = channel();
    thread::spawn(move || {
        let mut input = BufReader::new(input);
        loop {
            let read = frame::read(&mut input);
            let last = !matches!(read, Ok(Incoming::Message(_) | Incoming::Garbled(_)));
            if to.send(read).is_err() || last {
                return;
            }
        }
    });
    let mut inbox = Inbox { from, waiting: VecDeque::new() };
    let mut adapter = Adapter::new(open);
    // False where the client has gone.
    let mut send = |messages: Vec<Value>| match messages.iter().try_for_each(|message| frame::write(output, message)) {
        Ok(()) => Ok(true),
        Err(why) if frame::is_gone(&why) => Ok(false),
        Err(why) => Err(format!("the output takes no more: {why}")),
    };
    while !adapter.is_over() {
        let there = match inbox.next(!adapter.is_running()) {
            Some(Ok(Incoming::Message(message))) => send(adapter.handle(&message))?,
            Some(Ok(Incoming::Garbled(why))) => send(adapter.garbled(&why))?,
            Some(Ok(Incoming::End)) => false,
            Some(Err(why)) => return Err(why),
            None => send(adapter.proceed(&mut || inbox.is_empty()))?,
        };
        if !there {
            break;
        }
    }
    Ok(())
}
