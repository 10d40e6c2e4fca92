//! The JUnit and HTML reports are well-formed, complete, and consistent with the outcomes.

use crate::common;
use emu_check::{CheckOptions, CheckOutcome, RefusedCheck, ReportEntry, check, check_compiled, html_report, junit};

/// The tag names in order; panics if a tag is not closed or a text is not escaped.
fn tags(text: &str) -> Vec<String> {
    let (mut open, mut all, mut rest) = (Vec::new(), Vec::new(), text);
    while let Some(at) = rest.find('<') {
        for (n, _) in rest[..at].match_indices('&') {
            let known = ["&amp;", "&lt;", "&gt;", "&quot;", "&#39;", "&apos;"];
            assert!(known.iter().any(|entity| rest[n..].starts_with(entity)), "{}", &rest[n..n + 20]);
        }
        let end = at + rest[at..].find('>').expect("an end of the tag");
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        if tag.starts_with(['?', '!']) {
            continue;
        }
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name), "{tag}");
            continue;
        }
        assert!(tag.matches('"').count().is_multiple_of(2), "{tag}");
        let name = tag.trim_end_matches('/').split_whitespace().next().expect("a name").to_owned();
        all.push(name.clone());
        if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    all
}

/// A program that agrees, one with the image of another program, and one that is refused; names contain XML
/// special characters.
#[test]
fn documents_are_well_formed_and_complete() {
    let text = |negated: &str| {
        format!("RUNG\n COMMENT a < b & \"c\"\n CONTACTS Xa 0\n TON Ta 3000\n COIL Ya {negated} 0 0\nEND")
    };
    let good = common::rungs("a<b>&\"c\".ld", &text("0"));
    let options = CheckOptions { scans: 60, ..CheckOptions::default() };
    let target =
        ladder_compile::CompileOptions { mcu: options.mcu.clone(), ..ladder_compile::CompileOptions::default() };
    let broken = ladder_compile::compile(&common::rungs("b.ld", &text("1")), &target).expect("an image");
    let agreed = check(&good, &options, &mut |_, _| {}).expect("a report");
    let differs = check_compiled(&good, &broken, &options, &mut |_, _| {}).expect("a report");
    let errors =
        check(&good, &CheckOptions { mcu: "z80".to_owned(), ..options.clone() }, &mut |_, _| {}).expect_err("none");
    let refused = RefusedCheck { program: good.file.clone(), mcu: "z80".to_owned(), errors };
    let outcomes = [
        CheckOutcome::Checked(Box::new(agreed)),
        CheckOutcome::Checked(Box::new(differs)),
        CheckOutcome::Refused(refused),
    ];

    let xml = junit(&outcomes).expect("a document");
    let found = tags(&xml);
    let count = |name: &str| found.iter().filter(|tag| *tag == name).count();
    assert_eq!((count("testcase"), count("failure"), count("skipped")), (3, 1, 1), "{xml}");
    assert!(xml.contains("tests=\"3\" skipped=\"1\" failures=\"1\" errors=\"0\""), "{xml}");

    let entry = |(outcome, compiled)| ReportEntry { program: &good, options: &options, compiled, outcome };
    let page = html_report(&outcomes.iter().zip([None, Some(&broken), None]).map(entry).collect::<Vec<_>>());
    let found = tags(&page);
    let count = |name: &str| found.iter().filter(|tag| *tag == name).count();
    // Two drawings (names and waveforms) for each of the two programs that were checked, and one heading
    // each.
    assert_eq!((count("svg"), count("h2")), (4, 3), "{page}");
    // The page is self-contained: no script, and no style or picture from elsewhere.
    for tag in ["script", "link", "img", "iframe", "object", "use"] {
        assert_eq!(count(tag), 0, "{tag}");
    }
    assert_eq!(page.matches("://").count(), page.matches("http://www.w3.org/2000/svg").count(), "{page}");
    assert!(!page.contains("url(") && !page.contains("@import"), "{page}");
    for (wanted, times) in [
        // In the overview table and in the section of the program.
        (">DIFFERS<", 2),
        (">agrees<", 2),
        (">refused<", 2),
        ("--seed 1 --scans", 2),
        // The program is drawn once for all chips.
        ("<h3 id=\"program-1\">", 1),
        ("href=\"#program-1\"", 1),
        // The output differs in the last scan of the run, and the coil is to blame.
        ("class=\"bad\"", 1),
        ("class=\"first\"", 1),
        ("0 expected, 1 found", 1),
        ("<mark>( )</mark>", 1),
    ] {
        assert_eq!(page.matches(wanted).count(), times, "{wanted}: {page}");
    }
    assert!(page.contains("a&lt;b&gt;&amp;&quot;c&quot;.ld"), "{page}");
    let of_one =
        html_report(&[ReportEntry { program: &good, options: &options, compiled: None, outcome: &outcomes[0] }]);
    let found = tags(&of_one);
    let count = |name: &str| found.iter().filter(|tag| *tag == name).count();
    assert_eq!((count("h1"), count("h2"), count("svg")), (1, 0, 2), "{of_one}");
}

/// All numbers of a drawing, such as line ends, are within it, also if a run differs in its first scan.
#[test]
fn drawings_show_all_that_is_in_them() {
    let long = format!("X{}", "n".repeat(40));
    let good = common::rungs("a.ld", &format!("RUNG\n CONTACTS {long} 0\n COIL Ya 1 0 0\nEND"));
    let bad = common::rungs("a.ld", &format!("RUNG\n CONTACTS {long} 0\n COIL Ya 0 0 0\nEND"));
    let options = CheckOptions { scans: 60, ..CheckOptions::default() };
    let target =
        ladder_compile::CompileOptions { mcu: options.mcu.clone(), ..ladder_compile::CompileOptions::default() };
    let broken = ladder_compile::compile(&bad, &target).expect("an image");
    let report = check_compiled(&good, &broken, &options, &mut |_, _| {}).expect("a report");
    assert_eq!(report.scans, 1, "it differs at once");
    let outcome = CheckOutcome::Checked(Box::new(report));
    let page =
        html_report(&[ReportEntry { program: &good, options: &options, compiled: Some(&broken), outcome: &outcome }]);
    let mut drawings = 0;
    for svg in page.split("<svg").skip(1).filter_map(|rest| rest.split("</svg>").next()) {
        let number = |text: &str, name: &str| -> Option<f64> {
            let (_, rest) = text.split_once(&format!(" {name}=\""))?;
            rest.split('"').next()?.parse().ok()
        };
        let width = number(svg, "width").expect("a width");
        for text in svg.split("<text").skip(1) {
            let body = text.split_once("</text>").map_or(text, |(body, _)| body);
            let shown = body.rsplit('>').next().expect("text").chars().count() as f64;
            let (x, room) = (number(text, "x").expect("a place"), 7.2 * shown);
            let (from, to) = match () {
                () if text.contains("class=\"range\"") => (x - room, x),
                () if text.contains("class=\"axis\"") => (x - room / 2.0, x + room / 2.0),
                () => (x, x + room),
            };
            assert!(from >= 0.0 && to <= width, "{width}: {body}");
        }
        drawings += 1;
    }
    assert_eq!(drawings, 2, "{page}");
}
