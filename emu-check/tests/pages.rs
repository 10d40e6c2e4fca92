//! JUnit and HTML: well-formed, complete, and true to the outcomes.

mod common;

use emu_check::{Entry, Options, Outcome, Refused, check, check_compiled, html, junit};

/// Names of the elements in order of their starts; panics where a tag is not closed or a text is not escaped.
fn tags(text: &str) -> Vec<String> {
    let (mut open, mut all, mut rest) = (Vec::new(), Vec::new(), text);
    while let Some(at) = rest.find('<') {
        for (n, _) in rest[..at].match_indices('&') {
            let known = ["&amp;", "&lt;", "&gt;", "&quot;", "&#39;"];
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

/// A program that agrees, one whose image is of another, and one that is refused; names hold what has a meaning in XML.
#[test]
fn documents_are_well_formed_and_complete() {
    let text = |negated: &str| {
        format!("RUNG\n COMMENT a < b & \"c\"\n CONTACTS Xa 0\n TON Ta 3000\n COIL Ya {negated} 0 0\nEND")
    };
    let good = common::rungs("a<b>&\"c\".ld", &text("0"));
    let options = Options { scans: 60, ..Options::default() };
    let target = ladder_compile::Options { mcu: options.mcu.clone(), ..ladder_compile::Options::default() };
    let broken = ladder_compile::compile(&common::rungs("b.ld", &text("1")), &target).expect("an image");
    let agreed = check(&good, &options, &mut |_, _| {}).expect("a report");
    let differs = check_compiled(&good, &broken, &options, &mut |_, _| {}).expect("a report");
    let errors = check(&good, &Options { mcu: "z80".to_owned(), ..options.clone() }, &mut |_, _| {}).expect_err("none");
    let refused = Refused { program: good.file.clone(), mcu: "z80".to_owned(), errors };
    let outcomes = [Outcome::Checked(Box::new(agreed)), Outcome::Checked(Box::new(differs)), Outcome::Refused(refused)];

    let xml = junit(&outcomes);
    let found = tags(&xml);
    let count = |name: &str| found.iter().filter(|tag| *tag == name).count();
    assert_eq!((count("testcase"), count("failure"), count("skipped")), (3, 1, 1), "{xml}");
    assert!(xml.contains("tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"1\""), "{xml}");

    let entries: Vec<Entry<'_>> =
        outcomes.iter().map(|outcome| Entry { program: &good, options: &options, outcome }).collect();
    let page = html(&entries);
    let found = tags(&page);
    let count = |name: &str| found.iter().filter(|tag| *tag == name).count();
    // Names and lines of each of the two that were checked; a heading each.
    assert_eq!((count("svg"), count("h2")), (4, 3), "{page}");
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org/2000/svg").count()
    );
    for wanted in
        ["DIFFERS", "agrees", "refused", "--seed 1 --scans", "class=\"expected\"", "a&lt;b&gt;&amp;&quot;c&quot;.ld"]
    {
        assert!(page.contains(wanted), "{wanted}");
    }
}
