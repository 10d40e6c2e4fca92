; chip: pic16f628a
; reports: 301 302
	list p=16f628a
	include p16f628a.inc
	__CONFIG _INTRC_OSC_NOCLKOUT & _WDT_OFF & _LVP_OFF & _MCLRE_OFF & _BODEN_ON
	__IDLOCS 0x1234
	constant SDA=0, SCL=1, ADDR=0xA0
	variable n=0, m
	cblock 0x70
	  bits, dat
	endc
	noexpand
sda_hi	macro
	banksel TRISB
	bsf TRISB,SDA
	banksel PORTB
	endm
sda_lo	macro
	banksel TRISB
	bcf TRISB,SDA
	banksel PORTB
	endm
clk	macro n
	local k=0
	while k<n
	bsf PORTB,SCL
	bcf PORTB,SCL
k++
	endw
	endm
outb	macro val
	if val==0
	  messg "zero"
	  clrw
	else
	  if val>0xff
	    error "big"
	  endif
	  movlw val
	endif
	call wrbyte
	exitm
	nop
	endm
	org 0
	goto start
	org 5
start	movlw 7
	movwf CMCON
	sda_hi
	clk 3
	sda_lo
	outb ADDR
	outb 0
	outb ADDR|1
	ifdef __16F628A
	bsf STATUS,RP0
	endif
	ifndef __16F84
	bcf STATUS,RP0
	endif
	ifdef FOO
	goto FOO
	else
	nop
	endif
m=5
n=m*2
	movlw n
#if n == 10
	movlw 1
#else
	movlw 2
#endif
	goto $
wrbyte	movwf dat
	movlw 8
	movwf bits
wr1	rlf dat,f
	btfss STATUS,C
	goto wr0
	sda_hi
	goto wr2
wr0	sda_lo
wr2	clk 1
	decfsz bits,f
	goto wr1
	return
	org 0x2100
	de "EEPROM",0

	end
