//! The program `emu`: the library of the same name with the process around it.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    emu::main()
}
