//! Placement of the areas of one module, as sdld does it (SDCC 4.2, `sdld` without `-b`, measured area by
//! area).
//!
//! RAM is filled by name in this order: bytes for the bits of BSEG from 20h, the register banks, BIT_BANK
//! from 20h, DSEG, OSEG, ISEG, SSEG. Each takes the first gap that is large enough; SSEG takes the largest
//! gap of all. Areas of code and of XDATA come in source order, each in the first gap after the previous one;
//! addresses of ABS areas are already taken.

use std::collections::BTreeMap;

/// The memory of an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum AreaMemory {
    #[default]
    Code,
    Data,
    Xdata,
    Bit,
}

/// A segment of AX51: the constraints of its directive on its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct SegmentClass {
    /// RAM with indirect addressing only is allowed.
    pub indirect: bool,
    /// Its bytes are bit-addressable.
    pub bits: bool,
    /// It begins at a multiple of this; 0 for any address.
    pub align: i64,
    /// It does not cross a multiple of this; 0 for no limit.
    pub within: i64,
    /// Its fixed address.
    pub at: Option<i64>,
}

/// A part of an absolute section of ASM51.
#[derive(Debug, Clone, Copy)]
pub(super) struct AbsolutePart {
    pub memory: AreaMemory,
    /// Its first address.
    pub at: i64,
    pub size: i64,
}

/// An area as the linker sees it.
#[derive(Debug, Clone, Default)]
pub(super) struct AreaShape {
    pub name: String,
    pub memory: AreaMemory,
    pub absolute: bool,
    pub overlaid: bool,
    pub paged: bool,
    /// It is a segment of AX51.
    pub class: Option<SegmentClass>,
    /// Number of addresses that it takes if it is not absolute.
    pub size: i64,
    /// Parts of an absolute area: first address and size.
    pub parts: Vec<(i64, i64)>,
}

impl AreaShape {
    /// Reports whether both have equal attributes.
    pub fn is_like(&self, other: &AreaShape) -> bool {
        let of = |shape: &AreaShape| (shape.memory, shape.absolute, shape.overlaid, shape.paged);
        of(self) == of(other)
    }
}

/// What is wrong with the address of an area.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum PlacementFault {
    /// No gap has so many addresses.
    Full(i64),
    /// From this address on it overlaps another area or the end of RAM.
    Shared(i64, String),
    /// It has PAG and extends over two pages.
    Page,
}

/// Addresses of the areas.
#[derive(Debug, Default)]
pub(super) struct AreaLayout {
    /// First address of each.
    pub bases: Vec<i64>,
    /// Values of `s_NAME` and `l_NAME`.
    pub limits: BTreeMap<String, i64>,
    /// Number of the area, and its fault.
    pub complaints: Vec<(usize, PlacementFault)>,
}

/// Areas that sdld knows by name, in its order; all except BSEG are in RAM.
const KNOWN: [&str; 10] =
    ["REG_BANK_0", "REG_BANK_1", "REG_BANK_2", "REG_BANK_3", "BSEG", "BIT_BANK", "DSEG", "OSEG", "ISEG", "SSEG"];

/// Number of addresses of program memory and of XDATA.
const LARGE_MEMORY: usize = 0x1_0000;

/// Size of the blocks that sdld searches.
const SEARCH_BLOCK: usize = 32;

/// The area that owns each address of a memory.
struct AddressOwners(Vec<Option<usize>>);

impl AddressOwners {
    fn take(&mut self, at: i64, size: i64, by: usize) {
        let from = usize::try_from(at).unwrap_or(usize::MAX);
        self.0.iter_mut().skip(from).take(size.max(0) as usize).for_each(|cell| *cell = Some(by));
    }

    /// Returns the first gap of `size` addresses within `within`.
    fn first_gap(&self, within: std::ops::Range<usize>, size: i64) -> Option<i64> {
        let size = usize::try_from(size).ok().filter(|size| *size > 0)?;
        let mut free = 0;
        for (at, cell) in self.0.iter().enumerate().take(within.end).skip(within.start) {
            free = if cell.is_none() { free + 1 } else { 0 };
            if free == size {
                return Some((at + 1 - size) as i64);
            }
        }
        None
    }

    /// Returns the first address from `start` on where an area of `size` addresses fits. sdld searches blocks
    /// of 32 addresses, and continues after the last taken address of a block.
    fn first_free_from(&self, start: i64, size: i64) -> Option<i64> {
        let (mut start, size) = (usize::try_from(start).ok()?, usize::try_from(size).ok()?);
        loop {
            let end = start + size;
            if end > self.0.len() {
                return None;
            }
            let taken = (start..end).find(|at| self.is_taken(*at));
            let Some(block) = taken.map(|at| at / SEARCH_BLOCK) else { return i64::try_from(start).ok() };
            let last = (block * SEARCH_BLOCK..(block + 1) * SEARCH_BLOCK).rev().find(|at| self.is_taken(*at))?;
            // In the block where the area ends, sdld continues from the block; in an earlier block, from the
            // start of the area.
            let from = if block == end / SEARCH_BLOCK { 0 } else { start % SEARCH_BLOCK };
            start = last + 1 + from;
        }
    }

    /// Returns the first gap that meets the constraints of a segment.
    fn first_gap_for(&self, mut within: std::ops::Range<usize>, size: i64, class: SegmentClass) -> Option<i64> {
        loop {
            let at = self.first_gap(within.clone(), size)?;
            let up = |step: i64| (at + step - 1) / step * step;
            let next = match class {
                SegmentClass { align, .. } if align > 0 && at % align != 0 => up(align),
                SegmentClass { within, .. }
                    if within > 0 && at / within != (at + size - 1) / within && at % within != 0 =>
                {
                    up(within)
                }
                _ => return Some(at),
            };
            within.start = usize::try_from(next).ok()?;
        }
    }

    fn is_taken(&self, at: usize) -> bool {
        self.0.get(at).is_some_and(Option::is_some)
    }

    /// Returns the size of the largest gap.
    fn largest_gap(&self, within: usize) -> i64 {
        let cells: Vec<_> = self.0.iter().take(within).collect();
        cells.split(|cell| cell.is_some()).map(<[_]>::len).max().unwrap_or(0) as i64
    }

    /// Returns the first of these addresses that another area owns, and that area; no area means the end of
    /// the memory.
    fn first_conflict(&self, at: i64, size: i64, own: usize) -> Option<(i64, Option<usize>)> {
        (at..at + size).find_map(|addr| match self.0.get(usize::try_from(addr).ok()?) {
            Some(Some(by)) if *by != own => Some((addr, Some(*by))),
            Some(_) => None,
            None => Some((addr, None)),
        })
    }
}

/// The state of the placement.
struct AreaLinker<'a> {
    shapes: &'a [AreaShape],
    ram: AddressOwners,
    code: AddressOwners,
    xdata: AddressOwners,
    /// The address at which the next area would begin, by memory.
    next: [i64; 4],
    out: AreaLayout,
}

/// Places areas in a RAM of `ram` bytes. `fixed` are the parts of ASM51's absolute sections and `banks` the
/// register banks in use; segments of AX51 leave both free.
pub(super) fn layout(shapes: &[AreaShape], fixed: &[AbsolutePart], banks: u8, ram: usize) -> AreaLayout {
    let mut linker = AreaLinker {
        shapes,
        ram: AddressOwners(vec![None; ram.clamp(0x80, 0x100)]),
        code: AddressOwners(vec![None; LARGE_MEMORY]),
        xdata: AddressOwners(vec![None; LARGE_MEMORY]),
        next: [0; 4],
        out: AreaLayout { bases: vec![0; shapes.len()], ..AreaLayout::default() },
    };
    for (number, shape) in shapes.iter().enumerate().filter(|(_, shape)| shape.absolute) {
        for &(at, size) in &shape.parts {
            match shape.memory {
                AreaMemory::Code => linker.code.take(at, size, number),
                AreaMemory::Data => linker.ram.take(at, size, number),
                AreaMemory::Xdata => linker.xdata.take(at, size, number),
                AreaMemory::Bit => {}
            }
        }
    }
    if shapes.iter().any(|shape| shape.class.is_some()) {
        linker.place_segments(fixed, banks);
        let AreaLayout { bases, limits, .. } = &mut linker.out;
        limits.extend(shapes.iter().zip(bases).map(|(shape, base)| (shape.name.to_ascii_lowercase(), *base)));
        return linker.out;
    }
    linker.bit_bytes();
    for (rank, name) in KNOWN.iter().enumerate() {
        let number = shapes.iter().position(|shape| shape.name == *name && !shape.absolute);
        linker.place_known_area(rank, name, number);
    }
    for (number, shape) in shapes.iter().enumerate() {
        if !shape.absolute && !KNOWN.contains(&shape.name.as_str()) {
            linker.place_other_area(number, shape);
        }
    }
    linker.check_bits();
    let used = linker.ram.0.iter().take(0x80).filter(|cell| cell.is_some()).count() as i64;
    linker.limit("DSEG", 0, used);
    linker.out.limits.insert("l_IRAM".to_owned(), linker.ram.0.len() as i64);
    linker.out
}

impl AreaLinker<'_> {
    fn limit(&mut self, name: &str, base: i64, size: i64) {
        self.out.limits.insert(format!("s_{name}"), base);
        self.out.limits.insert(format!("l_{name}"), size);
    }

    fn complain(&mut self, number: usize, complaint: PlacementFault) {
        self.out.complaints.push((number, complaint));
    }

    fn put(&mut self, number: usize, base: i64) {
        if let Some(to) = self.out.bases.get_mut(number) {
            *to = base;
        }
    }

    /// Reserves bytes from 20h on for the bits of BSEG.
    fn bit_bytes(&mut self) {
        self.next = [0x20, 0, 0, 0];
        let found = self.shapes.iter().position(|shape| shape.name == "BSEG" && !shape.absolute);
        let Some((number, shape)) = found.and_then(|number| Some((number, self.shapes.get(number)?))) else { return };
        let bytes = (shape.size + 7) / 8;
        match self.ram.first_gap(0x20..0x30, bytes) {
            Some(at) => {
                self.ram.take(at, bytes, number);
                self.limit("BSEG_BYTES", at, bytes);
            }
            None if bytes > 0 => self.complain(number, PlacementFault::Full(bytes)),
            None => {}
        }
    }

    /// Places an area that sdld knows by name. Its turn in the order counts even if the module has no such
    /// area.
    fn place_known_area(&mut self, rank: usize, name: &str, number: Option<usize>) {
        let mut size = number.and_then(|number| self.shapes.get(number)).map_or(0, |shape| shape.size);
        if name == "BSEG" {
            let [_, _, _, bit] = &mut self.next;
            let base = *bit;
            *bit += size;
            number.into_iter().for_each(|number| self.put(number, base));
            return self.limit(name, base, size);
        }
        let all = self.ram.0.len();
        let within = match name {
            "BIT_BANK" => 0x20..0x30,
            "ISEG" | "SSEG" => 0..all,
            _ => 0..all.min(0x80),
        };
        if name == "SSEG" && size > 0 {
            size = self.ram.largest_gap(all);
        }
        let next = self.next[0];
        let base = match number {
            _ if rank < 4 => rank as i64 * 8,
            Some(number) if size > 0 => self.ram.first_gap(within, size).unwrap_or_else(|| {
                self.complain(number, PlacementFault::Full(size));
                next
            }),
            _ => next,
        };
        if let Some(number) = number {
            if rank < 4 {
                self.check_shared(number, base, size);
            }
            self.ram.take(base, size, number);
            self.put(number, base);
        }
        self.limit(name, base, size);
        if !matches!(name, "DSEG" | "ISEG") {
            self.next[0] = base;
        }
    }

    /// Places an area with any other name.
    fn place_other_area(&mut self, number: usize, shape: &AreaShape) {
        let index = match shape.memory {
            AreaMemory::Data => 0,
            AreaMemory::Code => 1,
            AreaMemory::Xdata => 2,
            AreaMemory::Bit => 3,
        };
        let next = self.next.get(index).copied().unwrap_or(0);
        let mut size = shape.size;
        let map = match shape.memory {
            AreaMemory::Code => Some(&self.code),
            AreaMemory::Xdata => Some(&self.xdata),
            _ => None,
        };
        // Areas of the start-up code stay together.
        let wanted = match shape.name.as_str() {
            "GSINIT0" => self.shapes.iter().filter(|other| other.name.starts_with("GS")).map(|other| other.size).sum(),
            _ => size,
        };
        let base = match map {
            Some(map) if wanted > 0 && !shape.overlaid => match map.first_free_from(next, wanted) {
                Some(base) => base,
                None => {
                    self.complain(number, PlacementFault::Full(size));
                    next
                }
            },
            _ => next,
        };
        // A stack in XDATA extends to the end of its page.
        if shape.name == "XSTK" && size == 1 {
            size = 0x100 - (base & 0xFF);
        }
        match shape.memory {
            AreaMemory::Data => {
                self.check_shared(number, base, size);
                self.ram.take(base, size, number);
            }
            AreaMemory::Code if !shape.overlaid => self.code.take(base, size, number),
            AreaMemory::Xdata if !shape.overlaid => self.xdata.take(base, size, number),
            _ => {}
        }
        if shape.paged && size > 0 && base >> 8 != (base + size - 1) >> 8 {
            self.complain(number, PlacementFault::Page);
        }
        self.put(number, base);
        self.limit(&shape.name, base, size);
        if let Some(next) = self.next.get_mut(index) {
            *next = if shape.overlaid { base } else { base + size };
        }
    }

    /// Places segments of AX51 in the order of BL51 (its manual, "Locating segments"), each in the first gap:
    /// bits and bit-addressable bytes from 20h, DATA, IDATA, and the stack after all others.
    fn place_segments(&mut self, fixed: &[AbsolutePart], banks: u8) {
        // An owner that is not a segment.
        let nobody = self.shapes.len();
        for bank in (0..4).filter(|bank| banks >> bank & 1 == 1) {
            self.ram.take(bank * 8, 8, nobody);
        }
        for &AbsolutePart { memory, at, size } in fixed {
            match memory {
                AreaMemory::Code => self.code.take(at, size, nobody),
                AreaMemory::Data => self.ram.take(at, size, nobody),
                AreaMemory::Xdata => self.xdata.take(at, size, nobody),
                AreaMemory::Bit if at < 0x80 => self.ram.take(0x20 + at / 8, (at + size - 1) / 8 - at / 8 + 1, nobody),
                AreaMemory::Bit => {}
            }
        }
        let shapes = self.shapes;
        let given_place = |shape: &AreaShape| shape.class.and_then(|class| class.at);
        for (number, shape) in shapes.iter().enumerate() {
            let Some(at) = given_place(shape) else { continue };
            match shape.memory {
                AreaMemory::Code => self.code.take(at, shape.size, number),
                AreaMemory::Data => self.ram.take(at, shape.size, number),
                AreaMemory::Xdata => self.xdata.take(at, shape.size, number),
                AreaMemory::Bit => self.ram.take(0x20 + at / 8, (at % 8 + shape.size + 7) / 8, number),
            }
            self.put(number, at);
        }
        let free = |shape: &AreaShape| given_place(shape).is_none();
        let bits = || shapes.iter().enumerate().filter(|(_, shape)| shape.memory == AreaMemory::Bit && free(shape));
        let bytes = (bits().map(|(_, shape)| shape.size).sum::<i64>() + 7) / 8;
        if let (Some((first, _)), true) = (bits().next(), bytes > 0) {
            let at = self.ram.first_gap(0x20..0x30, bytes).unwrap_or_else(|| {
                self.complain(first, PlacementFault::Full(bytes));
                0x20
            });
            self.ram.take(at, bytes, first);
            let mut next = (at - 0x20) * 8;
            for (number, shape) in bits() {
                self.put(number, next);
                next += shape.size;
            }
        }
        let rank = |shape: &AreaShape, class: SegmentClass| match shape.memory {
            AreaMemory::Data if class.bits => 0,
            AreaMemory::Data if !class.indirect => 1,
            AreaMemory::Data if !shape.name.to_ascii_uppercase().starts_with("?STACK") => 2,
            _ => 3,
        };
        let mut order: Vec<(usize, &AreaShape, SegmentClass)> =
            shapes.iter().enumerate().filter_map(|(n, shape)| Some((n, shape, shape.class?))).collect();
        order.retain(|(_, shape, _)| shape.memory != AreaMemory::Bit && shape.size > 0 && free(shape));
        order.sort_by_key(|(_, shape, class)| rank(shape, *class));
        for (number, shape, class) in order {
            let ram = self.ram.0.len();
            let (map, range) = match shape.memory {
                AreaMemory::Code => (&mut self.code, 0..LARGE_MEMORY),
                AreaMemory::Xdata => (&mut self.xdata, 0..LARGE_MEMORY),
                _ if class.bits => (&mut self.ram, 0x20..0x30),
                _ => (&mut self.ram, 0..if class.indirect { ram } else { ram.min(0x80) }),
            };
            match map.first_gap_for(range, shape.size, class) {
                Some(at) => {
                    map.take(at, shape.size, number);
                    self.put(number, at);
                }
                None => self.complain(number, PlacementFault::Full(shape.size)),
            }
        }
    }

    fn check_shared(&mut self, number: usize, base: i64, size: i64) {
        if let Some((at, with)) = self.ram.first_conflict(base, size, number) {
            let with = with.and_then(|with| self.shapes.get(with));
            let with = with.map_or("the end of RAM".to_owned(), |shape| format!("the area {}", shape.name));
            self.complain(number, PlacementFault::Shared(at, with));
        }
    }

    /// Reports bits outside bytes 20h to 2Fh, or in bytes of another area.
    fn check_bits(&mut self) {
        let areas =
            self.shapes.iter().enumerate().filter(|(_, s)| s.memory == AreaMemory::Bit && !s.absolute && s.size > 0);
        let areas: Vec<(usize, i64, i64)> =
            areas.filter_map(|(n, shape)| Some((n, *self.out.bases.get(n)?, shape.size))).collect();
        let is_bits = |by: &usize| self.shapes.get(*by).is_some_and(|shape| shape.memory == AreaMemory::Bit);
        let mut wrong = Vec::new();
        for (number, base, size) in areas {
            let taken = (base / 8..(base + size + 7) / 8).find_map(|byte| {
                let by = (*self.ram.0.get(usize::try_from(byte).ok()? + 0x20)?)?;
                (!is_bits(&by)).then_some((byte + 0x20, by))
            });
            match taken {
                _ if base + size > 0x80 => wrong.push((number, PlacementFault::Full((size + 7) / 8))),
                Some((byte, by)) => {
                    let with = self.shapes.get(by).map_or("", |shape| shape.name.as_str());
                    wrong.push((number, PlacementFault::Shared(byte, format!("the area {with}"))));
                }
                None => {}
            }
        }
        self.out.complaints.extend(wrong);
    }
}
