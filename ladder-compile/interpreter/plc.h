/* An interpreter for ladder programs as byte code: `emu compile PROGRAM.ld --emit bytecode`. docs/emit.md has the format. */
#ifndef PLC_H
#define PLC_H

/* Room for the bits and the integers of a program: one bit and five bytes of RAM each. */
#ifndef PLC_MAX_BITS
#define PLC_MAX_BITS 256
#endif
#ifndef PLC_MAX_WORDS
#define PLC_MAX_WORDS 64
#endif

/* Takes an image; it stays where it is (on an AVR in program memory). 0, or 1 where it is no byte code of this version, or 2
   where it has more bits or integers than there is room for. PlcInit comes next. */
unsigned char PlcLoad(const unsigned char *image);
/* Once, before the first scan: everything is as after power-up. */
void PlcInit(void);
/* One scan. */
void PlcCycle(void);

/* What the image says: microseconds from scan to scan; bits per second and Hz, 0 where there is no such thing. */
extern unsigned long PlcCycleUs, PlcBaud, PlcPwmHz;
/* Numbers of inputs (the first bits), outputs (the bits behind them), analog inputs, all bits, integers, cells of EEPROM. */
extern unsigned PlcInputs, PlcOutputs, PlcAnalog, PlcBits, PlcWords, PlcCells;

/* The state, to look at and to change between scans. */
unsigned char PlcGetBit(unsigned bit);
void PlcSetBit(unsigned bit, unsigned char on);
long PlcGetWord(unsigned word);
void PlcSetWord(unsigned word, long value);

/* You write these; those that no program of yours uses may do nothing. */

/* The level of an input now, 0 or 1. */
unsigned char PlcReadInput(unsigned input);
/* An output becomes 0 or 1. */
void PlcWriteOutput(unsigned output, unsigned char on);
/* The conversion of an analog input now, 0 to 1023. */
int PlcReadAdc(unsigned input);
/* The duty of the PWM output, 0 to 100 percent. */
void PlcSetPwm(unsigned char percent);
/* A byte goes out; the one before it has had its time. */
void PlcSendByte(unsigned char byte);
/* Returns when the last byte has gone. */
void PlcWaitSent(void);
/* Takes the byte that has been received, 0 to 255; -1 when there is none. */
int PlcReceiveByte(void);
/* A register of a device on the I2C bus; FFh if none answers. */
void PlcI2cWrite(unsigned char device, unsigned char reg, unsigned char byte);
unsigned char PlcI2cRead(unsigned char device, unsigned char reg);
/* A byte goes out on the SPI bus, and one comes in. */
unsigned char PlcSpi(unsigned char byte);
/* A cell of EEPROM; a write begins and has some ms to end before the next. */
unsigned char PlcReadEeprom(unsigned cell);
void PlcWriteEeprom(unsigned cell, unsigned char byte);

#endif
