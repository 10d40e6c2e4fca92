//! Macros for what is the same text in the machines of several families, but needs the fields of their types.
//! A machine has the chip in `soc`, the registers of the core in `core`, predecoded program memory in `code`,
//! and the settings of its runs in `run_state`.

/// Implements [`CpuParts`](crate::cpu::CpuParts).
#[macro_export]
macro_rules! cpu_parts {
    ($machine:ty, $bus:ty) => {
        impl $crate::cpu::CpuParts for $machine {
            type Bus = $bus;
            #[inline]
            fn bus(&self) -> &$bus {
                &self.soc
            }
            #[inline]
            fn bus_mut(&mut self) -> &mut $bus {
                &mut self.soc
            }
            #[inline]
            fn clock(&self) -> &$crate::countdown::Countdown {
                &self.core.clock
            }
            #[inline]
            fn clock_mut(&mut self) -> &mut $crate::countdown::Countdown {
                &mut self.core.clock
            }
            #[inline]
            fn run_state(&mut self) -> &mut $crate::engine::RunState {
                &mut self.run_state
            }
        }
    };
}

/// Methods of [`Cpu`](crate::cpu::Cpu) for a machine that the shared run loop runs.
#[macro_export]
macro_rules! run_by_engine {
    () => {
        fn run<P: $crate::cpu::Probe>(&mut self, until: u64, probe: &mut P) -> $crate::cpu::StopReason {
            $crate::engine::run(self, until, probe)
        }
        fn step_until<P: $crate::cpu::Probe>(&mut self, until: u64, probe: &mut P) -> $crate::cpu::StopReason {
            $crate::engine::step_until(self, until, probe)
        }
        fn is_asleep(&self) -> bool {
            $crate::engine::CpuEngine::is_core_asleep(self)
        }
        fn is_blocked_on_input(&mut self) -> bool {
            $crate::engine::is_blocked_on_input(self)
        }
    };
}

/// Methods of [`CpuEngine`](crate::engine::CpuEngine).
#[macro_export]
macro_rules! engine_methods {
    () => {
        fn stop_requested(&mut self) -> &mut bool {
            &mut self.core.stop_requested
        }
        fn slow_path_requested(&mut self) -> &mut bool {
            &mut self.core.slow_path_requested
        }
        fn has_breakpoint(&self, pc: u32) -> bool {
            self.code.has_breakpoint(pc)
        }
        fn burst<P: $crate::cpu::Probe>(&mut self, stop_at_polling_loops: bool, probe: &mut P) {
            let $crate::engine::ReadyExecutor { executor, code } = self.executor(probe);
            self.core = executor.burst(&code.ops[usize::from(stop_at_polling_loops)]);
        }
    };
}

/// The hot loop: executes instructions of the executor `$m` until the deadline. `$op` is the op at the
/// program counter, with a kind of the enum `$kinds`, `$pc` is the address that probes get, and `$execute`
/// executes the op. The body is written twice, so that there are two indirect jumps, which the host predicts
/// better than one.
#[macro_export]
macro_rules! burst_loop {
    ($m:ident, $op:ident: $kinds:ident = $fetch:expr, $pc:expr, $execute:block) => {
        while $m.core.clock.is_before_deadline() {
            $crate::burst_loop!(once $m, $op: $kinds = $fetch, $pc, $execute);
            if !$m.core.clock.is_before_deadline() {
                break;
            }
            $crate::burst_loop!(once $m, $op: $kinds = $fetch, $pc, $execute);
        }
    };
    (once $m:ident, $op:ident: $kinds:ident = $fetch:expr, $pc:expr, $execute:block) => {{
        let $op = &$fetch;
        if P::INSN
            && $op.kind as u8 != $kinds::Breakpoint as u8
            && $m.probe.on_instruction($m.core.clock.now(), $pc)
        {
            $m.core.stop_requested = true;
            $m.core.clock.expire();
            break;
        }
        $execute
    }};
}

/// Makes the hot loop stop at an op that it does not execute itself.
#[macro_export]
macro_rules! leave_burst {
    ($m:ident) => {{
        $m.core.slow_path_requested = true;
        $m.core.clock.expire();
    }};
}
