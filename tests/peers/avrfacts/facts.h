/* The names of the facts, and the code that their functions share. Each function returns the value of one fact. */
#include <avr/io.h>
#include <stdint.h>

#define FACT(name) uint16_t f_##name(void)
#define PAUSE(cycles) __builtin_avr_delay_cycles(cycles)
#define BIT(reg, bit) ((reg) >> (bit) & 1)

#define FACTS(X) \
	X(nop) X(add) X(movw) X(adiw) X(mul) X(fmul) X(rjmp) X(ijmp) X(jmp) X(rcall) X(icall) X(call) X(push) \
	X(branch_not) X(branch_taken) X(cpse_0) X(cpse_1) X(cpse_2) X(sbrs_0) X(sbrs_1) X(sbrs_2) X(sbic_0) X(sbic_1) \
	X(sbic_2) X(ld) X(ld_inc) X(ld_dec) X(ldd) X(lds) X(st) X(st_inc) X(std) X(sts) X(lpm) X(lpm_inc) X(in) X(out) \
	X(sbi) X(cbi) X(wdr) \
	X(irq) X(sei) X(out_sreg) X(reti) X(sleep) X(sei_sleep) X(int_level) X(latency) \
	X(irq_multi) X(priority) X(flag_taken) X(wake_down) X(wake_standby) \
	X(pin_next) X(pin_later) X(pin_toggle) X(pin_sbi) X(pull_up) X(pud) X(txd_over) X(int0_own) X(pcint_own) \
	X(tcnt_next) X(tcnt_later) X(tcnt_hides) X(match) X(ctc_period) X(flag_all) X(flag_out) X(flag_sbi) X(tov_ctc) X(tov_top) \
	X(tov_bottom) X(ocr_normal) X(ocr_held) X(ocr_taken) X(ocr_top) X(ocr_bottom) X(temp_latch) X(temp_shared) X(temp_ocr) X(icr_normal) \
	X(tsm) X(psr_before) X(psr_at) X(shared_psr) X(t0_pin) X(t1_pin) X(icp_noise) X(foc) X(foc_pwm) X(pwm_max) X(pwm_bottom) X(as2_busy) X(as2_rate) \
	X(ee_read) X(ee_write) X(ee_window_4) X(ee_window_5) X(ee_both) X(ee_erase) X(ee_only) \
	X(wd_window_4) X(wd_window_5) X(idle) X(power_down) X(wdt) X(wdt_clock) X(wdt_both) X(prr) X(iv_window_4) X(iv_window_5) \
	X(clkpr) X(clkpr_alone) X(clk_window_4) X(clk_window_5) \
	X(udre_first) X(udre_second) X(frame) X(txc_early) X(rx_byte) X(rx_three) X(rx_dor) X(rx_time) X(rx_fe) X(rx_upe) X(rx_glitch) X(rx_mpcm) X(spi) \
	X(adc_first) X(adc_next) X(adc_free) X(adc_trigger) X(adc_edge) X(adc_mux) X(adlar) X(adc_sample) X(adc_lock) \
	X(signature) X(sig_late) X(fuse_high) X(lock_bits) X(spm) X(spm_window_4) X(spm_window_5) X(spm_time) X(spm_busy) \
	X(spm_rww) X(spm_erase) X(spm_write) X(spm_nrww) X(ee_spm)

#define DECLARE(name) FACT(name);
FACTS(DECLARE)

/* In core.S, parts.S and boot.S. */
extern volatile uint16_t wd_at;
extern volatile uint8_t wd_count;
uint16_t awake(void), asleep(void), capture(uint8_t tccr1b), match_after(uint8_t nops), spif_after(uint8_t cycles);
void ee_0(void), ee_2(void), ee_3(void);
uint8_t wd_2(void), wd_3(void), clk_0(void), clk_2(void), clk_3(void);

/*
 * Timer 1 counts from zero with this clock, and all its flags are clear. Counters are written here while they run: the effect
 * of a write to a stopped counter is not part of these facts, and differs between peers.
 */
static inline void stopwatch(uint8_t clock)
{
	TCCR1A = 0;
	TCCR1B = clock;
	TCNT1 = 0;
	TIFR1 = 0x27;
}
