//! Keys of the keyboard, and their names in key scripts.

use std::time::Duration;

use crate::TuiError;

/// A key of the keyboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ScreenKey {
    /// A character, as typed: `a`, `A`, `!`.
    Char(char),
    /// A character with the Alt key held.
    Alt(char),
    /// A character with the Ctrl key held.
    Ctrl(char),
    /// Enter or Return.
    Enter,
    /// Escape.
    Escape,
    /// The Backspace key.
    Backspace,
    /// The Tab key.
    Tab,
    /// Cursor up.
    Up,
    /// Cursor down.
    Down,
    /// Cursor left.
    Left,
    /// Cursor right.
    Right,
    /// Page up.
    PageUp,
    /// Page down.
    PageDown,
    /// Home.
    Home,
    /// End.
    End,
}

/// The names of keys in scripts.
#[rustfmt::skip]
const KEY_NAMES: [(&str, ScreenKey); 14] = [
    ("space", ScreenKey::Char(' ')), ("enter", ScreenKey::Enter), ("esc", ScreenKey::Escape), ("backspace", ScreenKey::Backspace), ("tab", ScreenKey::Tab),
    ("up", ScreenKey::Up), ("down", ScreenKey::Down), ("left", ScreenKey::Left), ("right", ScreenKey::Right),
    ("pgup", ScreenKey::PageUp), ("pgdn", ScreenKey::PageDown), ("home", ScreenKey::Home), ("end", ScreenKey::End), ("ctrl-c", ScreenKey::Ctrl('c')),
];

/// Maximum number of steps in a key script.
const MAX_STEPS: usize = 1_000_000;

/// A step of a key script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScriptStep {
    /// A key is pressed.
    Key(ScreenKey),
    /// This time passes.
    Wait(Duration),
}

/// Parses a key script of words: a character (`1`, `g`), the name of a key (`space`, `enter`, `pgdn`),
/// `alt-1`, `ctrl-c`, `:TEXT` (a command line with its Enter), `wait:500ms`. A star and a number after a word
/// repeat it, as in `space*20`.
///
/// # Errors
/// The first word that is not valid or is repeated too often.
pub fn parse_keys(text: &str) -> Result<Vec<ScriptStep>, TuiError> {
    let mut steps = Vec::new();
    for word in text.split_whitespace() {
        let (name, times) = match word.rsplit_once('*') {
            Some((name, times)) if !name.is_empty() => {
                let times = times.parse::<usize>().ok().filter(|times| (1..=MAX_STEPS).contains(times));
                (name, times.ok_or_else(|| TuiError::BadRepetition { word: word.to_owned(), most: MAX_STEPS })?)
            }
            _ => (word, 1),
        };
        let one = parse_word(name)?;
        if steps.len() + one.len() * times > MAX_STEPS {
            return Err(TuiError::TooManyKeys { word: word.to_owned(), most: MAX_STEPS });
        }
        (0..times).for_each(|_| steps.extend(&one));
    }
    Ok(steps)
}

/// Parses one word without its repetition count.
fn parse_word(word: &str) -> Result<Vec<ScriptStep>, TuiError> {
    let mut letters = word.chars();
    if let (Some(only), None) = (letters.next(), letters.next()) {
        return Ok(vec![ScriptStep::Key(ScreenKey::Char(only))]);
    }
    let (head, rest) = word.split_at(word.find(['-', ':']).map_or(word.len(), |at| at + 1));
    let mut rest_letters = rest.chars();
    let only = rest_letters.next().filter(|_| rest_letters.next().is_none());
    match (head, only) {
        ("alt-", Some(c)) => return Ok(vec![ScriptStep::Key(ScreenKey::Alt(c))]),
        ("ctrl-", Some(c)) => return Ok(vec![ScriptStep::Key(ScreenKey::Ctrl(c))]),
        ("wait:", _) => {
            let time = parse_time(rest).ok_or_else(|| TuiError::BadPause { word: word.to_owned() })?;
            return Ok(vec![ScriptStep::Wait(time)]);
        }
        _ => {}
    }
    if word.starts_with(':') {
        let typed = word.chars().map(ScreenKey::Char).chain([ScreenKey::Enter]);
        return Ok(typed.map(ScriptStep::Key).collect());
    }
    let named = KEY_NAMES.iter().find(|(name, _)| *name == word);
    named.map(|(_, key)| vec![ScriptStep::Key(*key)]).ok_or_else(|| TuiError::UnknownKey { word: word.to_owned() })
}

/// The names of all keys, for messages.
pub(crate) fn key_names() -> String {
    let names: Vec<&str> = KEY_NAMES.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Parses a time in ms or s, at most one hour.
fn parse_time(text: &str) -> Option<Duration> {
    let (digits, unit) = text.split_at(text.find(|c: char| !c.is_ascii_digit())?);
    let number: u64 = digits.parse().ok()?;
    let ms = match unit {
        "ms" => number,
        "s" => number.checked_mul(1_000)?,
        _ => return None,
    };
    (ms <= 3_600_000).then(|| Duration::from_millis(ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words() {
        let wait = ScriptStep::Wait(Duration::from_millis(500));
        let key = |c| ScriptStep::Key(ScreenKey::Char(c));
        assert_eq!(parse_keys("space 1*2 *"), Ok(vec![key(' '), key('1'), key('1'), key('*')]));
        assert_eq!(parse_keys("wait:500ms alt-x"), Ok(vec![wait, ScriptStep::Key(ScreenKey::Alt('x'))]));
        assert_eq!(
            parse_keys(":a=1 up"),
            Ok(vec![
                key(':'),
                key('a'),
                key('='),
                key('1'),
                ScriptStep::Key(ScreenKey::Enter),
                ScriptStep::Key(ScreenKey::Up)
            ])
        );
        for wrong in
            ["spce", "space*0", "space*x", "wait:5", "wait:4000s", "1*1000001", "alt-", "ctrl-xy", "1*999999 1*2"]
        {
            assert!(parse_keys(wrong).is_err(), "{wrong}");
        }
    }
}
