//! Checks how many arguments an element has.

use diag::Severity;

use crate::codes;
use crate::element_keywords::{ANY_COUNT, ElementKeyword};
use crate::lexer::LdToken;
use crate::model::LadderDialect;
use crate::reader::{LdReader, message_text};

/// Checks the number of arguments, and returns those that the element has: LDmicro 5 reads no word behind
/// them.
///
/// The error marks the first argument too many, or the keyword if there are too few.
pub(crate) fn check_argument_count<'t, 'a>(
    reader: &mut LdReader<'_>,
    row: &ElementKeyword,
    keyword: LdToken<'_>,
    args: &'t [LdToken<'a>],
) -> Option<&'t [LdToken<'a>]> {
    let &(name, mut least, most, syntax) = row;
    // LDmicro 5 takes 0 for the flags of COIL that are missing.
    if name == "COIL" && reader.dialect == LadderDialect::Ldmicro5 {
        least = 1;
    }
    let wanted = if least == most { format!("{least}") } else { format!("{least} to {most}") };
    let wanted = if most == ANY_COUNT { format!("at least {least}") } else { wanted };
    let cause = format!("{name} takes {wanted} argument(s), found {}", args.len());
    if args.len() < least {
        // The syntax is the keyword and the names of the arguments.
        let cause = match syntax.split_whitespace().nth(args.len() + 1) {
            Some(missing) => format!("{cause}: `{missing}` is missing"),
            None => cause,
        };
        reader.error(codes::TOO_FEW, keyword.pos, cause, format!("write {syntax}"));
        return None;
    }
    if let Some(extra) = args.get(most) {
        let hint = format!("write {syntax}");
        if reader.dialect != LadderDialect::Ldmicro5 {
            reader.error(codes::TOO_MANY, extra.pos, cause, hint);
            return None;
        }
        let cause = format!("`{}` follows the arguments of {name} and has no effect", message_text(extra.text));
        reader.report(Severity::Note, codes::TOO_MANY, extra.pos, cause, hint);
    }
    // The last two arguments of these elements are optional, but only as a pair.
    let has_half = matches!(name, "SET_PWM" | "UART_RECV" | "UART_SEND") && args.len() + 1 == most;
    if has_half && !(name == "SET_PWM" && reader.dialect == LadderDialect::Ldmicro5) {
        reader.error(codes::TOO_FEW, keyword.pos, cause, format!("write {syntax}, the last two both or neither"));
        return None;
    }
    if has_half || args.len() < row.1 {
        let (cause, hint) = (format!("{name} has only {} argument(s)", args.len()), format!("write {syntax}"));
        let default = if name == "COIL" { "the missing flags are 0" } else { "the resolution is 0-100" };
        reader.report(Severity::Note, codes::TOO_FEW, keyword.pos, format!("{cause}: {default}"), hint);
    }
    args.get(..args.len().min(most))
}
