//! [`Device`], a peripheral of a chip, and [`Scheduler`], which knows when each of them is due.
//!
//! Nothing is called in every cycle. A device computes its state at a given time `t`, and the time of its
//! next event. The chip chooses the unit of time: machine cycles on AVR and 8051, oscillator clocks on PIC16.
//! What a device does outside itself, it leaves as signals in an [`Outbox`], and the chip carries them out
//! ([`SignalReceiver`]). So no device knows another one, a pin, an address or a chip.

use crate::cpu::NEVER;

/// The list in which devices leave their signals. Signals of one device are in order of time.
pub type Outbox<S> = Vec<S>;

/// An effect of a device outside itself; the devices of a family share one type of signals.
pub trait DeviceSignal {
    /// A line between a device and a pin.
    type Line;
}

/// A peripheral of a chip. Calls are in order of time; `t` never decreases.
pub trait Device<S: DeviceSignal> {
    /// Registers, by their names without the number of the device (UCSRA for UCSR0A and UCSR1A).
    type Reg: Copy;

    /// Executes everything that is due at or before `t`. Repeated calls have no further effect.
    fn run_due(&mut self, t: u64, out: &mut Outbox<S>) {
        let _ = (t, out);
    }
    /// Returns the time at which [`Device::run_due`] next has an effect outside the device (an enabled
    /// interrupt, a flag of the chip, a line, a signal), if no register is written and no line changes
    /// before; [`NEVER`] if there is none.
    fn next_deadline(&self) -> u64 {
        NEVER
    }
    /// Returns the requested interrupts, with flag and enable both set; call `run_due` first. Bit `n` is
    /// interrupt `n` of the device, in the order of the vectors. A device whose flags are in registers of the
    /// chip requests none.
    fn interrupt_requests(&self) -> u8 {
        0
    }
    /// Handles the entry of the interrupt `irq` at the edge `t`: clears the flag, if the hardware does so.
    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut Outbox<S>) {
        let _ = (irq, t, out);
    }
    /// Reads a register as an instruction does at `t`, with side effects. Everything due at `t` has been
    /// done.
    fn read(&mut self, reg: Self::Reg, t: u64, out: &mut Outbox<S>) -> u8 {
        let _ = out;
        self.peek(reg, t)
    }
    /// Returns the value that a read at `t` would give, without side effects.
    fn peek(&self, reg: Self::Reg, t: u64) -> u8;
    /// Writes the bits in `mask` at the edge `t`, which ends the cycle of the write. `mask` is FFh except for
    /// instructions that write single bits. Everything due before `t` has been done; the device does what is
    /// due at `t` first.
    fn write(&mut self, reg: Self::Reg, value: u8, mask: u8, t: u64, out: &mut Outbox<S>);
    /// Handles a change of a line's level at the edge `t`, from inside or outside the chip. Everything due at
    /// `t` has been done.
    fn on_line_changed(&mut self, line: S::Line, high: bool, t: u64, out: &mut Outbox<S>) {
        let _ = (line, high, t, out);
    }
    /// Handles a change of the direction bit of a line's pin at the edge `t`; initially all pins are inputs.
    /// It matters for DDR_XCK, which selects the clock source, and for SS, which as an output does not select
    /// the SPI.
    fn on_direction_changed(&mut self, line: S::Line, output: bool, t: u64, out: &mut Outbox<S>) {
        let _ = (line, output, t, out);
    }
    /// Sets the registers to their initial values at `t`. `power_on` says that the supply was lost, after
    /// which some registers of PIC16 have other values.
    fn reset(&mut self, power_on: bool, t: u64, out: &mut Outbox<S>);
    /// Stops the clock of the device at `t`. Everything due at `t` has been done. While it is stopped, only
    /// events that do not need it are due; by default none needs it.
    fn stop_clock(&mut self, t: u64, out: &mut Outbox<S>) {
        self.run_due(t, out);
    }
    /// Restarts the clock at `t`; the device continues from its stopped state. A reset in the cycle that
    /// stops the clock restarts it one edge before it stops: `t` may be one below that of `stop_clock`.
    fn restart_clock(&mut self, t: u64, out: &mut Outbox<S>) {
        self.run_due(t, out);
    }
    /// Sets the clock of the chip to `hz` Hz from `t` on, initially and when the program changes it, for a
    /// device on another oscillator.
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        let _ = (hz, t);
    }
    /// Returns the time up to which a read of `reg` gives the same value as at `t`, without side effects, if
    /// nothing is written and no line changes; `t` itself if nothing is guaranteed.
    fn steady_until(&self, reg: Self::Reg, t: u64) -> u64 {
        let _ = reg;
        t
    }
}

/// When each of the `N` devices of a chip is due, which interrupts it requests, and when the chip is due.
/// Only devices that were touched are asked again. All of it is derived from the devices, so it is not saved.
#[derive(Debug, Clone)]
pub struct Scheduler<const N: usize> {
    /// The time of the next event of the chip, or [`NEVER`].
    pub due: u64,
    /// The time of each device's next event, except for touched devices.
    pub deadlines: [u64; N],
    /// The interrupts that each device requests, except for touched devices.
    pub requests: [u8; N],
    /// Mask of the devices that were accessed since they were asked, so that their deadlines and requests may
    /// have changed.
    pub touched: u32,
}

impl<const N: usize> Scheduler<N> {
    /// Nothing is due, and all devices are touched.
    pub const START: Scheduler<N> =
        Scheduler { due: NEVER, deadlines: [NEVER; N], requests: [0; N], touched: (1 << N) - 1 };

    /// Records that a device is accessed.
    #[inline(always)]
    pub const fn touch(&mut self, number: usize) {
        self.touched |= 1 << number;
    }

    /// Records that all devices are accessed.
    pub const fn touch_all(&mut self) {
        self.touched = Self::START.touched;
    }

    /// Removes and returns the first touched device.
    #[inline(always)]
    pub const fn take_touched(&mut self) -> Option<usize> {
        if self.touched == 0 {
            return None;
        }
        let number = self.touched.trailing_zeros() as usize;
        self.touched &= self.touched - 1;
        Some(number)
    }

    /// Asks a touched device for its deadline and requests.
    #[inline(always)]
    pub fn ask<S: DeviceSignal>(&mut self, number: usize, device: &impl Device<S>) {
        (self.deadlines[number], self.requests[number]) = (device.next_deadline(), device.interrupt_requests());
    }

    /// Computes the next event of the chip, after all touched devices were asked. `other` is the next event
    /// outside of the devices.
    #[inline(always)]
    pub fn update_due(&mut self, other: u64) {
        self.touched = 0;
        self.due = self.deadlines.iter().fold(other, |due, &next| due.min(next));
    }
}

/// Declares the devices of a chip: a module `unit_index` with their numbers and `COUNT`, and a macro
/// `for_each_unit!` that evaluates an expression for each of them, in this order. `for_each_unit!(chip, unit,
/// number => ..)` binds a device of `chip` and its number. The list begins with a `$`.
#[macro_export]
macro_rules! device_list {
    ($d:tt $($number:ident: $field:ident),+ $(,)?) => {
        /// Numbers of the units.
        mod unit_index {
            #[allow(clippy::upper_case_acronyms, non_camel_case_types)]
            enum Index { $($number,)+ COUNT }
            $(pub(super) const $number: usize = Index::$number as usize;)+
            /// The number of devices in the schedule.
            pub(super) const COUNT: usize = Index::COUNT as usize;
        }

        macro_rules! for_each_unit {
            ($d chip:ident, $d unit:ident => $d what:expr) => { for_each_unit!($d chip, $d unit, _number => $d what) };
            ($d chip:ident, $d unit:ident, $d index:ident => $d what:expr) => {{
                $({ let ($d unit, $d index) = (&mut $d chip.$field, unit_index::$number); $d what; })+
            }};
        }
    };
}

/// A chip that carries out the signals of its devices.
pub trait SignalReceiver {
    /// The signals.
    type Signal;
    /// The number of the device that left a signal, or `()` if a signal means the same from all devices.
    type Sender: Copy;
    /// Signals that wait; empty between calls.
    fn outbox(&mut self) -> &mut Outbox<Self::Signal>;
    /// Carries out a signal.
    fn apply_signal(&mut self, sender: Self::Sender, signal: Self::Signal);

    /// Carries out the signals that `sender` has left, and those that follow from them.
    #[inline(always)]
    fn apply_signals(&mut self, sender: Self::Sender) {
        if !self.outbox().is_empty() {
            self.apply_all_signals(sender);
        }
    }

    /// As [`SignalReceiver::apply_signals`], if there are signals.
    #[inline(never)]
    fn apply_all_signals(&mut self, sender: Self::Sender) {
        while !self.outbox().is_empty() {
            let mut signals = std::mem::take(self.outbox());
            signals.drain(..).for_each(|signal| self.apply_signal(sender, signal));
            // Keeps the allocation of the list.
            if self.outbox().is_empty() {
                *self.outbox() = signals;
                return;
            }
        }
    }
}
