//! Parameters and variables of C in a frame, and the parts of structs, arrays and what pointers point to.

use emu_debug::debug::ObjectExpr;
use serde_json::{Value, json};

use crate::adapter::Machine;
use crate::variables::Variable;

/// The first reference of scopes of frames; two for each level: parameters, then other variables.
pub const SCOPES: i64 = 10_000;

/// The first reference of objects that have parts.
const OBJECTS: i64 = 1_000_000;

/// Most objects of which a client may ask the parts before the machine moves.
const MOST: usize = 100_000;

/// The scopes of a frame at a level: its parameters and its variables, as far as there are any.
pub fn scopes(machine: &Machine, level: usize) -> Vec<Value> {
    let reference = SCOPES + 2 * i64::try_from(level).unwrap_or(0);
    let (scope, target) = (&machine.session.scope, machine.session.target());
    let of = |name: &str, hint: &str, parameters: bool| {
        let own = scope.locals(target, level, parameters);
        let reference = reference + i64::from(!parameters);
        (!own.is_empty()).then(
            || json!({ "name": name, "presentationHint": hint, "variablesReference": reference, "expensive": false }),
        )
    };
    of("Locals", "locals", false).into_iter().chain(of("Arguments", "arguments", true)).collect()
}

/// The variables behind a reference; nothing where it is none of these.
pub fn inside(machine: &Machine, reference: i64, hex: bool) -> Option<Vec<Variable>> {
    if reference >= OBJECTS {
        let at = usize::try_from(reference - OBJECTS).ok()?;
        let (path, object) = machine.parts.borrow().get(at).cloned()?;
        let text = |name: &str| match name {
            "*" => format!("*({path})"),
            name if name.starts_with('[') => format!("({path}){name}"),
            name if path.is_empty() => name.to_owned(),
            name => format!("({path}).{name}"),
        };
        return Some(
            object.parts().into_iter().map(|(name, part)| variable(machine, &name, text(&name), part, hex)).collect(),
        );
    }
    let number = reference.checked_sub(SCOPES).filter(|number| *number >= 0)?;
    let level = usize::try_from(number / 2).ok()?;
    let found = machine.session.scope.locals(machine.session.target(), level, number % 2 == 0);
    Some(found.into_iter().map(|(name, object)| variable(machine, &name, name.clone(), object, hex)).collect())
}

/// The object of a variable behind a reference by its name, so that it can be set.
pub fn object(machine: &Machine, reference: i64, name: &str) -> Option<ObjectExpr> {
    let own =
        |found: Vec<(String, ObjectExpr)>| found.into_iter().find(|(known, _)| known == name).map(|(_, object)| object);
    if reference >= OBJECTS {
        let at = usize::try_from(reference - OBJECTS).ok()?;
        let (_, object) = machine.parts.borrow().get(at).cloned()?;
        return own(object.parts());
    }
    let number = reference.checked_sub(SCOPES).filter(|number| *number >= 0)?;
    own(machine.session.scope.locals(machine.session.target(), usize::try_from(number / 2).ok()?, number % 2 == 0))
}

/// A variable as a client sees it.
pub fn variable(machine: &Machine, name: &str, text: String, object: ObjectExpr, hex: bool) -> Variable {
    let (scope, target) = (&machine.session.scope, machine.session.target());
    let value = object.text(scope, target, hex.then_some('x'));
    Variable {
        name: name.to_owned(),
        value,
        kind: object.kind_text().into(),
        memory: machine.memory_of(&object),
        parts: reference(machine, &text, &object),
        text,
    }
}

/// A reference by which a client asks for the parts of an object; 0 where it has none.
pub fn reference(machine: &Machine, path: &str, object: &ObjectExpr) -> i64 {
    let mut parts = machine.parts.borrow_mut();
    if parts.len() >= MOST || object.parts().is_empty() {
        return 0;
    }
    parts.push((path.to_owned(), object.clone()));
    OBJECTS + i64::try_from(parts.len() - 1).unwrap_or(0)
}
