//! The expected output of examples/avr/muldiv.c, computed with the arithmetic of the host.

/// Operands from xorshift32, and the FNV-1a hash of the results.
struct Torture {
    state: u32,
    sum: u32,
}

impl Torture {
    fn next(&mut self) -> u32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 17;
        self.state ^= self.state << 5;
        self.state
    }

    fn operand(&mut self, bits: u32) -> u64 {
        let high = u64::from(self.next());
        let low = u64::from(self.next());
        (high << 32 | low) >> (64 - bits) >> (self.next() % bits)
    }

    /// Adds the lowest `bits` of a value to the hash.
    fn add(&mut self, value: i128, bits: u32) {
        for byte in &value.to_le_bytes()[..bits as usize / 8] {
            self.sum = (self.sum ^ u32::from(*byte)).wrapping_mul(16_777_619);
        }
    }

    /// Adds products, quotients and remainders of `bits`-bit numbers. Up to 32 bits, also adds the product at
    /// twice the width.
    fn whole(&mut self, bits: u32, signed: bool, times: u32) {
        for _ in 0..times {
            let (mut a, mut b) = (self.operand(bits) as i128, self.operand(bits) as i128);
            if signed {
                a = if self.next() & 1 == 1 { -a } else { a };
                b = if self.next() & 1 == 1 { -b } else { b };
                // Limit the operands to the range of C's type of that size.
                (a, b) = (a << (128 - bits) >> (128 - bits), b << (128 - bits) >> (128 - bits));
            }
            self.add(a.wrapping_mul(b), bits);
            if bits < 64 {
                self.add(a * b, 2 * bits);
            }
            let least = -(1i128 << (bits - 1));
            if b != 0 && !(signed && b == -1 && a == least) {
                self.add(a / b, bits);
                self.add(a % b, bits);
            }
        }
    }

    fn real(&mut self) -> f32 {
        let mut value = (self.operand(24) as u32 | 1) as f32;
        if self.next() & 1 == 1 {
            value = -value;
        }
        for _ in 0..self.next() % 24 {
            value /= 2.0;
        }
        value
    }

    fn floats(&mut self, times: u32) {
        for _ in 0..times {
            let (a, b) = (self.real(), self.real());
            for result in [a * b, a / b, a + b, a - b] {
                self.add(i128::from(result.to_bits()), 32);
            }
            self.add(a as i128, 32);
        }
    }
}

/// Returns all lines of the output.
pub fn text() -> String {
    let mut torture = Torture { state: 2_463_534_242, sum: 0 };
    let mut out = String::new();
    for (bits, times) in [(8, 500), (16, 500), (32, 300), (64, 200)] {
        for signed in [false, true] {
            torture.sum = 2_166_136_261;
            torture.whole(bits, signed, times);
            out += &format!("{:<3} {:08x}\n", format!("{}{bits}", if signed { 'i' } else { 'u' }), torture.sum);
        }
    }
    torture.sum = 2_166_136_261;
    torture.floats(300);
    out + &format!("f32 {:08x}\n", torture.sum)
}
