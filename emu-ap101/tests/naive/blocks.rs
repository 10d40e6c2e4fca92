//! Configuration blocks on the naive model and the crate: both accept the same blocks, and read the same from
//! them.

use emu_core::rng::Rng;

use super::config::{BLOCK, Config, LENGTH};
use super::core::image;
use super::random::draw;

/// The bytes of a random plan that has a block.
fn block(rng: &mut Rng) -> Vec<Option<u8>> {
    loop {
        let plan = draw(rng);
        if plan.config.is_some() {
            return plan.bytes;
        }
    }
}

#[test]
fn blocks_are_read_the_same() {
    for seed in 0..100 {
        let bytes = block(&mut Rng::new(0xB10C_0000 + seed));
        let own: Vec<u8> = bytes[BLOCK..BLOCK + LENGTH].iter().map(|byte| byte.expect("a whole block")).collect();
        let wanted = Config::read(&own).expect("a good block");
        let got = emu_ap101::Ap101Config::read_config(&image(&bytes)).expect("a good block");
        assert_eq!(wanted.write(), own, "seed {seed}");
        assert_eq!((wanted.hz, wanted.period), (got.hz, got.period), "seed {seed}");
        assert_eq!(
            (wanted.inputs, wanted.outputs),
            (got.input_channels.into(), got.output_channels.into()),
            "seed {seed}"
        );
        assert_eq!(wanted.reconfigurable, got.reconfigurable, "seed {seed}");
        let enabled: Vec<bool> = wanted.programs.iter().map(|entry| entry.enabled).collect();
        assert_eq!(enabled, got.enabled, "seed {seed}");
        let present = wanted.programs.iter().filter(|entry| entry.present);
        let programs: Vec<_> = present.map(|entry| (entry.start, entry.last, entry.rx)).collect();
        let found: Vec<_> = got.programs.iter().map(|entry| (entry.start, entry.last, entry.rx)).collect();
        assert_eq!(programs, found, "seed {seed}");
    }
}

#[test]
fn one_wrong_byte_is_refused_by_both_or_by_none() {
    let (mut refused, mut taken) = (0, 0);
    let blocks: Vec<_> = (0..20).map(|seed| block(&mut Rng::new(0xBAD0_0000 + seed))).collect();
    for seed in 0..4000 {
        let mut rng = Rng::new(0xBAD1_0000 + seed);
        let mut bytes = blocks[seed as usize % blocks.len()].clone();
        let size = if rng.one_in(2) { 0x60 } else { LENGTH as u64 };
        let at = BLOCK + rng.below(size) as usize;
        let value = if rng.one_in(2) { rng.below(10) as u8 } else { rng.next_u64() as u8 };
        bytes[at] = Some(value);
        let own: Vec<u8> = bytes[BLOCK..].iter().map(|byte| byte.expect("a whole block")).collect();
        let (wanted, got) = (Config::read(&own).err(), emu_ap101::Ap101Config::read_config(&image(&bytes)).is_ok());
        assert_eq!(wanted.is_none(), got, "seed {seed}: {value:02x} at {at:x}: {wanted:x?}");
        *(if got { &mut taken } else { &mut refused }) += 1;
    }
    assert!(refused > 500 && taken > 500, "{refused} refused, {taken} taken");
}
