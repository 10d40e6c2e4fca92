//! A session with any chip, and a server for it in a separate thread.

use std::net::{SocketAddr, TcpListener};
use std::thread::JoinHandle;

use emu_core::chip::Chip;
use emu_core::cpu::RamInit;
use emu_core::image::Image;
use emu_debug::CycleClock;
use emu_debug::debug::{DebugSession, NameScope, SessionOptions};
use emu_test_machines::DebugMachine;

/// The chip with this name.
pub fn chip(name: &str) -> &'static Chip {
    emu_test_machines::find_chip(name).unwrap_or_else(|| panic!("no chip {name}"))
}

/// A machine after power-up with zeros in its RAM.
pub fn session(chip: &'static Chip, image: &Image) -> DebugSession {
    use emu_core::chip::ChipFamily;
    let hz = chip.default_hz;
    let machine = match chip.family {
        ChipFamily::Avr => emu_avr::Avr::new(chip, image, RamInit::Zero).boxed(hz),
        ChipFamily::Mcs51 => emu_8051::Mcs51::new(chip, image, RamInit::Zero).boxed(hz),
        ChipFamily::Pic16 => emu_pic16::Pic16::new(chip, image, RamInit::Zero).boxed(hz),
        ChipFamily::Ap101 => emu_ap101::Ap101::new(image).boxed(hz),
    };
    let mut scope = NameScope::new(chip);
    scope.symbols = image.symbols.clone();
    scope.lines = image.lines.clone();
    let clock = CycleClock { hz, clocks_per_cycle: machine.clocks_per_cycle() };
    DebugSession::new(machine, scope, SessionOptions { clock, max_copy_bytes: 64 << 20, follower: None })
}

/// Starts a server for one client, or with `persist` for one client after another. Returns its address, and a
/// handle for its last message. `log` gets the server's events.
pub fn serving(
    chip: &'static Chip,
    image: Image,
    persist: bool,
    mut log: impl FnMut(&str) + Send + 'static,
) -> (SocketAddr, JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port of this machine");
    let address = listener.local_addr().expect("its address");
    let thread = std::thread::spawn(move || {
        let mut session = session(chip, &image);
        let options = emu_gdb::GdbOptions { persist, monitor: None };
        let ended = emu_gdb::serve(&mut session, &listener, options, &mut log);
        ended.expect("it listens").to_string()
    });
    (address, thread)
}
