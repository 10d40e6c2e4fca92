//! Names that the chip gives: registers, bits, numbers of its makers' headers.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use emu_core::chip::Chip;

use crate::expr::Value;

/// The names of a chip, in any case.
#[derive(Debug)]
pub(crate) struct Known {
    values: HashMap<String, Value>,
    names: Vec<&'static str>,
}

impl Known {
    /// Those of a chip; collected once.
    pub fn of(chip: &'static Chip) -> Arc<Known> {
        static MADE: OnceLock<Mutex<HashMap<usize, Arc<Known>>>> = OnceLock::new();
        let key = std::ptr::from_ref(chip) as usize;
        let Ok(mut made) = MADE.get_or_init(Mutex::default).lock() else { return Arc::new(Known::new(chip)) };
        made.entry(key).or_insert_with(|| Arc::new(Known::new(chip))).clone()
    }

    fn new(chip: &Chip) -> Known {
        let registers = chip.regs.iter().map(|r| (r.name, Value { register: true, ..Value::of(r.addr.into()) }));
        let bits = chip.bits.iter().map(|b| (b.name, Value::of(b.addr.into())));
        let constants = (chip.constants)().into_iter().map(|(name, n)| (name, Value::of(n.into())));
        let mut known = Known { values: HashMap::new(), names: Vec::new() };
        for (name, value) in registers.chain(bits).chain(constants) {
            known.values.entry(name.to_ascii_lowercase()).or_insert(value);
            known.names.push(name);
        }
        known
    }

    /// The value of a name.
    pub fn get(&self, name: &str) -> Option<Value> {
        let lower = name.bytes().any(|c| c.is_ascii_uppercase()).then(|| name.to_ascii_lowercase());
        self.values.get(lower.as_deref().unwrap_or(name)).copied()
    }

    /// All names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().copied()
    }
}
