; A serial EEPROM on RC3 (SCL) and RC4 (SDA), driven by software: both latches stay 0, TRIS lets go and pulls.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
#define SCL TRISC,3
#define SDA TRISC,4
	udata
byte	res 1
n	res 1
ack	res 1
	global byte, n, ack
start	code 0
	goto main
; All of these are called with bank 1 chosen.
begin	bsf SDA
	nop
	bsf SCL
	nop
	nop
	nop
	bcf SDA
	nop
	nop
	bcf SCL
	return
finish	bcf SDA
	nop
	bsf SCL
	nop
	nop
	nop
	bsf SDA
	return
send	bcf STATUS,RP0		; sends W; ack becomes 0 where it is acknowledged
	movwf byte
	movlw 8
	movwf n
sbit	rlf byte,f
	bsf STATUS,RP0
	bcf SDA
	btfsc STATUS,C
	bsf SDA
	nop
	bsf SCL
	nop
	nop
	bcf SCL
	bcf STATUS,RP0
	decfsz n,f
	goto sbit
	bsf STATUS,RP0
	bsf SDA
	nop
	bsf SCL
	nop
	nop
	bcf STATUS,RP0
	movf PORTC,w
	andlw 0x10
	movwf ack
	bsf STATUS,RP0
	bcf SCL
	return
take	bsf SDA			; takes a byte; acknowledged where bit 0 of W is 1
	bcf STATUS,RP0
	movwf ack
	clrf byte
	movlw 8
	movwf n
tbit	bsf STATUS,RP0
	nop
	bsf SCL
	nop
	nop
	bcf STATUS,RP0
	bcf STATUS,C
	btfsc PORTC,4
	bsf STATUS,C
	rlf byte,f
	bsf STATUS,RP0
	bcf SCL
	bcf STATUS,RP0
	decfsz n,f
	goto tbit
	bsf STATUS,RP0
	bcf STATUS,RP0
	btfss ack,0
	goto nack
	bsf STATUS,RP0
	bcf SDA
nack	bsf STATUS,RP0
	nop
	bsf SCL
	nop
	nop
	bcf SCL
	nop
	bsf SDA
	return
main	bench "break c 20000"
	bench "module library libgpsim_modules"
	bench "module load e24xx024 ee"
	bench "module load pullup u1"
	bench "module load pullup u2"
	bench "module load pulldown d1"
	bench "node scl"
	bench "node sda"
	bench "node low"
	bench "attach scl u1.pin portc3 ee.SCL"
	bench "attach sda u2.pin portc4 ee.SDA"
	bench "attach low d1.pin ee.A0 ee.A1 ee.A2 ee.WP"
	clrf STATUS
	clrf PORTC
	bsf STATUS,RP0
	call begin
	movlw 0xa0
	call send
	must "ack == 0, '*** FAILED acknowledge of the control byte'"
	nop
	movlw 0x1e
	call send
	must "ack == 0, '*** FAILED acknowledge of the address'"
	nop
	movlw 0x11
	call send
	movlw 0x22
	call send
	movlw 0x33		; beyond the end of the page: to 10h
	call send
	must "ack == 0, '*** FAILED acknowledge of data'"
	nop
	call finish
	call wait
	call begin
	movlw 0xa0
	call send
	must "ack == 0, '*** FAILED acknowledge after the write'"
	nop
	movlw 0x1e
	call send
	call finish
	call begin
	movlw 0xa1
	call send
	must "ack == 0, '*** FAILED acknowledge of reading'"
	nop
	movlw 1
	call take
	must "byte == 0x11, '*** FAILED first byte'"
	nop
	movlw 0
	call take
	must "byte == 0x22, '*** FAILED second byte'"
	nop
	call finish
	call begin
	movlw 0xa0
	call send
	movlw 0x10
	call send
	call finish
	call begin
	movlw 0xa1
	call send
	movlw 0
	call take
	must "byte == 0x33, '*** FAILED byte at the beginning of the page'"
	nop
	call finish
	call begin
	movlw 0xa2		; another chip select
	call send
	must "ack == 0x10, '*** FAILED no acknowledge of another address'"
	nop
	call finish
	.direct "a", "'*** PASSED eeprom'"
	goto $
wait	bcf STATUS,RP0
	movlw 0
	movwf n
	decfsz n,f
	goto $-1
	bsf STATUS,RP0
	return
	end
