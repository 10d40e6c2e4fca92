// What facts.bin sends over USART0 under avr8js, its receiver fed with the same bytes: node avr8js.mjs CYCLES.
import * as avr from 'avr8js';
import { readFileSync } from 'node:fs';

const HZ = 16000000;
const program = new Uint16Array(0x4000).fill(0xffff);
const bytes = new Uint8Array(program.buffer);
bytes.set(readFileSync('facts.bin'));
const cpu = new avr.CPU(program);
for (const port of [avr.portBConfig, avr.portCConfig, avr.portDConfig]) {
	new avr.AVRIOPort(cpu, port);
}
for (const timer of [avr.timer0Config, avr.timer1Config, avr.timer2Config]) {
	new avr.AVRTimer(cpu, timer);
}
const clock = new avr.AVRClock(cpu, HZ);
new avr.AVREEPROM(cpu, new avr.EEPROMMemoryBackend(1024));
new avr.AVRSPI(cpu, avr.spiConfig, HZ);
new avr.AVRTWI(cpu, avr.twiConfig, HZ);
new avr.AVRADC(cpu, avr.adcConfig);
new avr.AVRWatchdog(cpu, avr.watchdogConfig, clock);
const usart = new avr.AVRUSART(cpu, avr.usart0Config, HZ);
usart.onByteTransmit = (byte) => {
	process.stdout.write(String.fromCharCode(byte));
	usart.writeByte(byte, true);
};
while (cpu.cycles < Number(process.argv[2])) {
	avr.avrInstruction(cpu);
	cpu.tick();
}
