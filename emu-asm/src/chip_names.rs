//! Names that the chip defines: registers, bits and constants of the vendor's headers.

use emu_core::NamedConstant;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use emu_core::chip::Chip;

use crate::value::AsmValue;

/// The names of a chip. Look-up ignores case.
#[derive(Debug)]
pub(crate) struct ChipNames {
    values: HashMap<String, AsmValue>,
    names: Vec<&'static str>,
}

impl ChipNames {
    /// Returns the names of `chip`; they are collected once per chip.
    pub fn of(chip: &'static Chip) -> Arc<ChipNames> {
        static MADE: OnceLock<Mutex<HashMap<usize, Arc<ChipNames>>>> = OnceLock::new();
        let key = std::ptr::from_ref(chip) as usize;
        let Ok(mut made) = MADE.get_or_init(Mutex::default).lock() else { return Arc::new(ChipNames::new(chip)) };
        made.entry(key).or_insert_with(|| Arc::new(ChipNames::new(chip))).clone()
    }

    fn new(chip: &Chip) -> ChipNames {
        let registers =
            chip.regs.iter().map(|r| (r.name, AsmValue { is_register: true, ..AsmValue::of(r.addr.into()) }));
        let bits = chip.bits.iter().map(|b| (b.name, AsmValue::of(b.addr.into())));
        let constants =
            (chip.constants)().into_iter().map(|NamedConstant { name, value: n }| (name, AsmValue::of(n.into())));
        let mut known = ChipNames { values: HashMap::new(), names: Vec::new() };
        for (name, value) in registers.chain(bits).chain(constants) {
            known.values.entry(name.to_ascii_lowercase()).or_insert(value);
            known.names.push(name);
        }
        // avr-libc's `TIMER0_OVF_vect_num`.
        for (number, vector) in chip.vectors.iter().enumerate() {
            let name = format!("{vector}_vect_num").to_ascii_lowercase();
            known.values.entry(name).or_insert(AsmValue::of(number as i64));
        }
        known
    }

    /// Returns the value of a name.
    pub fn get(&self, name: &str) -> Option<AsmValue> {
        let lower = name.bytes().any(|c| c.is_ascii_uppercase()).then(|| name.to_ascii_lowercase());
        self.values.get(lower.as_deref().unwrap_or(name)).copied()
    }

    /// Returns all names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().copied()
    }
}
