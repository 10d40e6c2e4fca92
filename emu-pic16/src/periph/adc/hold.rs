//! The holding capacitor of the converter: what stands on it after a time of charging.
//!
//! The model is that of the sheets' acquisition equation (DS30292 equation 11-1): the amplifier settles, a coefficient of
//! temperature is waited for, then the capacitor follows its source through the resistances of source, wire and switch.
//! Once the error is half a step the sheet calls it charged, and so it is here: it then has the voltage of its source
//! exactly. All arithmetic is of integers: microvolts, and e^-x in 32 binary places summed from its series.

/// The constants of a converter's acquisition equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct HoldNetwork {
    /// CHOLD in femtofarads.
    pub capacity_ff: u64,
    /// RIC + RSS at 5 V in ohms.
    pub inner_ohms: u64,
    /// Amplifier settling time and temperature coefficient at 50 degrees, in nanoseconds.
    pub settle_ns: u64,
    /// The time constants until half a step is left, in millionths: ln 2047 for 10 bits, ln 511 for 8.
    pub constants_e6: u64,
}

/// The capacitor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct HoldCapacitor {
    network: HoldNetwork,
    hz: u64,
    /// RC in femtoseconds.
    tau_fs: u64,
    /// Clocks between connection and the begin of charging.
    dead: u64,
    /// Clocks of charging until half a step is left.
    full: u64,
    /// The voltage when the present charging began, or the one that is kept.
    microvolts: u64,
    /// Clock of the connection; `None` while it is open.
    connected: Option<u64>,
    /// Clock at which the present charging begins or began.
    from: u64,
}

emu_core::state! {
    HoldCapacitor { microvolts, connected, from } stays { network, hz, tau_fs, dead, full }
    if |hold, _now| ![hold.connected, Some(hold.from)].contains(&Some(u64::MAX))
}

impl HoldCapacitor {
    /// An empty, open one, with a source of `ohms`.
    pub(super) fn new(network: HoldNetwork, ohms: u32, hz: u64) -> HoldCapacitor {
        let (hz, tau_fs) = (hz.max(1), (u64::from(ohms) + network.inner_ohms) * network.capacity_ff);
        let charge_fs = u128::from(tau_fs) * u128::from(network.constants_e6) / 1_000_000;
        let settle_fs = u128::from(network.settle_ns) * 1_000_000;
        let clocks = |fs: u128| (fs * u128::from(hz)).div_ceil(SECOND_FS) as u64;
        let dead = clocks(settle_fs);
        let full = clocks(settle_fs + charge_fs) - dead;
        HoldCapacitor { network, hz, tau_fs, dead, full, microvolts: 0, connected: None, from: 0 }
    }

    /// Another source impedance from `t` on; `source` is the voltage of the source, in microvolts as everywhere here.
    pub(super) fn set_ohms(&mut self, ohms: u32, t: u64, source: u64) {
        self.inject_charge(t, source);
        let new = HoldCapacitor::new(self.network, ohms, self.hz);
        *self = HoldCapacitor { microvolts: self.microvolts, connected: self.connected, from: self.from, ..new };
    }

    /// The voltage at `t`.
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

    /// The source is about to change at `t`: charging begins anew from what there is.
    pub(super) fn inject_charge(&mut self, t: u64, source: u64) {
        self.microvolts = self.voltage_at(t, source);
        self.from = self.from.max(t);
    }

    /// Opens at `t` and keeps what there is.
    pub(super) fn open(&mut self, t: u64, source: u64) {
        self.microvolts = self.voltage_at(t, source);
        self.connected = None;
    }

    /// Connects at `at`, which may be to come. Whatever has been on it so far must have been opened or disturbed.
    pub(super) fn connect(&mut self, at: u64) {
        self.connected = Some(at);
        self.from = at.saturating_add(self.dead);
    }

    /// Connects to another source at `t`, or when it was to connect anyway if that is later.
    pub(super) fn switch(&mut self, t: u64, source: u64) {
        self.inject_charge(t, source);
        if let Some(at) = self.connected {
            self.connect(at.max(t));
        }
    }

    /// It is connected or about to be.
    pub(super) fn is_connected(&self) -> bool {
        self.connected.is_some()
    }

    /// The time of the acquisition equation has passed at `t` since it was connected.
    pub(super) fn is_acquired(&self, t: u64) -> bool {
        self.connected.is_some_and(|at| t >= at.saturating_add(self.dead).saturating_add(self.full))
    }
}

const SECOND_FS: u128 = 1_000_000_000_000_000;

/// e^-1 in 32 binary places.
const INVERSE_E: u128 = 1_580_030_169;

/// e^-x, both in 32 binary places: the fraction of `x` by the series, the integer part by repeated products.
fn exp_neg(x: u64) -> u64 {
    let (whole, fraction) = (x >> 32, u128::from(x & 0xFFFF_FFFF));
    let (mut term, mut plus, mut minus) = (1u128 << 32, 1u128 << 32, 0);
    for k in 1..=13u128 {
        term = ((term * fraction) >> 32) / k;
        *(if k % 2 == 1 { &mut minus } else { &mut plus }) += term;
    }
    // Beyond e^-32 nothing is left of 32 places.
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
