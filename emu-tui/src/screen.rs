//! A view on a real terminal, which gets back what it was on every way out: leaving, an error, a panic, a signal.

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

use crate::{App, Key, Look, Wish};

/// Time between two pictures while something moves.
const PICTURE: Duration = Duration::from_millis(33);

/// How long a signal may have to wait for its answer.
const PATIENCE: Duration = Duration::from_millis(100);

/// How long the view may take to end by itself, once the process is to end.
const GRACE: Duration = Duration::from_millis(500);

/// Most columns and most lines of a picture. A terminal may say that it has 65535 of both.
pub const LARGEST: u16 = 500;

/// True while the terminal is ours.
static OURS: AtomicBool = AtomicBool::new(false);

/// How it came to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// It was left.
    Left,
    /// The process is to end by this signal. Pass it to [`obey`] once everything is put away.
    Signal(i32),
}

/// Ends the process as the signal would have.
pub fn obey(signal: i32) {
    _ = signal_hook::low_level::emulate_default_handler(signal);
}

/// Shows a view until it is left.
///
/// # Errors
/// The terminal cannot be read or written.
pub fn show(app: &mut dyn App, look: Look) -> io::Result<End> {
    let signals = Signals::new()?;
    // What fails because the terminal is gone ends as that does.
    run(app, look, &signals).or_else(|error| signals.0.look().map(End::Signal).ok_or(error))
}

fn run(app: &mut dyn App, look: Look, signals: &Signals) -> io::Result<End> {
    let mut screen = Screen::open()?;
    let mut last = Instant::now();
    loop {
        screen.draw(app, look)?;
        let wait = if app.moves() { PICTURE.saturating_sub(last.elapsed()) } else { PATIENCE };
        let until = Instant::now() + wait;
        // All keys that are there before the next picture.
        loop {
            if let Some(signal) = signals.0.seen() {
                return Ok(End::Signal(signal));
            }
            let waiting = ahead().pop_front();
            let key = match waiting {
                Some(key) => key,
                None if !event::poll(until.saturating_duration_since(Instant::now()))? => break,
                None => match event::read()? {
                    Event::Resize(..) => break,
                    event => match pressed(event) {
                        Some(key) => key,
                        None => continue,
                    },
                },
            };
            if key == Key::Ctrl('z') {
                screen.suspend()?;
                last = Instant::now();
                break;
            }
            if app.key(key, screen.area()?) == Wish::Quit {
                return Ok(End::Left);
            }
            if !app.moves() {
                break;
            }
        }
        let passed = last.elapsed();
        if !app.moves() {
            last = Instant::now();
        } else if passed >= PICTURE {
            last = Instant::now();
            app.pass(passed);
        }
    }
}

/// How long a piece of work may take before keys are looked at for one that ends it.
const UNASKED: Duration = Duration::from_millis(150);

/// Keys that were pressed during a piece of work, and are still to be taken.
static AHEAD: Mutex<VecDeque<Key>> = Mutex::new(VecDeque::new());

/// How many of them are kept.
const MOST_AHEAD: usize = 1000;

fn ahead() -> MutexGuard<'static, VecDeque<Key>> {
    AHEAD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does a piece of work that looks at `interrupt` now and then. When it takes long, Ctrl-C or escape set that, and drop the keys before
/// them; other keys that are pressed then are taken behind it.
pub fn interruptible<T>(interrupt: &AtomicBool, work: impl FnOnce() -> T) -> T {
    /// Says that the work is over, also when it panics.
    struct Over<'a>(&'a AtomicBool);
    impl Drop for Over<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::SeqCst);
        }
    }
    let over = AtomicBool::new(false);
    let look = || {
        let begin = Instant::now();
        while !over.load(Ordering::SeqCst) {
            if begin.elapsed() < UNASKED {
                thread::sleep(Duration::from_millis(1));
                continue;
            }
            match event::poll(Duration::from_millis(5))
                .and_then(|there| if there { event::read().map(Some) } else { Ok(None) })
            {
                Ok(Some(event)) => match pressed(event) {
                    Some(Key::Ctrl('c') | Key::Escape) => {
                        ahead().clear();
                        interrupt.store(true, Ordering::SeqCst);
                    }
                    Some(key) if ahead().len() < MOST_AHEAD => ahead().push_back(key),
                    _ => {}
                },
                Ok(None) => {}
                // A terminal that is gone ends the work.
                Err(_) => {
                    interrupt.store(true, Ordering::SeqCst);
                    return;
                }
            }
        }
    };
    thread::scope(|scope| {
        let _over = Over(&over);
        scope.spawn(look);
        work()
    })
}

/// The terminal while it is ours.
struct Screen {
    /// Its end would say on standard error that the cursor cannot be shown, and fail where that is a terminal that is gone.
    terminal: ManuallyDrop<Terminal<CrosstermBackend<Stdout>>>,
    /// What of it is drawn on.
    area: Rect,
}

impl Screen {
    fn open() -> io::Result<Screen> {
        static HOOK: AtomicBool = AtomicBool::new(false);
        if !HOOK.swap(true, Ordering::SeqCst) {
            // The message of a panic is to be read, so the terminal is given back before it is written.
            let before = panic::take_hook();
            panic::set_hook(Box::new(move |what| {
                give_back();
                before(what);
            }));
        }
        take()?;
        let options = TerminalOptions { viewport: Viewport::Fixed(Rect::ZERO) };
        match Terminal::with_options(CrosstermBackend::new(io::stdout()), options) {
            Ok(terminal) => Ok(Screen { terminal: ManuallyDrop::new(terminal), area: Rect::ZERO }),
            Err(error) => {
                give_back();
                Err(error)
            }
        }
    }

    fn area(&self) -> io::Result<Rect> {
        let size = self.terminal.size()?;
        Ok(Rect::new(0, 0, size.width.min(LARGEST), size.height.min(LARGEST)))
    }

    fn draw(&mut self, app: &dyn App, look: Look) -> io::Result<()> {
        let area = self.area()?;
        if self.area != area {
            self.terminal.resize(area)?;
            self.area = area;
        }
        self.terminal.draw(|frame| *frame.buffer_mut() = app.view(frame.area(), look)).map(|_| ())
    }

    /// Lets the shell have the terminal, until it calls us back.
    fn suspend(&mut self) -> io::Result<()> {
        give_back();
        #[cfg(unix)]
        signal_hook::low_level::raise(signal_hook::consts::SIGTSTP)?;
        take()?;
        self.terminal.clear()
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        give_back();
    }
}

fn take() -> io::Result<()> {
    OURS.store(true, Ordering::SeqCst);
    let taken =
        terminal::enable_raw_mode().and_then(|()| execute!(io::stdout(), terminal::EnterAlternateScreen, cursor::Hide));
    taken.inspect_err(|_| give_back())
}

/// Gives the terminal back, once.
fn give_back() {
    if OURS.swap(false, Ordering::SeqCst) {
        _ = execute!(io::stdout(), terminal::LeaveAlternateScreen, cursor::Show);
        _ = terminal::disable_raw_mode();
    }
}

/// The signals that end it.
#[cfg(unix)]
const ENDS: [i32; 4] = {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
    [SIGTERM, SIGHUP, SIGINT, SIGQUIT]
};

/// What ends the process: a signal, and SIGHUP where the terminal is gone, told or not.
struct Ending {
    seen: Arc<AtomicUsize>,
    /// Keys come from standard input.
    reads: bool,
    over: AtomicBool,
}

impl Ending {
    fn seen(&self) -> Option<i32> {
        i32::try_from(self.seen.load(Ordering::SeqCst)).ok().filter(|signal| *signal != 0)
    }

    /// What has been seen, with a look at the terminal: one that is gone is none any more.
    fn look(&self) -> Option<i32> {
        #[cfg(unix)]
        if !io::stdout().is_terminal() || self.reads && !io::stdin().is_terminal() {
            let hangup = usize::try_from(signal_hook::consts::SIGHUP).unwrap_or(0);
            _ = self.seen.compare_exchange(0, hangup, Ordering::SeqCst, Ordering::SeqCst);
        }
        self.seen()
    }

    /// Ends the process where the view does not come to it: a command may take long, and the reader of keys does not return from a
    /// terminal that is gone.
    fn guard(&self) {
        let mut since = None;
        while !self.over.load(Ordering::SeqCst) {
            if let Some(signal) = self.look()
                && since.get_or_insert_with(Instant::now).elapsed() >= GRACE
            {
                // What is to be written may wait for a terminal that takes nothing.
                let back = thread::spawn(give_back);
                let begin = Instant::now();
                while !back.is_finished() && begin.elapsed() < GRACE {
                    thread::sleep(Duration::from_millis(1));
                }
                obey(signal);
            }
            thread::sleep(PATIENCE);
        }
    }
}

/// Listens for what ends the process, as long as there is a view.
struct Signals(Arc<Ending>);

impl Signals {
    fn new() -> io::Result<Signals> {
        let reads = io::stdin().is_terminal();
        let ending = Arc::new(Ending { seen: Arc::default(), reads, over: AtomicBool::new(false) });
        #[cfg(unix)]
        for signal in ENDS {
            let number = usize::try_from(signal).unwrap_or(0);
            signal_hook::flag::register_usize(signal, Arc::clone(&ending.seen), number)?;
        }
        let guard = Arc::clone(&ending);
        thread::Builder::new().spawn(move || guard.guard())?;
        Ok(Signals(ending))
    }
}

impl Drop for Signals {
    fn drop(&mut self) {
        self.0.over.store(true, Ordering::SeqCst);
    }
}

/// The key that an event is.
fn pressed(event: Event) -> Option<Key> {
    match event {
        Event::Key(key) if key.kind != KeyEventKind::Release => named(key),
        _ => None,
    }
}

/// A key of the terminal as one of ours.
fn named(event: KeyEvent) -> Option<Key> {
    Some(match event.code {
        KeyCode::Char(c) if event.modifiers.contains(KeyModifiers::CONTROL) => Key::Ctrl(c.to_ascii_lowercase()),
        KeyCode::Char(c) if event.modifiers.contains(KeyModifiers::ALT) => Key::Alt(c),
        KeyCode::Char(c) => Key::Char(c),
        KeyCode::Enter => Key::Enter,
        KeyCode::Esc => Key::Escape,
        KeyCode::Backspace => Key::Backspace,
        KeyCode::Tab => Key::Tab,
        KeyCode::Up => Key::Up,
        KeyCode::Down => Key::Down,
        KeyCode::Left => Key::Left,
        KeyCode::Right => Key::Right,
        KeyCode::PageUp => Key::PageUp,
        KeyCode::PageDown => Key::PageDown,
        KeyCode::Home => Key::Home,
        KeyCode::End => Key::End,
        _ => return None,
    })
}
