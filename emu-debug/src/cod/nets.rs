//! Wires: which pins of the chip and of parts hang together, and the voltage that follows.

use emu_core::pins::PinId;

use super::parts::{CodPart, CodPartKind, VoltageSource, conductance};

/// What hangs on a net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetMember {
    /// A pin of the chip.
    Pin(PinId),
    /// A pin of a part: position of the part, position of the pin.
    Part(usize, usize),
}

/// A net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodNet {
    /// Its name.
    pub name: String,
    /// What hangs on it.
    pub members: Vec<NetMember>,
}

/// Least voltage that counts as high, in millivolts: VIH of a TTL input buffer (DS30292, table 15.1, D040).
pub const HIGH_MILLIVOLTS: i64 = 2000;

/// Everything that is needed to find voltages at one moment.
pub struct NetSolver<'a> {
    /// The nets.
    pub nets: &'a [CodNet],
    /// The parts.
    pub parts: &'a [CodPart],
    /// What a pin of the chip puts on its net.
    pub chip_source: &'a dyn Fn(PinId) -> Option<VoltageSource>,
    /// What a pin of a part puts on its net.
    pub part_source: &'a dyn Fn(usize, usize) -> Option<VoltageSource>,
}

impl NetSolver<'_> {
    /// Millivolts of a net without one of its members; nothing where nobody drives it.
    #[must_use]
    pub fn voltage(&self, net: usize, without: Option<NetMember>) -> Option<i64> {
        let mut visited = Vec::new();
        self.source(net, without, &mut visited).map(|source| source.millivolts)
    }

    /// All that drives a net as one source. `visited` are the switches through which it was reached: each is passed once.
    fn source(&self, net: usize, without: Option<NetMember>, visited: &mut Vec<usize>) -> Option<VoltageSource> {
        let (mut current, mut sum) = (0i128, 0i128);
        for &member in &self.nets.get(net)?.members {
            if Some(member) == without {
                continue;
            }
            let source = match member {
                NetMember::Pin(pin) => (self.chip_source)(pin),
                NetMember::Part(part, pin) => match self.parts.get(part).map(|part| &part.kind) {
                    Some(CodPartKind::Switch { closed, ohms_closed, ohms_open }) => {
                        let ohms = if *closed { *ohms_closed } else { *ohms_open };
                        self.source_through_switch(part, pin, ohms, visited)
                    }
                    _ => (self.part_source)(part, pin),
                },
            };
            if let Some(source) = source {
                current += i128::from(source.millivolts) * i128::from(source.conductance);
                sum += i128::from(source.conductance);
            }
        }
        let millivolts = i64::try_from(current.checked_div(sum)?).ok()?;
        Some(VoltageSource { millivolts, conductance: i64::try_from(sum).unwrap_or(i64::MAX) })
    }

    /// What the other side of a switch puts on this one, behind its resistance.
    fn source_through_switch(
        &self,
        switch: usize,
        pin: usize,
        ohms: f64,
        visited: &mut Vec<usize>,
    ) -> Option<VoltageSource> {
        if visited.contains(&switch) {
            return None;
        }
        visited.push(switch);
        let member = NetMember::Part(switch, 1 - pin.min(1));
        let other = self.nets.iter().position(|net| net.members.contains(&member));
        let source = other.and_then(|other| self.source(other, Some(member), visited));
        visited.pop();
        let source = source?;
        let (a, b) = (i128::from(source.conductance), i128::from(conductance(ohms)));
        let both = i64::try_from(a * b / (a + b)).unwrap_or(i64::MAX);
        // A source behind an open switch and a large resistor is still one.
        Some(VoltageSource { millivolts: source.millivolts, conductance: both.max(1) })
    }
}
