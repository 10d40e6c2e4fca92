//! Executes one target under libFuzzer, selected by the variable EMU_FUZZ_TARGET. `fuzz/run.sh` builds and
//! starts it.

#![no_main]

use std::sync::LazyLock;

use emu_fuzz::FuzzTarget;

static TARGET: LazyLock<&FuzzTarget> = LazyLock::new(|| {
    let name = std::env::var("EMU_FUZZ_TARGET").unwrap_or_default();
    emu_fuzz::find_target(&name).unwrap_or_else(|why| {
        eprintln!("EMU_FUZZ_TARGET: {why}");
        std::process::exit(2);
    })
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| TARGET.run(data));
