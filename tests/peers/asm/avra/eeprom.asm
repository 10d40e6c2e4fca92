; chip: atmega8
.include "m8def.inc"
.equ FCK=8000000
.equ addr=0x50
.def AL=r16
.def AH=r17
.def wr=r18
.org 0
rjmp Main
.org INT0addr
reti
.org 0x13
Main: ldi AL,low(RAMEND)
out SPL,AL
ldi AL,high(RAMEND)
out SPH,AL
ldi AL,(1<<DDB0)|(1<<DDB1)
out DDRB,AL
rcall EERead
cpi wr,0xFF
brne go
ldi wr,10
rcall EEWrite
go: rcall i2c_start
rcall disp
rjmp go
EERead: sbic EECR,EEWE
rjmp EERead
out EEARL,AL
sbi EECR,EERE
in wr,EEDR
ret
EEWrite: sbic EECR,EEWE
rjmp EEWrite
out EEDR,wr
sbi EECR,EEMWE
sbi EECR,EEWE
ret
i2c_start: ldi AL,(1<<TWINT)|(1<<TWSTA)|(1<<TWEN)
out TWCR,AL
w1: in AL,TWCR
sbrs AL,TWINT
rjmp w1
ret
disp: ldi ZH,high(seg*2)
ldi ZL,low(seg*2)
add ZL,AL
brcc d1
inc ZH
d1: lpm
mov AL,r0
com AL
out PORTD,AL
ret
seg: .db 0b00111111,0b00000110,0x5B,0x4F,$66,0x6D,0x7D,7,127,111
.org PAGESIZE*4
	nop
.org FLASHEND-3
	.dw SRAM_START, FLASHEND, E2END
