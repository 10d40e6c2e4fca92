; The serial port on the bench sends back what it gets, and sends by itself.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
start	code 0
	bench ".frequency=20e6"
	bench "break c 100000"
	bench "module library libgpsim_modules"
	bench "module load usart u1"
	bench "u1.txbaud = 9600"
	bench "u1.rxbaud = 9600"
	bench "u1.loop = true"
	bench "node txline"
	bench "node rxline"
	bench "attach txline portc6 u1.RXPIN"
	bench "attach rxline portc7 u1.TXPIN"
	clrf STATUS
	movlw 0xc0
	movwf PORTC
	bsf STATUS,RP0
	bcf TRISC,6
	movlw 129
	movwf SPBRG
	movlw (1<<TXEN)|(1<<BRGH)
	movwf TXSTA
	bcf STATUS,RP0
	movlw (1<<SPEN)|(1<<CREN)
	movwf RCSTA
	movf RCREG,w
	movf RCREG,w
	movlw 0x5a
	movwf TXREG
	btfss PIR1,RCIF
	goto $-1
	must "u1.rx == 0x5a, '*** FAILED byte to the bench'"
	nop
	must "rcreg == 0x5a, '*** FAILED byte sent back'"
	nop
	movf RCREG,w
	must "W == 0x5a, '*** FAILED byte read'"
	nop
	does "u1.tx = 0x81"
	nop
	btfss PIR1,RCIF
	goto $-1
	movf RCREG,w
	must "W == 0x81, '*** FAILED byte from the bench'"
	nop
	.direct "a", "'*** PASSED usart'"
	goto $
	end
