use ladder_compile::{Options, compile};
#[test]
fn dump() {
    let only = std::env::var("ONLY").ok();
    for entry in std::fs::read_dir("/work/shared/ld").unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "ld") {
            continue;
        }
        let file = path.file_stem().unwrap().to_string_lossy().into_owned();
        if only.as_ref().is_some_and(|o| *o != file) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let Ok(parsed) = ladder::parse(&file, &text) else {
            println!("{file}: parse");
            continue;
        };
        let program = parsed.program;
        for mcu in ["8051", "8052"] {
            let options = Options { mcu: mcu.to_owned(), clock_hz: Some(11_059_200), ..Options::default() };
            match compile(&program, &options) {
                Ok(c) => {
                    println!(
                        "{file} {mcu}: {} bytes, ram {}, worst {}, poll {}",
                        c.map.code_bytes, c.map.ram_bytes, c.map.worst_scan_cycles, c.map.poll_cycles
                    );
                    if only.is_some() {
                        println!("{}", c.listing)
                    }
                }
                Err(e) => println!(
                    "{file} {mcu}: {}",
                    e.iter().map(|e| format!("{} {}", e.code, e.cause)).collect::<Vec<_>>().join("; ")
                ),
            }
        }
    }
}
