//! Shows a view on a real terminal, and restores the terminal at every exit: quit, error, panic or signal.

use std::collections::VecDeque;
use std::io::{self, IsTerminal, Stdout};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{panic, thread};

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use crossterm::{cursor, execute, terminal};
use ratatui_core::layout::Rect;
use ratatui_core::terminal::{Terminal, TerminalOptions, Viewport};
use ratatui_crossterm::CrosstermBackend;

use crate::{ScreenKey, ScreenStyle, ScreenView, ViewRequest};

/// Time between two pictures while the view changes with time.
const FRAME_INTERVAL: Duration = Duration::from_millis(33);

/// Maximum time until a signal is noticed.
const SIGNAL_POLL: Duration = Duration::from_millis(100);

/// Time for the view to end by itself when the process must end.
const EXIT_GRACE: Duration = Duration::from_millis(500);

/// Maximum number of columns and of lines of a picture; a terminal may report 65535 for both.
pub const MAX_SCREEN_SIDE: u16 = 500;

/// True while the terminal is in raw mode with the alternate screen.
static TERMINAL_TAKEN: AtomicBool = AtomicBool::new(false);

/// How the view ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScreenEnd {
    /// The user left the view.
    Quit,
    /// The process must end by this signal. Pass it to [`exit_by_signal`] after cleaning up.
    Signal(i32),
}

/// Ends the process like the default handler of the signal.
pub fn exit_by_signal(signal: i32) {
    _ = signal_hook::low_level::emulate_default_handler(signal);
}

/// Shows a view until the user leaves it.
///
/// # Errors
/// The terminal cannot be read or written.
pub fn show(app: &mut dyn ScreenView, look: ScreenStyle) -> io::Result<ScreenEnd> {
    let signals = SignalListener::new()?;
    // An error that comes from a lost terminal is treated like SIGHUP.
    run(app, look, &signals).or_else(|error| signals.0.poll_end().map(ScreenEnd::Signal).ok_or(error))
}

fn run(app: &mut dyn ScreenView, look: ScreenStyle, signals: &SignalListener) -> io::Result<ScreenEnd> {
    let mut screen = RealTerminal::open()?;
    let mut last = Instant::now();
    loop {
        screen.draw(app, look)?;
        let wait = if app.is_moving() { FRAME_INTERVAL.saturating_sub(last.elapsed()) } else { SIGNAL_POLL };
        let until = Instant::now() + wait;
        // Handles all keys that are available before the next picture.
        loop {
            if let Some(signal) = signals.0.seen_signal() {
                return Ok(ScreenEnd::Signal(signal));
            }
            let waiting = typed_ahead().pop_front();
            let key = match waiting {
                Some(key) => key,
                None if !event::poll(until.saturating_duration_since(Instant::now()))? => break,
                None => match event::read()? {
                    Event::Resize(..) => break,
                    event => match key_of_event(event) {
                        Some(key) => key,
                        None => continue,
                    },
                },
            };
            if key == ScreenKey::Ctrl('z') {
                screen.suspend()?;
                last = Instant::now();
                break;
            }
            if app.handle_key(key, screen.area()?) == ViewRequest::Quit {
                return Ok(ScreenEnd::Quit);
            }
            if !app.is_moving() {
                break;
            }
        }
        let passed = last.elapsed();
        if !app.is_moving() {
            last = Instant::now();
        } else if passed >= FRAME_INTERVAL {
            last = Instant::now();
            app.advance_time(passed);
        }
    }
}

/// Time that work may take before keys are polled for an interrupt.
const INTERRUPT_DELAY: Duration = Duration::from_millis(150);

/// Keys that were pressed during work and have not been handled yet.
static TYPED_AHEAD: Mutex<VecDeque<ScreenKey>> = Mutex::new(VecDeque::new());

/// Maximum number of keys kept.
const MAX_TYPED_AHEAD: usize = 1000;

fn typed_ahead() -> MutexGuard<'static, VecDeque<ScreenKey>> {
    TYPED_AHEAD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `work`, which must poll `interrupt` periodically. If the work takes long, Ctrl-C and Escape set
/// `interrupt` and drop the keys typed before; other keys are handled after the work.
pub fn run_interruptible<T>(interrupt: &AtomicBool, work: impl FnOnce() -> T) -> T {
    /// Signals the end of the work, even if it panics.
    struct WorkFinished<'a>(&'a AtomicBool);
    impl Drop for WorkFinished<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::SeqCst);
        }
    }
    let over = AtomicBool::new(false);
    let look = || {
        let begin = Instant::now();
        while !over.load(Ordering::SeqCst) {
            if begin.elapsed() < INTERRUPT_DELAY {
                thread::sleep(Duration::from_millis(1));
                continue;
            }
            match event::poll(Duration::from_millis(5))
                .and_then(|there| if there { event::read().map(Some) } else { Ok(None) })
            {
                Ok(Some(event)) => match key_of_event(event) {
                    Some(ScreenKey::Ctrl('c') | ScreenKey::Escape) => {
                        typed_ahead().clear();
                        interrupt.store(true, Ordering::SeqCst);
                    }
                    Some(key) if typed_ahead().len() < MAX_TYPED_AHEAD => typed_ahead().push_back(key),
                    _ => {}
                },
                Ok(None) => {}
                // A lost terminal interrupts the work.
                Err(_) => {
                    interrupt.store(true, Ordering::SeqCst);
                    return;
                }
            }
        }
    };
    thread::scope(|scope| {
        let _over = WorkFinished(&over);
        scope.spawn(look);
        work()
    })
}

/// The terminal while a view uses it.
struct RealTerminal {
    /// Never dropped: its destructor prints an error if the cursor cannot be shown, and fails if the terminal
    /// is lost.
    terminal: ManuallyDrop<Terminal<CrosstermBackend<Stdout>>>,
    /// The area that is drawn.
    area: Rect,
}

impl RealTerminal {
    fn open() -> io::Result<RealTerminal> {
        static HOOK: AtomicBool = AtomicBool::new(false);
        if !HOOK.swap(true, Ordering::SeqCst) {
            // The hook restores the terminal before the message of a panic is printed, so that it can be
            // read.
            let before = panic::take_hook();
            panic::set_hook(Box::new(move |what| {
                restore_terminal();
                before(what);
            }));
        }
        take_terminal()?;
        let options = TerminalOptions { viewport: Viewport::Fixed(Rect::ZERO) };
        match Terminal::with_options(CrosstermBackend::new(io::stdout()), options) {
            Ok(terminal) => Ok(RealTerminal { terminal: ManuallyDrop::new(terminal), area: Rect::ZERO }),
            Err(error) => {
                restore_terminal();
                Err(error)
            }
        }
    }

    fn area(&self) -> io::Result<Rect> {
        let size = self.terminal.size()?;
        Ok(Rect::new(0, 0, size.width.min(MAX_SCREEN_SIDE), size.height.min(MAX_SCREEN_SIDE)))
    }

    fn draw(&mut self, app: &dyn ScreenView, look: ScreenStyle) -> io::Result<()> {
        let area = self.area()?;
        if self.area != area {
            self.terminal.resize(area)?;
            self.area = area;
        }
        self.terminal.draw(|frame| *frame.buffer_mut() = app.render(frame.area(), look)).map(|_| ())
    }

    /// Suspends the process, as for Ctrl-Z, until the shell continues it.
    fn suspend(&mut self) -> io::Result<()> {
        restore_terminal();
        #[cfg(unix)]
        signal_hook::low_level::raise(signal_hook::consts::SIGTSTP)?;
        take_terminal()?;
        self.terminal.clear()
    }
}

impl Drop for RealTerminal {
    fn drop(&mut self) {
        restore_terminal();
    }
}

fn take_terminal() -> io::Result<()> {
    TERMINAL_TAKEN.store(true, Ordering::SeqCst);
    let taken =
        terminal::enable_raw_mode().and_then(|()| execute!(io::stdout(), terminal::EnterAlternateScreen, cursor::Hide));
    taken.inspect_err(|_| restore_terminal())
}

/// Restores the terminal, at most once.
fn restore_terminal() {
    if TERMINAL_TAKEN.swap(false, Ordering::SeqCst) {
        _ = execute!(io::stdout(), terminal::LeaveAlternateScreen, cursor::Show);
        _ = terminal::disable_raw_mode();
    }
}

/// The signals that end the process.
#[cfg(unix)]
const END_SIGNALS: [i32; 4] = {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    [SIGTERM, SIGHUP, SIGINT, SIGQUIT]
};

/// The conditions that end the process: a signal, or a lost terminal, which counts as SIGHUP.
struct EndWatch {
    signal: Arc<AtomicUsize>,
    /// True if keys come from standard input.
    reads_stdin: bool,
    finished: AtomicBool,
}

impl EndWatch {
    fn seen_signal(&self) -> Option<i32> {
        i32::try_from(self.signal.load(Ordering::SeqCst)).ok().filter(|signal| *signal != 0)
    }

    /// The signal that was received; also checks whether the terminal is lost.
    fn poll_end(&self) -> Option<i32> {
        #[cfg(unix)]
        if !io::stdout().is_terminal() || self.reads_stdin && !io::stdin().is_terminal() {
            let hangup = usize::try_from(signal_hook::consts::SIGHUP).unwrap_or(0);
            _ = self.signal.compare_exchange(0, hangup, Ordering::SeqCst, Ordering::SeqCst);
        }
        self.seen_signal()
    }

    /// Ends the process if the view does not: a command may take long, and reading keys does not return on a
    /// lost terminal.
    fn guard_exit(&self) {
        let mut since = None;
        while !self.finished.load(Ordering::SeqCst) {
            if let Some(signal) = self.poll_end()
                && since.get_or_insert_with(Instant::now).elapsed() >= EXIT_GRACE
            {
                // Restoring may block on a terminal that does not accept output.
                let back = thread::spawn(restore_terminal);
                let begin = Instant::now();
                while !back.is_finished() && begin.elapsed() < EXIT_GRACE {
                    thread::sleep(Duration::from_millis(1));
                }
                exit_by_signal(signal);
            }
            thread::sleep(SIGNAL_POLL);
        }
    }
}

/// Listens for signals that end the process while a view is shown.
struct SignalListener(Arc<EndWatch>);

impl SignalListener {
    fn new() -> io::Result<SignalListener> {
        let reads = io::stdin().is_terminal();
        let ending =
            Arc::new(EndWatch { signal: Arc::default(), reads_stdin: reads, finished: AtomicBool::new(false) });
        #[cfg(unix)]
        for signal in END_SIGNALS {
            let number = usize::try_from(signal).unwrap_or(0);
            signal_hook::flag::register_usize(signal, Arc::clone(&ending.signal), number)?;
        }
        let guard = Arc::clone(&ending);
        thread::Builder::new().spawn(move || guard.guard_exit())?;
        Ok(SignalListener(ending))
    }
}

impl Drop for SignalListener {
    fn drop(&mut self) {
        self.0.finished.store(true, Ordering::SeqCst);
    }
}

/// The key of a terminal event.
fn key_of_event(event: Event) -> Option<ScreenKey> {
    match event {
        Event::Key(key) if key.kind != KeyEventKind::Release => key_of_key_event(key),
        _ => None,
    }
}

/// Converts a key of the terminal library.
fn key_of_key_event(event: KeyEvent) -> Option<ScreenKey> {
    Some(match event.code {
        KeyCode::Char(c) if event.modifiers.contains(KeyModifiers::CONTROL) => ScreenKey::Ctrl(c.to_ascii_lowercase()),
        KeyCode::Char(c) if event.modifiers.contains(KeyModifiers::ALT) => ScreenKey::Alt(c),
        KeyCode::Char(c) => ScreenKey::Char(c),
        KeyCode::Enter => ScreenKey::Enter,
        KeyCode::Esc => ScreenKey::Escape,
        KeyCode::Backspace => ScreenKey::Backspace,
        KeyCode::Tab => ScreenKey::Tab,
        KeyCode::Up => ScreenKey::Up,
        KeyCode::Down => ScreenKey::Down,
        KeyCode::Left => ScreenKey::Left,
        KeyCode::Right => ScreenKey::Right,
        KeyCode::PageUp => ScreenKey::PageUp,
        KeyCode::PageDown => ScreenKey::PageDown,
        KeyCode::Home => ScreenKey::Home,
        KeyCode::End => ScreenKey::End,
        _ => return None,
    })
}
