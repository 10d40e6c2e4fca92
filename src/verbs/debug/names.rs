//! Candidates for the completion of a word.

use super::commands::COMMANDS;
use super::info;
use super::shell::DebugShell;
use emu_debug::debug::NamedObject;

impl DebugShell {
    /// Returns the names of commands.
    pub fn command_names(&self) -> Vec<String> {
        COMMANDS.iter().map(|command| command.name.to_owned()).collect()
    }

    /// Returns names that can follow a command: registers, pins, symbols, variables of the selected call, and
    /// topics of `info`.
    pub fn names(&self) -> Vec<String> {
        const MANY: usize = 100;
        let scope = &self.session.scope;
        let chip = scope.chip();
        let pins = chip.present_pins().map(|pin| pin.def.name).take(MANY);
        let registers = chip.cpu_regs.iter().copied().chain(chip.regs.iter().map(|reg| reg.name));
        let own = registers.chain(pins).chain(info::names()).map(str::to_owned);
        let symbols = scope.symbols.iter().flat_map(|symbol| {
            let path = symbol.mangled.iter().map(|mangled| mangled.path.clone());
            path.chain([symbol.name.clone()])
        });
        let target = self.session.machine();
        let variables = [true, false].into_iter().flat_map(|own| scope.locals(target, self.level, own));
        let variables = variables.map(|NamedObject { name, .. }| name);
        let ladder = scope.ladder.iter().map(|(name, _)| name.clone());
        let mut names: Vec<String> = own.chain(symbols).chain(variables).chain(ladder).collect();
        names.sort();
        names.dedup();
        names
    }
}
