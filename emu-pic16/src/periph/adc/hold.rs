//! The holding capacitor of the converter: its voltage after a time of charging.
//!
//! The model is the acquisition equation of the data sheets (DS30292 equation 11-1): the amplifier settles, a
//! temperature delay passes, then the capacitor follows its source through the resistances of source, wire
//! and switch. Once the error is half a step, the data sheet and the model regard it as charged: it then has
//! exactly the voltage of its source. All arithmetic uses integers: microvolts, and e^-x with 32 fractional
//! bits, summed from its series.

/// Constants of a converter's acquisition equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct HoldNetwork {
    /// CHOLD in femtofarads.
    pub capacity_ff: u64,
    /// RIC + RSS at 5 V in ohms.
    pub inner_ohms: u64,
    /// Amplifier settling time plus temperature delay at 50 degrees Celsius, in nanoseconds.
    pub settle_ns: u64,
    /// Time constants until the error is half a step, in millionths: ln 2047 for 10 bits, ln 511 for 8.
    pub constants_e6: u64,
}

/// The holding capacitor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct HoldCapacitor {
    network: HoldNetwork,
    hz: u64,
    /// Time constant RC in femtoseconds.
    tau_fs: u64,
    /// Clocks between connection and the start of charging.
    dead: u64,
    /// Clocks of charging until the error is half a step.
    full: u64,
    /// Voltage in microvolts when the current charging started, or the held voltage.
    microvolts: u64,
    /// Clock of the connection; None while disconnected.
    connected: Option<u64>,
    /// Clock at which the current charging starts or started.
    from: u64,
}

emu_core::state! {
    HoldCapacitor { microvolts, connected, from } stays { network, hz, tau_fs, dead, full }
    if |hold, _now| ![hold.connected, Some(hold.from)].contains(&Some(u64::MAX))
}

impl HoldCapacitor {
    /// Returns an empty, disconnected capacitor with a source of `ohms` ohms.
    pub(super) fn new(network: HoldNetwork, ohms: u32, hz: u64) -> HoldCapacitor {
        let (hz, tau_fs) = (hz.max(1), (u64::from(ohms) + network.inner_ohms) * network.capacity_ff);
        let charge_fs = u128::from(tau_fs) * u128::from(network.constants_e6) / 1_000_000;
        let settle_fs = u128::from(network.settle_ns) * 1_000_000;
        let clocks = |fs: u128| (fs * u128::from(hz)).div_ceil(SECOND_FS) as u64;
        let dead = clocks(settle_fs);
        let full = clocks(settle_fs + charge_fs) - dead;
        HoldCapacitor { network, hz, tau_fs, dead, full, microvolts: 0, connected: None, from: 0 }
    }

    /// Changes the source impedance from `t` on. `source` is the voltage of the source in microvolts, as in
    /// all functions here.
    pub(super) fn set_ohms(&mut self, ohms: u32, t: u64, source: u64) {
        self.inject_charge(t, source);
        let new = HoldCapacitor::new(self.network, ohms, self.hz);
        *self = HoldCapacitor { microvolts: self.microvolts, connected: self.connected, from: self.from, ..new };
    }

    /// Returns the voltage at `t` in microvolts.
    pub(super) fn voltage_at(&self, t: u64, source: u64) -> u64 {
        let charged = t.saturating_sub(self.from);
        if self.connected.is_none() || charged == 0 {
            return self.microvolts;
        }
        if charged >= self.full {
            return source;
        }
        let x = ((u128::from(charged) * SECOND_FS) << 32) / (u128::from(self.hz) * u128::from(self.tau_fs).max(1));
        let left = (u128::from(self.microvolts.abs_diff(source)) * u128::from(exp_neg(x as u64))) >> 32;
        if source > self.microvolts { source - left as u64 } else { source + left as u64 }
    }

    /// Restarts charging from the current voltage, because the source is about to change at `t`.
    pub(super) fn inject_charge(&mut self, t: u64, source: u64) {
        self.microvolts = self.voltage_at(t, source);
        self.from = self.from.max(t);
    }

    /// Disconnects at `t` and holds the voltage.
    pub(super) fn open(&mut self, t: u64, source: u64) {
        self.microvolts = self.voltage_at(t, source);
        self.connected = None;
    }

    /// Connects at `at`, which may be in the future. Call [`Self::open`] or [`Self::inject_charge`] first, to
    /// fix the current voltage.
    pub(super) fn connect(&mut self, at: u64) {
        self.connected = Some(at);
        self.from = at.saturating_add(self.dead);
    }

    /// Switches to another source at `t`, or at the scheduled connection if that is later.
    pub(super) fn switch(&mut self, t: u64, source: u64) {
        self.inject_charge(t, source);
        if let Some(at) = self.connected {
            self.connect(at.max(t));
        }
    }

    /// Reports whether it is connected, or will be.
    pub(super) fn is_connected(&self) -> bool {
        self.connected.is_some()
    }

    /// Reports whether, at `t`, the time of the acquisition equation has passed since the connection.
    pub(super) fn is_acquired(&self, t: u64) -> bool {
        self.connected.is_some_and(|at| t >= at.saturating_add(self.dead).saturating_add(self.full))
    }
}

/// Femtoseconds per second.
const SECOND_FS: u128 = 1_000_000_000_000_000;

/// e^-1 with 32 fractional bits.
const INVERSE_E: u128 = 1_580_030_169;

/// Returns e^-x, both with 32 fractional bits: the fraction of `x` by the series, the integer part by
/// repeated products.
fn exp_neg(x: u64) -> u64 {
    let (whole, fraction) = (x >> 32, u128::from(x & 0xFFFF_FFFF));
    let (mut term, mut plus, mut minus) = (1u128 << 32, 1u128 << 32, 0);
    for k in 1..=13u128 {
        term = ((term * fraction) >> 32) / k;
        *(if k % 2 == 1 { &mut minus } else { &mut plus }) += term;
    }
    // Beyond e^-32 the result is 0 in 32 bits.
    (0..whole.min(32)).fold(plus - minus, |left, _| (left * INVERSE_E) >> 32) as u64
}

#[cfg(test)]
mod tests {
    use super::exp_neg;

    #[test]
    fn the_series_is_e_to_the_minus_x() {
        for i in 0..4000u32 {
            let x = f64::from(i) / 137.0;
            let want = (-x).exp();
            let got = exp_neg((x * 4_294_967_296.0) as u64) as f64 / 4_294_967_296.0;
            assert!((want - got).abs() < 1e-8, "e^-{x}: {got}, not {want}");
        }
    }
}
