//! A model of the port as the user's manual draws it: shift registers with marker bits, and counters. It has
//! one method per tick.

use emu_core::NEVER;

#[derive(Debug, Clone, Default)]
pub struct Model {
    pub scon: u8,
    pub sbuf: u8,
    pub ti_at: Option<u64>,
    pub ri_at: Option<u64>,
    /// Bytes sent, each with the cycle in which its stop bit ended.
    pub sent: Vec<(u64, u8)>,
    /// Statistics: bytes sent in each mode, bytes received in mode 0, frames lost.
    pub sent_in: [u32; 4],
    pub received_in_0: u32,
    pub lost: u32,
    /// TXD and RXD (as output) at the 12 clocks of the cycle.
    pub txd: [bool; 12],
    pub rxd: [bool; 12],
    /// TXD of modes 1 to 3 from the next cycle on.
    mark: bool,

    tx_divider: u32,
    tx_request: bool,
    tx_send: bool,
    tx_data: bool,
    /// Set after the first shift pulse, which shifts in the stop bit if there are nine data bits.
    tx_shifted: bool,
    tx_register: u32,
    tx_byte: u8,
    tx_stop: Option<u8>,

    rx_divider: u32,
    rx_busy: bool,
    rx_rest: bool,
    rx_start: bool,
    rx_samples: Vec<bool>,
    rx_register: u32,
    rx_last: bool,

    /// Cycles since the write to SBUF in mode 0, and since the start of a reception.
    send_cycles: Option<u32>,
    receive_cycles: Option<u32>,
    out_register: u32,
    in_register: u32,
}

/// The bits of a byte in reverse order: the first bit received is leftmost.
fn mirror(v: u32) -> u8 {
    (v as u8).reverse_bits()
}

impl Model {
    pub fn new() -> Model {
        Model { mark: true, rx_last: true, txd: [true; 12], rxd: [true; 12], ..Model::default() }
    }

    fn bit(&self, n: u8) -> bool {
        self.scon >> n & 1 == 1
    }

    fn mode(&self) -> u8 {
        self.scon >> 6
    }

    pub fn since(&self) -> u64 {
        self.ti_at.unwrap_or(NEVER).min(self.ri_at.unwrap_or(NEVER))
    }

    fn set_ti(&mut self, cycle: u64) {
        self.scon |= 2;
        self.ti_at.get_or_insert(cycle);
    }

    fn set_ri(&mut self, cycle: u64) {
        self.scon |= 1;
        self.ri_at.get_or_insert(cycle);
    }

    /// Executes S1P1 to S5P2 of a machine cycle for the pins and for mode 0; `rxd` is driven from outside.
    pub fn cycle(&mut self, cycle: u64, rxd: bool) {
        for count in [&mut self.send_cycles, &mut self.receive_cycles].into_iter().flatten() {
            *count += 1;
        }
        if self.send_cycles == Some(10) {
            self.send_cycles = None;
            self.set_ti(cycle);
            self.sent_in[0] += 1;
            self.sent.push((cycle, self.tx_byte));
        }
        if self.receive_cycles == Some(10) {
            self.receive_cycles = None;
            self.received_in_0 += 1;
            self.sbuf = mirror(self.in_register);
            self.set_ri(cycle);
        }
        let send = self.send_cycles.is_some_and(|n| n >= 2);
        let receive = self.receive_cycles.is_some_and(|n| n >= 2);
        for clock in 0..12 {
            let state = clock / 2 + 1;
            let shift_clock = !(3..=5).contains(&state);
            self.txd[clock] = self.mark && (shift_clock || !(send || receive));
            self.rxd[clock] = !send || self.out_register & 1 == 1;
        }
        let pin = rxd && self.rxd[9];
        if self.receive_cycles == Some(2) {
            self.in_register = 0b1111_1110;
        }
        // The shifts of S6P2 are visible on the pins from the next cycle on.
        if send {
            self.out_register >>= 1;
        }
        if receive {
            self.in_register = (self.in_register << 1 | u32::from(pin)) & 0xFF;
        }
    }

    pub fn tx_tick(&mut self, cycle: u64) {
        self.tx_divider = (self.tx_divider + 1) % 16;
        if self.tx_divider != 0 {
            return;
        }
        if let Some(byte) = self.tx_stop.take() {
            self.sent_in[usize::from(self.mode())] += 1;
            self.sent.push((cycle, byte));
        }
        if self.tx_request {
            self.tx_request = false;
            self.tx_send = true;
            self.tx_data = false;
            self.tx_shifted = false;
        } else if self.tx_send && !self.tx_data {
            self.tx_data = true;
        } else if self.tx_send {
            // The last shift is reached when the marker is directly left of the output bit and all bits left
            // of the marker are zero.
            let nine = self.mode() != 1;
            let last = self.tx_register >> 2 == 0 && (self.tx_shifted || !nine);
            self.tx_register >>= 1;
            if nine && !self.tx_shifted {
                self.tx_register |= 1 << 8;
            }
            self.tx_shifted = true;
            if last {
                self.tx_send = false;
                self.tx_stop = Some(self.tx_byte);
                self.set_ti(cycle);
            }
        }
        self.mark = !self.tx_send || self.tx_data && self.tx_register & 1 == 1;
    }

    pub fn rx_tick(&mut self, cycle: u64, rxd: bool) {
        let fell = self.rx_last && !rxd;
        self.rx_last = rxd;
        if !self.rx_busy {
            if fell && self.bit(4) && self.mode() != 0 {
                self.rx_busy = true;
                self.rx_start = true;
                self.rx_rest = false;
                self.rx_divider = 0;
                self.rx_samples.clear();
                self.rx_register = 0x1FF;
            }
            return;
        }
        self.rx_divider = (self.rx_divider + 1) % 16;
        if ![7, 8, 9].contains(&self.rx_divider) {
            return;
        }
        self.rx_samples.push(rxd);
        if self.rx_divider != 9 {
            return;
        }
        let bit = self.rx_samples.drain(..).filter(|&high| high).count() > 1;
        if self.rx_rest || self.rx_start && bit {
            self.rx_busy = false;
            return;
        }
        self.rx_start = false;
        // The start bit has reached the leftmost position: one last shift.
        let last = self.rx_register & 0x100 == 0;
        self.rx_register = (self.rx_register << 1 | u32::from(bit)) & 0x1FF;
        if last {
            if !self.bit(0) && (!self.bit(5) || bit) {
                self.sbuf = mirror(self.rx_register >> 1);
                self.scon = self.scon & !4 | u8::from(bit) << 2;
                self.set_ri(cycle);
            } else {
                self.lost += 1;
            }
            self.rx_rest = true;
            self.rx_busy = self.mode() != 1;
        }
    }

    pub fn write_sbuf(&mut self, v: u8) {
        if self.mode() == 0 {
            self.send_cycles = Some(0);
            self.out_register = u32::from(v) | 0x100;
            self.tx_byte = v;
            return;
        }
        let ninth = if self.mode() == 1 { 1 } else { u32::from(self.bit(3)) };
        self.tx_register = u32::from(v) | ninth << 8;
        self.tx_byte = v;
        self.tx_request = true;
    }

    pub fn write_scon(&mut self, v: u8, cycle: u64) {
        if v >> 6 != self.mode() {
            if let Some(byte) = self.tx_stop.take() {
                self.sent.push((cycle, byte));
            }
            (self.tx_request, self.tx_send, self.mark) = (false, false, true);
            self.rx_busy = false;
            (self.send_cycles, self.receive_cycles) = (None, None);
        }
        self.scon = v;
        if !self.bit(4) {
            self.rx_busy = false;
            self.receive_cycles = None;
        }
        for (n, at) in [&mut self.ri_at, &mut self.ti_at].into_iter().enumerate() {
            *at = if v >> n & 1 == 1 { at.or(Some(cycle + 1)) } else { None };
        }
        if self.mode() == 0 && self.bit(4) && !self.bit(0) && self.receive_cycles.is_none() {
            self.receive_cycles = Some(0);
        }
    }

    /// Whether something is written and not yet sent.
    pub fn busy(&self) -> bool {
        self.tx_request || self.tx_send || self.tx_stop.is_some() || self.send_cycles.is_some()
    }

    pub fn receiving(&self) -> bool {
        self.rx_busy || self.receive_cycles.is_some()
    }

    /// Whether a stop bit is on the line.
    pub fn stopping(&self) -> bool {
        self.tx_stop.is_some()
    }

    /// Whether mode 0 is transferring.
    pub fn shifting(&self) -> bool {
        self.send_cycles.is_some() || self.receive_cycles.is_some()
    }
}
