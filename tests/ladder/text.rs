//! Splits the tables of traces into programs and lines of values.

/// The tables.
const FILES: &[(&str, &str)] = &[
    ("bits.txt", include_str!("bits.txt")),
    ("timers.txt", include_str!("timers.txt")),
    ("counters.txt", include_str!("counters.txt")),
    ("integers.txt", include_str!("integers.txt")),
    ("tables.txt", include_str!("tables.txt")),
    ("devices.txt", include_str!("devices.txt")),
    ("strings.txt", include_str!("strings.txt")),
    ("ldmicro5.txt", include_str!("ldmicro5.txt")),
];

/// A case: its name with the name of the file, a complete `.ld` text, and the lines of columns and values,
/// each with its place.
pub type Text = (String, String, Vec<(String, String)>);

/// Returns all cases of all tables.
pub fn texts() -> Vec<Text> {
    let mut cases: Vec<Text> = Vec::new();
    for (file, text) in FILES {
        let (mut rungs, mut name) = (String::new(), String::new());
        for (i, line) in text.lines().enumerate() {
            let place = format!("{file}:{}: {}", i + 1, line.trim());
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            if let Some(title) = line.strip_prefix("case ") {
                (name, rungs) = (format!("{file}: {title}"), String::new());
            } else if let Some(columns) = line.strip_prefix("scan ") {
                cases.push((std::mem::take(&mut name), program(&rungs), vec![(place, columns.to_owned())]));
            } else if name.is_empty() {
                let case = cases.last_mut().unwrap_or_else(|| panic!("{place}: outside of a case"));
                case.2.push((place, line.to_owned()));
            } else {
                rungs += line;
                rungs.push('\n');
            }
        }
    }
    cases
}

/// Builds a complete program from the text of a case.
fn program(text: &str) -> String {
    let (head, rungs) = text.split_at(text.find("RUNG\n").expect("a rung"));
    let (header, head) = head.strip_prefix("LDmicro0.2\n").map_or(("LDmicro0.1", head), |rest| ("LDmicro0.2", rest));
    let usual = |name: &str, line: &'static str| if head.contains(name) { "" } else { line };
    let (cycle, baud) = (usual("CYCLE=", "CYCLE=10000\n"), usual("BAUD=", "BAUD=1000\n"));
    let io = usual("IO LIST", "IO LIST\nEND\n");
    format!("{header}\n{cycle}{baud}CRYSTAL=4000000\n{head}{io}PROGRAM\n{rungs}\n")
}
