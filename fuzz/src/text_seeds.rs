//! Short initial inputs and dictionaries for targets whose inputs are texts.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::machines;
use crate::seeds::collect_files;
use crate::workspace_root;

/// Converts texts to inputs.
fn texts(list: &[&str]) -> Vec<Vec<u8>> {
    list.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// Converts words to a dictionary.
pub(crate) fn words(list: &[&str]) -> Vec<String> {
    list.iter().map(|word| (*word).to_owned()).collect()
}

/// Words of SDCC's symbol files.
pub(crate) fn sdcc() -> Vec<String> {
    words(&[
        "S:",
        "L:",
        "F:",
        "T:",
        "M:",
        "G$",
        "$0$0",
        "({2}DI:S)",
        ",E,0,0",
        "\n",
        "0x",
        "Area",
        "00000000",
        ";",
        "\t",
    ])
}

/// Rows of maps of Keil's linkers.
pub(crate) fn keil() -> Vec<String> {
    words(&[
        "\n  C:0040H         PUBLIC        ",
        "\n  D:0008H         SYMBOL        ",
        "\n  B:0020H.1       SYMBOL        ",
        "\n  C:0040H         LINE#         ",
        "\n  -------         MODULE        ",
        "\n  -------         ENDMOD        ",
        "\n  -------         PROC          ",
        "\n  -------         ENDPROC       ",
        "\n  -------         DO            ",
        "\n  -------         ENDDO         ",
        "\n>> ",
    ])
}

/// Words of gpsim's commands.
pub(crate) fn cod() -> Vec<String> {
    words(&[
        ".assert",
        ".sim",
        ".command",
        "module lib",
        "node ",
        "attach ",
        "stimulus ",
        "break c 0x",
        "end",
        "\"",
        "->",
        ",",
    ])
}

/// Words of grids of CSLadder.
pub(crate) fn grids() -> Vec<String> {
    words(&[
        "CSLADDER\n",
        "INPUTS ACTIVE-LOW\n",
        "GRID\n",
        "END\n",
        "EN0 ",
        "/S8 ",
        "T0 ",
        "C0 ",
        "F0 ",
        "--- ",
        "- ",
        "+ ",
        "| ",
        "┬ ",
        "┘ ",
        ". ",
        "OTE:S8",
        "OTL:F0",
        "OTU:S8",
        "TON:T0:2",
        "CTU:C0:5",
        "RES:C0",
    ])
}

/// Words of `.ld` files.
pub(crate) fn ladder() -> Vec<String> {
    let keywords = ladder::element_keywords().map(|keyword| format!("{keyword} "));
    keywords
        .chain(words(&[
            "LDmicro0.1\n",
            "LDmicro0.2\n",
            "MICRO=",
            "CYCLE=",
            "CRYSTAL=",
            "BAUD=",
            "COMPILED=",
            "IO LIST\n",
            "END\n",
            "PROGRAM\n",
            "RUNG\n",
            "SERIES\n",
            "PARALLEL\n",
            "CONTACTS Xa 0\n",
            "COIL Yb 0 0 0\n",
            "TON Tc 1000000\n",
            "TOF Td 500000\n",
            "RTO Te 1\n",
            "CTU Cf 5\n",
            "CTD Cg 5\n",
            "CTC Ch 3\n",
            "RES Cf\n",
            "MOVE a b\n",
            "ADD a b c\n",
            "SUB a 1 c\n",
            "MUL a b c\n",
            "DIV a 0 c\n",
            "OSR\n",
            "OSF\n",
            "SHORT\n",
            "OPEN\n",
            "MASTER_RELAY\n",
            "SHIFT_REGISTER s 7\n",
            "LOOK_UP_TABLE d i 3 0 1 2 3\n",
            "PIECEWISE_LINEAR d i 2 0 0 9 9\n",
            "FORMATTED_STRING v 6 65 66\n",
            "READ_ADC Aa\n",
            "SET_PWM d 1000\n",
            "UART_SEND c\n",
            "UART_RECV c\n",
            "PERSIST p\n",
            "EQU a 1\n",
            "NEQ a 1\n",
            "GRT a 1\n",
            "GEQ a 1\n",
            "LES a 1\n",
            "LEQ a 1\n",
            "COMMENT c\n",
            "2147483647",
            "-32768",
        ]))
        .collect()
}

/// Words of scenarios.
pub(crate) fn scenario() -> Vec<String> {
    let keys = scenario::KEYS.iter().copied().chain(scenario::STEP_KEYS.iter().map(|key| key.name));
    let keys = keys.map(|key| format!("{key} = "));
    keys.chain(words(&[
        "[[step]]\n",
        "\"10ms\"",
        "\"1 scans\"",
        "{ PB0 = 1 }",
        "[0, 9]",
        "\"data:0x100\"",
        "true",
        "\"z\"",
    ]))
    .collect()
}

/// Recorded actions, each with kind, tick and length.
pub(crate) fn records() -> Vec<Vec<u8>> {
    texts(&[
        "\u{4}\u{3}\u{9}\u{3}RA0\u{0}\u{9}\u{2}hi",
        "\u{1f}\u{1}\u{2}\u{0}\u{2}\u{3}\u{5}a\nb\"c",
        "",
        "\u{21}\u{4}\u{40}\u{5}a.b=\"",
    ])
}

const WAVE: &str = "$timescale 1 us $end\n$scope module top $end\n$var wire 1 ! PB0 $end\n$var wire 8 # bus [7:0] $end\n$var real 64 % v $end\n\
    $upscope $end\n$enddefinitions $end\n#0\n0!\nbx #\nr1.5 %\n#10\n1!\nb101 #\n#300\nz!\n";

/// Waveforms.
pub(crate) fn waves() -> Vec<Vec<u8>> {
    texts(&[WAVE])
}

/// Words of waveforms.
pub(crate) fn vcd() -> Vec<String> {
    words(&[
        "$timescale 1 ns $end\n",
        "$scope module m $end\n",
        "$upscope $end\n",
        "$var wire 1 \" a $end\n",
        "$var string 1 & s $end\n",
        "$var event 1 * e $end\n",
        "$enddefinitions $end\n",
        "$dumpvars\n",
        "$end\n",
        "$comment x $end\n",
        "#18446744073709551615\n",
        "sabc &\n",
    ])
}

/// Traces of the same instructions as text and as JSON.
pub(crate) fn traces() -> Vec<Vec<u8>> {
    texts(&[
        "emu-trace 1 mcu=atmega328p hz=16000000\n        12  0x0080 <main+0x4>  ldi   r16, 0x05          ; r16=05 SREG=80 write data:0x0024(DDRB)=20\n         9  interrupt 16 T0 ; SP=0ff\n        99  end: halted\n",
        "{\"emu-trace\":1,\"mcu\":\"8051\",\"hz\":12000000}\n{\"cycle\":12,\"addr\":128,\"at\":\"main+0x4\",\"text\":\"nop\",\"regs\":{\"r16\":5},\"data\":[{\"write\":\"data\",\"addr\":36,\"value\":32}]}\n{\"cycle\":99,\"end\":\"x\"}\n",
    ])
}

/// Words of traces.
pub(crate) fn trace() -> Vec<String> {
    words(&[
        "  interrupt ",
        "  end: ",
        "0x",
        " ; ",
        "read ",
        "write ",
        ":0x",
        "=",
        "\"regs\":{",
        "\"data\":[",
        "\"interrupt\":",
        "<",
        ">  ",
    ])
}

/// Expressions, memory locations, times and stimuli.
pub(crate) fn expressions() -> Vec<Vec<u8>> {
    texts(&[
        "PORTB.5 + 1\n$pc == 0x10 && !(r16 & 3)\n*0x100\n-(~1) << 3 % 7\ndata:0x100..0x120\nR0\n",
        "pin PB5=1\npc=main\nread data:0x100\nwrite sfr:P1\ncycle 1000\nuart \"ready\"\nfetch=3\n",
        "10ms\n1000c\n16MHz\n32.768kHz\n2.5us\n1h\n",
        "10ms:PB0=1\nPB0=z\nRA0=1.25V\nVCC=4.5V\nA0=800counts\nI1=1\nP1.0=pullup\n",
        "a\\x41\\n\\\\\\\"\n\\r\\t\\0\n",
    ])
}

/// Words of expressions.
pub(crate) fn expressions_words() -> Vec<String> {
    let spaces = machines::family_chips().flat_map(|chip| chip.spaces.iter().map(|space| format!("{}:", space.name)));
    let registers = machines::family_chips().flat_map(|chip| chip.cpu_regs.iter().map(|name| (*name).to_owned()));
    let pieces = [
        "&&", "||", "<<", ">>", "==", "!=", "..", "0x", "$pc", "$cycle", "pin ", "pc=", "ms", "us", "c:", "=z", "V",
        "counts", "(",
    ];
    spaces.chain(registers).chain(words(&pieces)).collect()
}

/// Command lines, one argument per line.
pub(crate) fn arguments() -> Vec<Vec<u8>> {
    texts(&[
        "run\na.hex\n--mcu\natmega328p\n--for\n2s\n--set\nPB0=1\n--at\n10ms:PB0=0\n--until\npin PB5=1\n--json\n",
        "run\na.elf\n--mcu\natmega8\n--attach\ni2c:24c64@0x50,file=log.bin\n--fuse\nlow=0xe4\n--uart-in\n10ms:hello\\n\n",
        "run\na.hex\n--mcu\npic16f877a\n--config\n0x3F3A\n--corner\nslow\n--peek\ndata:PORTB\n--trace\n-\n--coverage\nc.info\n",
        "check\na.ld\n--mcu\nall\n--scans\n100\n--seed\n3\n--scenario\na.toml\n",
        "debug\na.ld\n--mcu\n8051\n--gdb\n:1234\n--history\n64M\n",
        "sim\na.ld\n--scans\n320\n--at\n21:Xtrigger=1\n--wave\n",
        "wave\na.vcd\n--only\nPB*\n--from\n10ms\n--width\n100\n",
        "lockstep\na.hex\n--mcu\n8051\n--against\ns51\n",
    ])
}

/// Words of command lines.
pub(crate) fn arguments_words() -> Vec<String> {
    words(&[
        "--mcu\n",
        "--for\n",
        "--clock\n",
        "--set\n",
        "--at\n",
        "--until\n",
        "--peek\n",
        "--attach\n",
        "spi:25q32,cs=PB2",
        "i2c:24c01@0x57",
        ",file=x",
        "--fuse\n",
        "--lock\n",
        "--ram\nrandom:1",
        "--vcd-add\n",
        "--trace-only\n",
        "--baud\n",
        "--eeprom\n",
        "--pin\nXa=PD2\n",
        "compile\n",
        "asm\n",
        "disasm\n",
        "fuzz\n",
        "diff\n",
        "draw\n",
        "chips\n",
        "explain\n",
        "dap\n",
        "--only\n",
        "--from\n",
        "--seed\n",
    ])
}

/// Debugger commands after the byte that selects the program.
pub(crate) fn commands() -> Vec<Vec<u8>> {
    let scripts = [
        "step 3\nnext\nstepi 5\nnexti\nfinish\nuntil\nbt\nlist\ndisas\nx/8xb data:0x100\ninfo registers\n",
        "break 0x10\ntbreak 4 if r16 == 3\nwatch r16\nrwatch data:0x100\ncontinue\ninfo breakpoints\ndelete 1\n",
        "scan 3\nrung\nelement\nwhy Yarc\nset Xtrigger = 1\nscan 102\nlast-write Yarc\nreverse-continue\n",
        "run-to-cycle 2000\nreverse-stepi 5\nreverse-step\nreverse-next\ngoto-cycle 10\nlast-write r16 go\nreverse-finish\n",
        "break 2\ncommands\nsilent\nprint $cycle\ncontinue\nend\ncontinue\n\n\n",
        "print /x 1+2*3\nset r16 = 5\ndisplay /t r16\nundisplay\nassert 1\nuntil-pin PB0=1\nreset power\nhelp step\necho a\n",
        "info\ninfo pins\ninfo irq\ninfo history\ninfo symbols\ninfo frame\ninfo line\ncondition 1 r16\nignore 1 3\nquit 3\n",
    ];
    scripts
        .iter()
        .zip(0u8..)
        .flat_map(|(script, n)| (0..6).map(move |of| [&[of + 6 * n][..], script.as_bytes()].concat()))
        .collect()
}

/// Words of debugger commands.
pub(crate) fn commands_words() -> Vec<String> {
    words(&[
        "\nbreak ",
        "\nwatch ",
        "\ncontinue\n",
        "\nstepi 100000\n",
        "\nreverse-continue\n",
        "\ngoto-cycle ",
        "\nx/99i ",
        "\ncommands\n",
        "\nend\n",
        "\nsilent\n",
        "\nfinish\n",
        "\nuntil ",
        "\nset ",
        "\nprint ",
        "\nlast-write ",
        "\nscan 1000\n",
        "\nwhy ",
        "\nlist ",
        "\ndisas ",
        "\ninfo ",
        "\nrun-to-cycle 10ms\n",
        "\ndisplay ",
        "$cycle",
        "$pc",
        "rung 2.1",
        "main.c:3",
        " if ",
        "18446744073709551615",
        "-1",
        "0x7fffffff",
    ])
}

/// Packets after the byte that selects the chip.
pub(crate) fn packets() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    for chip in 0..4u8 {
        for talk in [
            "qSupported:multiprocess+;swbreak+;xmlRegisters=i386\n?\ng\np10\nP10=05\nm100,20\nvCont?\nvCont;s:1\nvCont;c\nbs\nbc\nD",
            "Z0,4,2\nZ2,800100,1\nZ3,800100,1\nvCont;c\nz0,4,2\nM800100,2:0a0b\nX800100,1:a\nG0001\nqXfer:features:read:target.xml:0,ffb\nk",
            "qRcmd,6261636b2039\nqRcmd,676f746f20393939\nqRcmd,7265736574\nqRcmd,7065656b20646174613a302e2e3939\nQStartNoAckMode\nvFlashErase:0,80\nvFlashWrite:0:ab\nvFlashDone\nqXfer:memory-map:read::0,400",
            "vCont;r0,8:1\n!\u{3}\n!-\ns\nc\nHg0\nT1\nqC\nqfThreadInfo\nqAttached\n!$g#00\nvKill;1",
        ] {
            all.push([&[chip][..], talk.as_bytes()].concat());
        }
    }
    all
}

/// Words of gdb's protocol; `qRcmd` takes its command as hexadecimal digits.
pub(crate) fn packets_words() -> Vec<String> {
    let hex = |text: &str| "\nqRcmd,".to_owned() + &text.bytes().map(|byte| format!("{byte:02x}")).collect::<String>();
    let monitor = [
        "set r16=5",
        "print $cycle",
        "history",
        "halt",
        "why",
        "scan",
        "back 5",
        "goto 100",
        "peek PORTB",
        "reset power",
    ]
    .map(hex);
    let packets = [
        "\nZ0,",
        "\nZ1,",
        "\nZ2,",
        "\nz0,",
        "\nvCont;s:1",
        "\nvCont;c",
        "\nvCont;r",
        "\nbs",
        "\nbc",
        "\nm",
        "\nM",
        "\nX",
        "\nqXfer:",
        "ffffffff",
        "800000",
        "810000",
        ",2:",
        "\n!",
    ];
    monitor.into_iter().chain(words(&packets)).collect()
}

const LAUNCH: &str = "{\"command\":\"initialize\",\"arguments\":{\"adapterID\":\"emu\"}}\n";

/// The requests of the transcripts of the tests, in groups of eight, each after a launch.
pub(crate) fn requests() -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    collect_files(&workspace_root().join("emu-dap/tests"), ".txt", &mut files);
    files.sort();
    let mut all = Vec::new();
    for ((_, bytes), n) in files.iter().zip(0..) {
        let text = String::from_utf8_lossy(bytes).into_owned();
        let asks = text.lines().filter_map(|line| line.strip_prefix("> ").or(line.strip_prefix("& ")));
        let asks: Vec<&str> =
            asks.filter(|line| !line.contains("\"launch\"") && !line.contains("\"initialize\"")).collect();
        for stretch in asks.chunks(8) {
            let launch = format!(
                "{LAUNCH}{{\"command\":\"launch\",\"arguments\":{{\"program\":\"{}\",\"stopOnEntry\":true}}}}\n",
                n % 5
            );
            all.push((launch + "{\"command\":\"configurationDone\"}\n" + &stretch.join("\n")).into_bytes());
        }
    }
    all
}

/// Words of the Debug Adapter Protocol: names of requests and of their arguments.
pub(crate) fn requests_words() -> Vec<String> {
    let mut found = BTreeSet::new();
    for seed in requests() {
        for line in String::from_utf8_lossy(&seed).lines() {
            names(&serde_json::from_str(line).unwrap_or_default(), &mut found);
        }
    }
    found.into_iter().collect()
}

fn names(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => fields.iter().for_each(|(name, value)| {
            found.insert(format!("\"{name}\":"));
            names(value, found);
        }),
        Value::Array(items) => items.iter().for_each(|item| names(item, found)),
        Value::String(text) if text.len() < 40 => _ = found.insert(format!("\"{text}\"")),
        _ => {}
    }
}

/// Messages in frames.
pub(crate) fn frames() -> Vec<Vec<u8>> {
    texts(&[
        "Content-Length: 13\r\n\r\n{\"command\":1}Content-Length: 2\r\nContent-Type: x\r\n\r\n{}",
        "content-length:4\n\nnull",
        "Content-Length: 99\r\n\r\n{}",
    ])
}

/// Words of frames.
pub(crate) fn frames_words() -> Vec<String> {
    words(&["Content-Length: ", "\r\n", "\r\n\r\n", "99999999", "{}", "[[[[", "\"\\ud800\"", "1e999"])
}
