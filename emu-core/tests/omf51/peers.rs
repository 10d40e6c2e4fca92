//! Object files of other tools: SDCC's linker and srecord.

use emu_core::image::{ElfMachine, SymbolFile, SymbolSpaces, load, load_symbols};
use emu_test_support::{run_tool, test_folder};

use super::{CODE, good, place, read, record};

const SOURCE: &str = "
#include <8051.h>
unsigned char count;
__bit flag;
__xdata unsigned int big;
static __idata unsigned char hid;
static unsigned char twice(unsigned char x)
{
    hid += x;
    return x + x;
}
void on_timer(void) __interrupt(1)
{
    count++;
    flag = !flag;
}
void main(void)
{
    for (;;) {
        big += twice(count);
        P1 = big;
    }
}
";

/// Builds a program with SDCC. Returns its folder, and a function that runs a tool in it.
fn build(name: &str) -> (std::path::PathBuf, impl Fn(&str, &[&str])) {
    let folder = test_folder!(name);
    let home = folder.clone();
    let run = move |program: &str, args: &[&str]| _ = run_tool(program, args, &home);
    std::fs::write(folder.join("app.c"), SOURCE).unwrap();
    run("sdcc", &["-mmcs51", "--debug", "app.c"]);
    (folder, run)
}

#[test]
#[ignore = "needs sdcc"]
fn files_of_sdcc_say_what_its_others_say() {
    let (folder, _) = build("omf51-sdcc");
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let image = good(&bytes("app.omf"));
    let hex = load("app.ihx", &bytes("app.ihx"), CODE, &[], ElfMachine::MCS51).unwrap().image;
    assert_eq!(image.segments, hex.segments);
    let cdb = bytes("app.cdb");
    let symbols = load_symbols(&[SymbolFile { name: "app.cdb", bytes: &cdb }], SymbolSpaces::MCS51).unwrap();
    for name in ["main", "on_timer", "count", "big", "P1", "P1_0", "TR0", "app.twice", "app.hid"] {
        let theirs: Vec<_> = symbols.symbols.iter().filter(|s| s.name == name).collect();
        let [theirs] = theirs.as_slice() else { panic!("{name}: {theirs:?}") };
        assert_eq!(place(&image, name), format!("{}:{:04x}", theirs.space, theirs.addr), "{name}");
    }
    // The object file has at least one line per function, and each of its lines is also in the compiler's
    // records.
    let theirs: Vec<_> = symbols.lines.iter().map(|l| (l.addr, &*l.file, l.line)).collect();
    let ours: Vec<_> = image.lines.all_lines().iter().map(|l| (l.addr, &*l.file, l.line)).collect();
    assert!(ours.len() >= 3, "{ours:?}");
    assert!(ours.iter().all(|line| theirs.contains(line)), "{ours:?} {theirs:?}");
}

#[test]
#[ignore = "needs sdcc and srecord"]
fn files_of_srecord_have_the_bytes() {
    let (folder, run) = build("omf51-srecord");
    run("srec_cat", &["app.ihx", "-intel", "-o", "app.aomf", "-aomf"]);
    let bytes = std::fs::read(folder.join("app.aomf")).unwrap();
    // Version 1.64 leaves out the module end record, which shows that nothing is missing.
    let whole = match read(&bytes) {
        Err(why) => {
            assert_eq!(why, "OMF001 the file ends without a module end record (type 0x04)");
            let name = &bytes[3..4 + usize::from(bytes[3])];
            [bytes.clone(), record(4, &[name, &[0, 0, 0, 0]].concat())].concat()
        }
        Ok(_) => bytes,
    };
    let hex = std::fs::read(folder.join("app.ihx")).unwrap();
    let hex = load("app.ihx", &hex, CODE, &[], ElfMachine::MCS51).unwrap().image;
    assert_eq!(good(&whole).segments, hex.segments);
}
