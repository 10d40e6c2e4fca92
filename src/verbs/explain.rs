//! `emu explain`: explains the code of a message.

use clap::Args;

use crate::shared::codes::{all_codes, find_code};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use diag::nearest;

const EXAMPLES: &str = "\
Examples:
  emu explain HEX006     what it means and how to fix it
  emu explain HEX        all codes that begin with HEX
  emu explain            all codes";

/// Maximum number of characters in a line of explanation.
const WIDTH: usize = 100;

/// Flags of `emu explain`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ExplainArgs {
    /// A code such as HEX006, or the first characters of several codes. Default: list all codes.
    #[arg(value_name = "CODE")]
    pub code: Option<String>,
}

/// Explains a code, or lists codes.
pub fn explain(args: &ExplainArgs) -> Result<u8, VerbFailure> {
    let wanted = args.code.as_deref().unwrap_or_default().trim().to_ascii_uppercase();
    let all = all_codes();
    if let Some(code) = find_code(&wanted) {
        output::print(format!("{}: {}\n\n{}", code.code, code.title, wrapped(code.explain)))?;
        return Ok(exit::OK);
    }
    let listed: String =
        all.iter().filter(|c| c.code.starts_with(&wanted)).map(|c| format!("{}  {}\n", c.code, c.title)).collect();
    if listed.is_empty() {
        let near = nearest(&wanted, all.iter().map(|c| c.code));
        let hint = near.map_or("`emu explain` lists all codes".to_owned(), |near| format!("did you mean {near}?"));
        return Err(VerbFailure::Usage(format!("there is no code `{wanted}`; {hint}")));
    }
    output::print(listed)?;
    Ok(exit::OK)
}

fn wrapped(text: &str) -> String {
    let mut out = String::new();
    for paragraph in text.lines() {
        let mut length = 0;
        for word in paragraph.split_whitespace() {
            let size = word.chars().count();
            if length > 0 && length + 1 + size > WIDTH {
                out.push('\n');
                length = 0;
            } else if length > 0 {
                out.push(' ');
                length += 1;
            }
            out.push_str(word);
            length += size;
        }
        out.push('\n');
    }
    out
}
