//! A model of the I2C slave as a history: all bits since Start, and the meaning of the complete bytes.

use emu_pic16::periph::map::InterruptFlag;

use crate::model::Chip;

#[derive(Clone, Copy, PartialEq)]
enum Byte {
    Address,
    LowAddress,
    In,
    Out,
}

#[derive(Default)]
pub struct Slave {
    /// Levels of SDA at the rising edges of SCL since Start; None if there was no Start, or another device is
    /// addressed.
    bits: Option<Vec<bool>>,
    /// Meaning of the current byte.
    kind: Option<Byte>,
    /// True if this slave acknowledges in the ninth clock.
    acks: bool,
    /// Bits to send, the most significant one first.
    out: Vec<bool>,
    sending: bool,
    /// True if the complete 10-bit address has matched.
    ten: bool,
    needs_add: bool,
}

fn value(bits: &[bool]) -> u8 {
    bits.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit))
}

impl Slave {
    pub fn sending(&self) -> bool {
        self.sending
    }

    pub fn condition(&mut self, chip: &mut Chip, start: bool) {
        let ten = self.ten && start;
        *self = Slave { ten, ..Slave::default() };
        if start {
            (self.bits, self.kind) = (Some(Vec::new()), Some(Byte::Address));
        }
        chip.rw = false;
        chip.pull_sda = false;
    }

    pub fn clock(&mut self, chip: &mut Chip, t: u64) {
        if let (Some(bits), Some(kind)) = (&mut self.bits, self.kind) {
            if chip.scl {
                bits.push(chip.sda);
                if bits.len() % 9 == 0 && kind == Byte::Out && chip.rw {
                    chip.rw = !chip.sda;
                }
            } else if !bits.is_empty() {
                let (byte, clocks) = ((bits.len() - 1) / 9, (bits.len() - 1) % 9 + 1);
                let bits = bits[byte * 9..].to_vec();
                match (kind, clocks) {
                    (_, 9) => self.after_ninth(chip, kind, t),
                    (Byte::Out, 8) => {
                        (chip.bf, chip.da) = (false, true);
                        self.sending = false;
                        chip.pull_sda = false;
                    }
                    (Byte::Out, n) => chip.pull_sda = !self.out[n],
                    (_, 8) => self.after_eighth(chip, kind, &bits[..8]),
                    _ => {}
                }
            }
        }
        if !chip.scl {
            self.hold(chip);
        }
    }

    /// Handles the end of the eighth bit.
    fn after_eighth(&mut self, chip: &mut Chip, kind: Byte, bits: &[bool]) {
        let seven = matches!(chip.con & 15, 6 | 14);
        let (byte, read) = (value(bits), bits[7]);
        let same_upper = value(&bits[..7]) == chip.add >> 1;
        let call = kind == Byte::Address && byte == 0 && chip.mssp && chip.con2 & 0x80 != 0;
        let ours = match kind {
            Byte::Address if call => true,
            Byte::Address if seven || !read => same_upper,
            Byte::Address => same_upper && self.ten,
            Byte::LowAddress => byte == chip.add,
            _ => true,
        };
        if !ours {
            *self = Slave::default();
            return;
        }
        let asks = kind == Byte::Address && read;
        let (bf, ov) = (chip.bf, chip.sspov());
        chip.da = kind == Byte::In;
        if kind == Byte::Address {
            chip.rw = read;
        }
        // Table 9-2 of DS30292 and, for the basic SSP, table 10-2 of DS39598.
        let loads = match (bf, ov) {
            (false, false) => true,
            (true, _) => false,
            (false, true) => chip.mssp,
        };
        self.acks = !bf && !ov;
        if loads {
            chip.buf = byte;
            chip.bf = !asks;
        }
        if bf {
            chip.set_sspov();
        }
        chip.pull_sda = self.acks;
        let half = kind == Byte::Address && !seven && !read && !call;
        if half || kind == Byte::Address && !read {
            self.ten = false;
        }
        if kind == Byte::LowAddress {
            self.ten = self.acks;
        }
        if self.acks && (half || kind == Byte::LowAddress) {
            chip.ua = true;
        }
        self.kind = Some(match kind {
            Byte::Address if half => Byte::LowAddress,
            Byte::Address if read => Byte::Out,
            _ => Byte::In,
        });
        self.out = bits.to_vec();
    }

    /// Handles the end of the acknowledge.
    fn after_ninth(&mut self, chip: &mut Chip, kind: Byte, t: u64) {
        chip.flag(InterruptFlag::SSPIF, t);
        chip.pull_sda = false;
        self.needs_add = chip.ua;
        let whole = self.bits.as_ref().map_or(0, Vec::len) / 9;
        if kind == Byte::Out {
            let refused = if whole == 1 { !self.acks || !chip.rw } else { !chip.rw };
            if refused {
                *self = Slave { ten: self.ten, needs_add: self.needs_add, ..Slave::default() };
            } else if chip.bf {
                chip.pull_sda = !self.out[0];
            } else {
                chip.set_ckp(false);
            }
        } else if chip.stretch && chip.con2 & 1 != 0 && chip.bf && self.acks && !chip.ua {
            chip.set_ckp(false);
        }
    }

    fn between_bytes(&self) -> bool {
        self.bits.as_ref().is_some_and(|bits| bits.len() % 9 == 0)
    }

    /// Loads data for a read: between the address match and the end of the byte before.
    pub fn load(&mut self, chip: &mut Chip) {
        let refused = !self.acks && self.bits.as_ref().is_some_and(|bits| bits.len() <= 9);
        if self.kind != Some(Byte::Out) || refused || !chip.rw {
            return;
        }
        self.out = (0..8).rev().map(|bit| chip.buf >> bit & 1 == 1).collect();
        self.sending = true;
        chip.bf = true;
        if self.between_bytes() && !chip.scl {
            chip.pull_sda = !self.out[0];
        }
    }

    pub fn address(&mut self, chip: &mut Chip) {
        let clocks = self.bits.as_ref().map_or(0, Vec::len);
        let ninth = clocks % 9 == 8 || clocks > 0 && clocks.is_multiple_of(9) && chip.scl;
        if !ninth {
            self.needs_add = false;
            chip.ua = false;
            self.hold(chip);
        }
    }

    /// Section 9.4.4.5: the clock is held from when another device has made it low.
    pub fn hold(&mut self, chip: &mut Chip) {
        let wanted = !chip.ckp() || self.needs_add;
        if wanted && !chip.scl {
            chip.pull_scl = true;
        } else if !wanted && chip.pull_scl {
            chip.pull_scl = false;
            if self.kind == Some(Byte::Out) && self.between_bytes() {
                self.sending = true;
                chip.pull_sda = !self.out[0];
            }
        }
    }
}
