//! Nets: connected pins of the chip and of parts, and the resulting voltage.

use emu_core::pins::PinId;

use super::parts::{CodPart, CodPartKind, VoltageSource, conductance};

/// A pin on a net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetMember {
    /// A pin of the chip.
    Pin(PinId),
    /// A pin of a part: index of the part, index of the pin.
    Part(usize, usize),
}

/// A net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodNet {
    /// Its name.
    pub name: String,
    /// The pins on it.
    pub members: Vec<NetMember>,
}

/// Lowest voltage that counts as high, in millivolts: VIH of a TTL input buffer (DS30292, table 15.1, D040).
pub const HIGH_MILLIVOLTS: i64 = 2000;

/// The data for the voltages at one moment.
pub struct NetSolver<'a> {
    /// The nets.
    pub nets: &'a [CodNet],
    /// The parts.
    pub parts: &'a [CodPart],
    /// Returns what a chip pin drives on its net.
    pub chip_source: &'a dyn Fn(PinId) -> Option<VoltageSource>,
    /// Returns what a pin of a part drives on its net.
    pub part_source: &'a dyn Fn(usize, usize) -> Option<VoltageSource>,
}

impl NetSolver<'_> {
    /// Returns the voltage of a net in millivolts without one of its members; `None` if nothing drives it.
    #[must_use]
    pub fn voltage(&self, net: usize, without: Option<NetMember>) -> Option<i64> {
        let mut visited = Vec::new();
        self.source(net, without, &mut visited).map(|source| source.millivolts)
    }

    /// Combines all drivers of a net into one source. `visited` are the switches on the way here, so each is
    /// passed only once.
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

    /// Returns the source at the other side of a switch, after the switch's resistance.
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
        // A source after an open switch and a large resistor still counts.
        Some(VoltageSource { millivolts: source.millivolts, conductance: both.max(1) })
    }
}
