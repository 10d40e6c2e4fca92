//! Resolves the lines of Instruction List to the flat form.

use ladder::il::{BlockCall, IecType, IlAction, IlSource, IlStep, TypedSymbol};

use crate::UnsupportedReason;
use crate::flatten::FlatBuilder;
use crate::il_blocks::FlatBlock;
use crate::il_functions::FlatFunction;
use crate::il_ops::{FlatOperand, IlCall, IlOp, IlTarget, NumberType};

impl FlatBuilder<'_> {
    /// Resolves a line; its number is that of its operation.
    pub(crate) fn line(&mut self, step: &IlStep) -> Result<u32, UnsupportedReason> {
        let op = match &step.action {
            IlAction::Nothing => IlOp::Nothing,
            IlAction::Load { negated, source, iec_type } => {
                IlOp::Load { negated: *negated, value: self.il_value(source)?, number: number_type(iec_type) }
            }
            IlAction::Store { negated, target } => IlOp::Store { negated: *negated, target: self.il_target(target)? },
            IlAction::Set(target) => IlOp::Set { symbol: self.symbol_index(&target.name)?, value: true },
            IlAction::Reset(target) => IlOp::Set { symbol: self.symbol_index(&target.name)?, value: false },
            IlAction::Not { iec_type } => IlOp::Not { number: number_type(iec_type) },
            IlAction::Binary { operator, negated, source, iec_type } => IlOp::Binary {
                operator: *operator,
                negated: *negated,
                value: self.il_value(source)?,
                number: number_type(iec_type),
            },
            IlAction::Open { source, iec_type } => {
                let number = iec_type.as_ref().map_or(NumberType::BIT, number_type);
                let loaded = source.as_ref().map(|source| self.il_value(source)).transpose()?;
                IlOp::Open { loaded: loaded.map(|value| (value, number)) }
            }
            IlAction::Close { operator, negated, iec_type } => {
                IlOp::Close { operator: *operator, negated: *negated, number: number_type(iec_type) }
            }
            IlAction::Jump { condition, target, .. } => {
                IlOp::Jump { condition: *condition, to: *target, is_back: *target <= self.next.rung }
            }
            IlAction::Return(condition) => IlOp::Return { condition: *condition },
            IlAction::Call { condition, call } => {
                IlOp::Call { condition: *condition, call: Box::new(self.il_call(call)?) }
            }
            IlAction::Function(call) => IlOp::Function(FlatFunction {
                function: call.function,
                arguments: call.arguments.iter().map(|source| self.il_value(source)).collect::<Result<_, _>>()?,
                number: number_type(&call.iec_type),
                result: number_type(&call.result),
            }),
        };
        self.code.lines.push(op);
        Ok(self.code.lines.len() as u32 - 1)
    }

    fn il_value(&self, source: &IlSource) -> Result<FlatOperand, UnsupportedReason> {
        Ok(match source {
            IlSource::Result => FlatOperand::Result,
            IlSource::Constant(value) => FlatOperand::Constant(*value),
            IlSource::Symbol(symbol) => {
                FlatOperand::Symbol(self.symbol_index(&symbol.name)?, number_type(&symbol.iec_type))
            }
        })
    }

    fn il_target(&self, symbol: &TypedSymbol) -> Result<IlTarget, UnsupportedReason> {
        Ok(IlTarget { symbol: self.symbol_index(&symbol.name)?, number: number_type(&symbol.iec_type) })
    }

    fn il_call(&mut self, call: &BlockCall) -> Result<IlCall, UnsupportedReason> {
        if call.block.is_timer() {
            let cycle = self.program.settings.cycle_us;
            if cycle == 0 || !cycle.is_multiple_of(1_000) {
                return Err(UnsupportedReason::FractionalCycle { cycle_us: cycle });
            }
            self.code.cycle_ms = (cycle / 1_000) as u32;
        }
        let names = call.block.parts().iter().filter_map(|part| call.part(part.name));
        let parts = names.map(|part| self.symbol_index(&part.name)).collect::<Result<_, _>>()?;
        let next = self.instances.len() as u32;
        let instance = *self.instances.entry(call.instance.clone()).or_insert(next);
        self.code.instances = self.code.instances.max(instance + 1);
        let inputs = call.inputs.iter().map(|(part, source)| Ok((self.il_target(part)?, self.il_value(source)?)));
        let outputs = call.outputs.iter().map(|output| {
            let symbol = self.symbol_index(&output.part.name)?;
            let number = number_type(&output.part.iec_type);
            Ok((symbol, number, output.negated, self.il_target(&output.target)?))
        });
        Ok(IlCall {
            inputs: inputs.collect::<Result<_, UnsupportedReason>>()?,
            block: FlatBlock { block: call.block, instance, parts },
            outputs: outputs.collect::<Result<_, UnsupportedReason>>()?,
        })
    }
}

/// The numbers of a type (I1).
fn number_type(iec_type: &IecType) -> NumberType {
    let (bits, signed) = match iec_type {
        IecType::Sint => (8, true),
        IecType::Usint | IecType::Byte => (8, false),
        IecType::Int => (16, true),
        IecType::Uint | IecType::Word => (16, false),
        IecType::Dint | IecType::Time => (32, true),
        IecType::Udint | IecType::Dword => (32, false),
        IecType::Bool | IecType::Block(_) | IecType::Named(_) => (1, false),
    };
    NumberType { bits, signed }
}
