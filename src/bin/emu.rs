//! The program `emu`: the process around the library of the same name.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    emu::main()
}
