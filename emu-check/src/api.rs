use ladder_eval::Evaluator;
pub(crate) trait Api {
    fn set_adc(&mut self, _: usize, _: u16) {}
    fn adc_symbols(&self) -> std::vec::IntoIter<usize> { Vec::new().into_iter() }
    fn receive(&mut self, _: u8) -> bool { false }
    fn waiting(&self) -> bool { false }
    fn sent(&self) -> Option<u8> { None }
    fn uart_busy(&self) -> u32 { 0 }
    fn pwm(&self) -> Option<u8> { None }
    fn pwm_hz(&self) -> Option<u32> { None }
    fn eeprom(&self) -> &[u8] { &[] }
    fn set_eeprom(&mut self, _: usize, _: u8) {}
    fn eeprom_busy(&self) -> u32 { 0 }
}
impl Api for Evaluator {}
pub(crate) trait Wide { fn bytes(&self) -> u8; }
impl Wide for ladder::Symbol { fn bytes(&self) -> u8 { if self.kind.is_bit() { 0 } else { 2 } } }
