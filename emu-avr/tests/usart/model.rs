//! A model of the port that steps cycle by cycle: counters, shift registers and flip-flops that all react to
//! every clock edge.

use std::collections::VecDeque;

use emu_avr::periph::usart::UsartRegister;
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal};

#[derive(Clone, Copy)]
struct Word {
    byte: u8,
    rxb8: bool,
    fe: bool,
    dor: bool,
    upe: bool,
}

/// A frame being received: its format and the bits so far, the start bit first.
struct Frame {
    size: usize,
    parity: u8,
    bits: Vec<bool>,
}

pub struct Model {
    pub out: Vec<AvrSignal>,
    // Pins, and the flip-flops of XCK.
    pub rxd: bool,
    pub xck: bool,
    pub ddr_xck: bool,
    first: bool,
    second: bool,
    // Registers.
    txc: bool,
    txc_now: bool,
    u2x: bool,
    mpcm: bool,
    ucsrb: u8,
    ucsrc: u8,
    ubrr: u16,
    // Baud rate generator: down-counter, divider.
    down: u16,
    divider: u32,
    // Transmitter.
    buffer: Option<(u8, bool)>,
    shifting: Option<(u8, VecDeque<bool>)>,
    on_line: bool,
    txd: bool,
    // Receiver.
    last_sample: bool,
    frame: Option<Frame>,
    votes: Vec<bool>,
    skip: u32,
    spi_bits: Vec<bool>,
    fifo: VecDeque<Word>,
    waiting: Option<Word>,
    lost: bool,
    shown: (u8, bool),
    drives: [AvrDrive; 3],
}

impl Model {
    pub fn new() -> Model {
        Model {
            out: Vec::new(),
            rxd: false,
            xck: false,
            ddr_xck: false,
            first: false,
            second: false,
            txc: false,
            txc_now: false,
            u2x: false,
            mpcm: false,
            ucsrb: 0,
            ucsrc: 6,
            ubrr: 0,
            down: 0,
            divider: 0,
            buffer: None,
            shifting: None,
            on_line: false,
            txd: true,
            last_sample: false,
            frame: None,
            votes: Vec::new(),
            skip: 0,
            spi_bits: vec![false; 8],
            fifo: VecDeque::new(),
            waiting: None,
            lost: false,
            shown: (0, false),
            drives: [AvrDrive::Port; 3],
        }
    }

    fn umsel(&self) -> u8 {
        if self.ucsrc >> 6 == 2 { 0 } else { self.ucsrc >> 6 }
    }

    fn rxen(&self) -> bool {
        self.ucsrb & 0x10 != 0
    }

    fn txen(&self) -> bool {
        self.ucsrb & 0x08 != 0
    }

    fn per_bit(&self) -> u32 {
        if self.u2x { 8 } else { 16 }
    }

    fn size(&self) -> usize {
        match (self.ucsrb & 4 != 0, self.ucsrc >> 1 & 3) {
            (true, 3) => 9,
            (_, n) => 5 + usize::from(n),
        }
    }

    /// Executes one clock edge. Pins are as they were in the cycle that ends.
    pub fn tick(&mut self, t: u64) {
        self.txc_now = false;
        let edge = (self.first != self.second).then_some(self.first);
        (self.second, self.first) = (self.first, self.xck);
        let mut ticked = false;
        if self.down == 0 {
            self.down = self.ubrr;
            self.divider += 1;
            ticked = true;
        } else {
            self.down -= 1;
        }
        let umsel = self.umsel();
        if umsel == 0 {
            if ticked {
                self.sample_async();
                if self.divider.is_multiple_of(self.per_bit()) {
                    self.next_bit(t);
                }
            }
        } else if self.ddr_xck {
            // The generator clocks half bits; in SPI mode only while there is something to send.
            if ticked && (umsel == 1 || self.shifting.is_some()) {
                if self.divider.is_multiple_of(2) { self.next_bit(t) } else { self.sample_clocked() }
            }
        } else if let Some(level) = edge {
            let ucpol = self.ucsrc & 1 != 0;
            let rising_changes = if umsel == 1 { !ucpol } else { (self.ucsrc & 2 != 0) != ucpol };
            if level == rising_changes { self.next_bit(t) } else { self.sample_clocked() }
        }
        self.pins(t);
    }

    // Transmitter.

    fn load(&mut self) {
        let Some((byte, ninth)) = self.buffer.take() else { return };
        let mut bits = VecDeque::new();
        if self.umsel() == 3 {
            for n in 0..8 {
                bits.push_back(byte >> if self.ucsrc & 4 != 0 { n } else { 7 - n } & 1 == 1);
            }
        } else {
            bits.push_back(false);
            let mut ones = 0;
            for n in 0..self.size() {
                let bit = if n == 8 { ninth } else { byte >> n & 1 == 1 };
                ones += u32::from(bit);
                bits.push_back(bit);
            }
            match self.ucsrc >> 4 & 3 {
                2 => bits.push_back(ones % 2 == 1),
                3 => bits.push_back(ones % 2 == 0),
                _ => {}
            }
            bits.push_back(true);
            if self.ucsrc & 8 != 0 {
                bits.push_back(true);
            }
        }
        let mask = if self.umsel() == 3 || self.size() > 7 { 0xFF } else { 0xFF >> (8 - self.size()) };
        self.shifting = Some((byte & mask, bits));
        self.on_line = false;
    }

    fn next_bit(&mut self, t: u64) {
        let spi = self.umsel() == 3;
        let Some((byte, bits)) = &mut self.shifting else { return };
        if bits.is_empty() {
            if !spi {
                self.out.push(AvrSignal::Sent { t, byte: *byte });
            }
            self.shifting = None;
            self.on_line = false;
            if self.buffer.is_none() {
                (self.txc, self.txc_now) = (true, true);
                self.txd |= !spi;
                return;
            }
            self.load();
        }
        if let Some(bit) = self.shifting.as_mut().and_then(|(_, bits)| bits.pop_front()) {
            self.txd = bit;
            self.on_line = true;
        }
    }

    // Receiver.

    fn sample_async(&mut self) {
        if !self.rxen() {
            return;
        }
        let high = self.rxd;
        if self.frame.is_none() {
            if self.last_sample && !high {
                self.begin();
                // After sample 1 come samples 2 to 7 (or 2 and 3), then those that vote.
                self.skip = if self.u2x { 2 } else { 6 };
                self.votes.clear();
            }
            self.last_sample = high;
            return;
        }
        if self.skip > 0 {
            self.skip -= 1;
            return;
        }
        self.votes.push(high);
        if self.votes.len() == 3 {
            let ones = self.votes.iter().filter(|&&vote| vote).count();
            self.votes.clear();
            self.skip = self.per_bit() - 3;
            self.last_sample = ones >= 2;
            self.bit(ones >= 2);
        }
    }

    fn begin(&mut self) {
        self.frame = Some(Frame { size: self.size(), parity: self.ucsrc >> 4 & 3, bits: Vec::new() });
    }

    fn sample_clocked(&mut self) {
        let high = self.rxd;
        if self.umsel() == 3 {
            if self.on_line && self.rxen() {
                self.spi_bits.push(high);
                self.waiting = None;
                if self.shifting.as_ref().is_some_and(|(_, bits)| bits.is_empty()) {
                    let last = &self.spi_bits[self.spi_bits.len() - 8..];
                    let byte = last
                        .iter()
                        .enumerate()
                        .fold(0, |byte, (n, &bit)| byte | u8::from(bit) << if self.ucsrc & 4 != 0 { n } else { 7 - n });
                    self.arrive(Word { byte, rxb8: false, fe: false, dor: false, upe: false });
                }
            }
            return;
        }
        if self.rxen() {
            let fell = self.last_sample && !high;
            self.last_sample = high;
            if self.frame.is_none() && fell {
                self.begin();
            }
            if self.frame.is_some() {
                self.bit(high);
            }
        }
    }

    /// Processes a bit of a frame.
    fn bit(&mut self, high: bool) {
        let Some(frame) = &mut self.frame else { return };
        frame.bits.push(high);
        let with_parity = usize::from(frame.parity >= 2);
        if frame.bits.len() == 1 {
            if high {
                self.frame = None;
            } else if self.waiting.take().is_some() {
                self.lost = true;
            }
        } else if frame.bits.len() == 1 + frame.size + with_parity + 1 {
            let data = &frame.bits[1..1 + frame.size];
            let ones = data.iter().filter(|&&bit| bit).count() + usize::from(frame.parity == 3);
            let upe = with_parity == 1 && frame.bits[1 + frame.size] != (ones % 2 == 1);
            let byte = data.iter().take(8).rev().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
            let rxb8 = data.get(8).is_some_and(|&bit| bit);
            let address = if frame.size == 9 { rxb8 } else { high };
            self.frame = None;
            if address || !self.mpcm {
                let dor = std::mem::take(&mut self.lost);
                self.arrive(Word { byte, rxb8, fe: !high, dor, upe });
            }
        }
    }

    fn arrive(&mut self, word: Word) {
        let word = Word { dor: word.dor || std::mem::take(&mut self.lost), ..word };
        if self.fifo.len() < 2 {
            self.fifo.push_back(word)
        } else {
            self.waiting = Some(word)
        }
        self.show();
    }

    fn show(&mut self) {
        if let Some(word) = self.fifo.front() {
            self.shown = (word.byte, word.rxb8);
        }
    }

    fn stop_receiver(&mut self) {
        (self.last_sample, self.frame) = (false, None);
        self.spi_bits = vec![false; 8];
    }

    // Inputs from the chip.

    pub fn line(&mut self, line: AvrLine, high: bool) {
        match line {
            AvrLine::Rxd => self.rxd = high,
            _ => self.xck = high,
        }
    }

    pub fn direction(&mut self, output: bool, t: u64) {
        let changed = self.ddr_xck != output;
        self.ddr_xck = output;
        if changed && self.umsel() != 0 {
            self.stop_receiver();
        }
        self.pins(t);
    }

    pub fn peek(&self, reg: UsartRegister) -> u8 {
        match reg {
            UsartRegister::UDR => self.shown.0,
            UsartRegister::UCSRA => {
                let errors = self.fifo.front().filter(|_| self.umsel() != 3);
                let error = |which: fn(&Word) -> bool| errors.is_some_and(which);
                let bits = [
                    !self.fifo.is_empty(),
                    self.txc,
                    self.buffer.is_none(),
                    error(|word| word.fe),
                    error(|word| word.dor),
                    error(|word| word.upe),
                    self.u2x,
                    self.mpcm,
                ];
                bits.into_iter().fold(0, |byte, bit| byte << 1 | u8::from(bit))
            }
            UsartRegister::UCSRB => self.ucsrb & !2 | u8::from(self.shown.1) << 1,
            UsartRegister::UCSRC => self.ucsrc,
            UsartRegister::UBRRL => self.ubrr as u8,
            UsartRegister::UBRRH => (self.ubrr >> 8) as u8,
        }
    }

    pub fn sending(&self) -> bool {
        self.shifting.is_some() || self.txen() && self.buffer.is_some()
    }

    pub fn requests(&self) -> u8 {
        let asked = self.peek(UsartRegister::UCSRA) & self.ucsrb;
        [7, 5, 6].iter().rev().fold(0, |all, bit| all << 1 | asked >> bit & 1)
    }

    pub fn read_udr(&mut self) -> u8 {
        let byte = self.shown.0;
        self.fifo.pop_front();
        if let Some(word) = self.waiting.take() {
            self.fifo.push_back(word);
        }
        self.show();
        byte
    }

    pub fn taken(&mut self) {
        self.txc = false;
    }

    pub fn write(&mut self, reg: UsartRegister, value: u8, mask: u8, t: u64) {
        let mixed = self.peek(reg) & !mask | value & mask;
        match reg {
            UsartRegister::UDR if self.buffer.is_none() => self.buffer = Some((value & mask, self.ucsrb & 1 != 0)),
            UsartRegister::UDR => {}
            UsartRegister::UCSRA => {
                if value & mask & 0x40 != 0 && !self.txc_now {
                    self.txc = false;
                }
                (self.u2x, self.mpcm) = (mixed & 2 != 0, mixed & 1 != 0);
            }
            UsartRegister::UCSRB => {
                let was = self.rxen();
                self.ucsrb = mixed & !2;
                if was != self.rxen() {
                    self.stop_receiver();
                }
                if was && !self.rxen() {
                    (self.waiting, self.lost) = (None, false);
                    self.fifo.clear();
                }
            }
            UsartRegister::UCSRC => {
                let was = self.umsel();
                self.ucsrc = mixed;
                if was != self.umsel() {
                    self.stop_receiver();
                    if !self.on_line && self.umsel() != 3 {
                        self.txd = true;
                    }
                }
            }
            UsartRegister::UBRRL => {
                self.ubrr = self.ubrr & 0xF00 | u16::from(mixed);
                let gives = self.ddr_xck && (self.umsel() == 1 || self.umsel() == 3 && self.shifting.is_some());
                let cut = gives && self.divider % 2 == 1;
                (self.down, self.divider) = (self.ubrr, 0);
                if cut {
                    self.next_bit(t);
                }
            }
            UsartRegister::UBRRH => self.ubrr = self.ubrr & 0xFF | u16::from(mixed & 15) << 8,
        }
        if self.txen() && self.shifting.is_none() {
            self.load();
        }
        self.pins(t);
    }

    pub fn reset(&mut self, t: u64) {
        let wires = (self.rxd, self.xck, self.ddr_xck, self.first, self.second);
        let (out, drives) = (std::mem::take(&mut self.out), self.drives);
        *self = Model { out, drives, ..Model::new() };
        (self.rxd, self.xck, self.ddr_xck, self.first, self.second) = wires;
        self.pins(t);
    }

    fn pins(&mut self, t: u64) {
        let umsel = self.umsel();
        let txd = if self.txen() || self.shifting.is_some() { AvrDrive::Output(self.txd) } else { AvrDrive::Port };
        let rxd = if self.rxen() { AvrDrive::Input } else { AvrDrive::Port };
        let changes = self.divider.is_multiple_of(2);
        let (ucpha, ucpol) = (self.ucsrc & 2 != 0, self.ucsrc & 1 != 0);
        let xck = match umsel {
            _ if !self.ddr_xck || umsel == 0 => AvrDrive::Port,
            1 => AvrDrive::Value(changes != ucpol),
            _ if !self.on_line => AvrDrive::Value(ucpol),
            _ if ucpha => AvrDrive::Value(changes != ucpol),
            _ => AvrDrive::Value(changes == ucpol),
        };
        for (n, (line, drive)) in
            [(AvrLine::Txd, txd), (AvrLine::Rxd, rxd), (AvrLine::Xck, xck)].into_iter().enumerate()
        {
            if self.drives[n] != drive {
                self.drives[n] = drive;
                self.out.push(AvrSignal::Drive { t, line, drive });
            }
        }
    }
}
