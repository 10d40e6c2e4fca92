//! The chip around the core (ports, timers, serial port): being written.
use emu_core::cpu::*; use emu_core::pins::*; use emu_core::chip::Chip;
#[derive(Debug, Clone)] pub struct Soc { gpior: [u8;256] }
#[derive(Debug,Clone,Copy)] pub enum SleepMode { Idle }
impl Soc {
 pub fn new(_: &'static Chip)->Soc{Soc{gpior:[0;256]}}
 pub fn set_clock_hz(&mut self,_:u64){}
 pub fn reset(&mut self,_:Reset,_:u64){}
 pub fn drive(&mut self,_:u64,_:u64,_:PinId,_:Level){}
 pub fn level(&self,_:PinId)->Level{Level::Low}
 pub fn log(&mut self,_:bool){}
 pub fn drain(&mut self)->Option<Event>{None}
 pub fn sleep_enabled(&self)->Option<SleepMode>{ if self.gpior[0x53]&1==1 {Some(SleepMode::Idle)} else {None} }
 pub fn clear_watchdog(&mut self,_:u64){}
 pub fn reset_requested(&mut self,_:u64)->bool{false}
}
impl Bus for Soc {
 fn read(&mut self, r:u16,_:u64)->(u8,Wake){(self.gpior[r as usize&255],Wake::NONE)}
 fn peek(&self, r:u16,_:u64)->u8{self.gpior[r as usize&255]}
 fn write(&mut self, r:u16,v:u8,_:u64)->Wake{self.gpior[r as usize&255]=v;Wake::NONE}
 fn write_bits(&mut self, r:u16,m:u8,v:u8,_:u64)->Wake{let x=&mut self.gpior[r as usize&255];*x=*x&!m|v&m;Wake::NONE}
 fn fire(&mut self,_:u64)->u64{NEVER}
 fn steady_until(&self,_:u16,n:u64)->u64{n}
 fn pending(&self,_:u64)->Option<u8>{None}
 fn take(&mut self,_:u8,_:u64){}
 fn can_wake(&self,_:bool)->bool{false}
 fn busy(&self)->bool{false}
}
