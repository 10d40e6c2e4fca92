//! Waveforms as stimulus: accepted contents, and faults with their line (IEEE 1364-2005, section 18).

use scenario::{ScenarioValue, StepAction, read_vcd};

const HEAD: &str = "$timescale 1 us $end $scope module top $end $var wire 1 ! a $end $var reg 8 # b $end $upscope $end \
                    $enddefinitions $end\n";

/// Rows are `text after the header => changes of a and b, or the line of the fault`; `;` ends a line.
const CHANGES: &[(&str, &str)] = &[
    ("#0;0!;b101 #;#5;z!", "0us a=0; 0us b=5; 5us a=z"),
    ("#0;b1 !;bz !;b0 !", "0us a=1; 0us a=z; 0us a=0"),
    ("#0;b001 !;b0000000011111111 #", "0us a=1; 0us b=255"),
    ("#0;b10 !", "line 3"),
    ("#0;bx0 !", "line 3"),
    ("#0;b100000000 #", "line 3"),
    ("#0;x!;bzzzzzzzz #;bx #", ""),
    ("#3;0!;#2", "line 4"),
    ("#0;0?", "line 3"),
    ("$var wire 1 c c $end", "line 2"),
    ("$upscope $end", "line 2"),
    ("#0;2!", "line 3"),
];

fn found(text: &str) -> String {
    let wave = match read_vcd("w.vcd", text.as_bytes()) {
        Ok(wave) => wave,
        Err(fault) => return format!("line {}", fault.pos.line),
    };
    let (scenario, _) = wave.to_scenario(&mut |_| true).expect("one signal of each name");
    let step = |step: &scenario::ScenarioStep| {
        let (scenario::StepTime::At(span), StepAction::Set(assigns)) = (&step.time, &step.action) else {
            panic!("{step:?}")
        };
        let value = match &assigns[0].value {
            ScenarioValue::Number(number) => number.to_string(),
            ScenarioValue::Text(text) => text.clone(),
        };
        assert!(step.pos.line > 1, "{text}");
        format!("{}us {}={value}", span.mantissa, assigns[0].name.text)
    };
    scenario.steps.iter().map(step).collect::<Vec<_>>().join("; ")
}

#[test]
fn changes_are_stimuli() {
    for (changes, wanted) in CHANGES {
        assert_eq!(found(&format!("{HEAD}{}\n", changes.replace(';', "\n"))), *wanted, "{changes}");
    }
}

#[test]
fn heads_are_looked_at() {
    assert_eq!(found(&format!("\u{feff}{HEAD}#0\n1!\n")), "line 1");
    assert_eq!(found(&HEAD.replace("1 us", "0 us")), "line 1");
    assert_eq!(found("$upscope $end\n"), "line 1");
    assert_eq!(found(format!("{HEAD}#0\n0!\n#7\n1!").as_str()), "0us a=0; 7us a=1", "no end of the last line");
    assert_eq!(found("$var wire 1 ! a $end\n"), "line 2");
}

/// Wires with one identifier code are found by a hash lookup; a comparison of all pairs would take minutes
/// for this file.
#[test]
fn many_wires_of_one_code() {
    let wires: String = (0..150_000).map(|n| format!("$var wire 1 ! w{n} $end\n$var wire 1 ! w{n} $end\n")).collect();
    let wave = read_vcd("w.vcd", (wires + "$enddefinitions $end\n").as_bytes()).expect("a waveform");
    assert_eq!(wave.wires.len(), 150_000);
}
