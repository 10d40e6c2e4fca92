//! Parameters and variables of C in a stack frame, and the parts of structs, arrays and pointer targets.

use emu_debug::debug::{NamedObject, ObjectExpr};
use serde_json::{Value, json};

use crate::adapter::DapMachine;
use crate::variables::DapVariable;

/// The first reference of frame scopes; each level has two: parameters, and other variables.
pub const FIRST_SCOPE_REFERENCE: i64 = 10_000;

/// The first reference of objects with parts.
const FIRST_OBJECT_REFERENCE: i64 = 1_000_000;

/// Maximum number of objects whose parts a client may request until the machine moves.
const MAX_OBJECTS: usize = 100_000;

/// The scopes of a frame at a level: its variables and its parameters, if it has any.
pub fn scopes(machine: &DapMachine, level: usize) -> Vec<Value> {
    let reference = FIRST_SCOPE_REFERENCE + 2 * i64::try_from(level).unwrap_or(0);
    let (scope, target) = (&machine.session.scope, machine.session.machine());
    let of = |name: &str, hint: &str, parameters: bool| {
        let own = scope.locals(target, level, parameters);
        let reference = reference + i64::from(!parameters);
        (!own.is_empty()).then(
            || json!({ "name": name, "presentationHint": hint, "variablesReference": reference, "expensive": false }),
        )
    };
    of("Locals", "locals", false).into_iter().chain(of("Arguments", "arguments", true)).collect()
}

/// The variables of a reference; `None` if it is not a reference of this module.
pub fn variables_in(machine: &DapMachine, reference: i64, hex: bool) -> Option<Vec<DapVariable>> {
    if reference >= FIRST_OBJECT_REFERENCE {
        let at = usize::try_from(reference - FIRST_OBJECT_REFERENCE).ok()?;
        let (path, object) = machine.expandable_objects.borrow().get(at).cloned()?;
        let text = |name: &str| match name {
            "*" => format!("*({path})"),
            name if name.starts_with('[') => format!("({path}){name}"),
            name if path.is_empty() => name.to_owned(),
            name => format!("({path}).{name}"),
        };
        return Some(
            object
                .parts()
                .into_iter()
                .map(|NamedObject { name, object: part }| variable_of_object(machine, &name, text(&name), part, hex))
                .collect(),
        );
    }
    let number = reference.checked_sub(FIRST_SCOPE_REFERENCE).filter(|number| *number >= 0)?;
    let level = usize::try_from(number / 2).ok()?;
    let found = machine.session.scope.locals(machine.session.machine(), level, number % 2 == 0);
    Some(
        found
            .into_iter()
            .map(|NamedObject { name, object }| variable_of_object(machine, &name, name.clone(), object, hex))
            .collect(),
    )
}

/// The object of a variable, given by its reference and name, so that it can be set.
pub fn object(machine: &DapMachine, reference: i64, name: &str) -> Option<ObjectExpr> {
    let own = |found: Vec<NamedObject>| found.into_iter().find(|known| known.name == name).map(|known| known.object);
    if reference >= FIRST_OBJECT_REFERENCE {
        let at = usize::try_from(reference - FIRST_OBJECT_REFERENCE).ok()?;
        let (_, object) = machine.expandable_objects.borrow().get(at).cloned()?;
        return own(object.parts());
    }
    let number = reference.checked_sub(FIRST_SCOPE_REFERENCE).filter(|number| *number >= 0)?;
    own(machine.session.scope.locals(machine.session.machine(), usize::try_from(number / 2).ok()?, number % 2 == 0))
}

/// An object as a variable of the protocol.
pub fn variable_of_object(
    machine: &DapMachine,
    name: &str,
    text: String,
    object: ObjectExpr,
    hex: bool,
) -> DapVariable {
    let (scope, target) = (&machine.session.scope, machine.session.machine());
    let value = object.text(scope, target, hex.then_some('x'));
    DapVariable {
        name: name.to_owned(),
        value,
        kind: object.type_name().into(),
        memory: machine.memory_reference_of(&object),
        parts: object_reference(machine, &text, &object),
        text,
    }
}

/// A new reference for the parts of an object; 0 if it has none.
pub fn object_reference(machine: &DapMachine, path: &str, object: &ObjectExpr) -> i64 {
    let mut parts = machine.expandable_objects.borrow_mut();
    if parts.len() >= MAX_OBJECTS || object.parts().is_empty() {
        return 0;
    }
    parts.push((path.to_owned(), object.clone()));
    FIRST_OBJECT_REFERENCE + i64::try_from(parts.len() - 1).unwrap_or(0)
}
