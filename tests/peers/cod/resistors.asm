; Resistors on nets: an input follows them, an output is stronger, pins of one net follow each other.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
start	code 0
	bench "break c 2000"
	bench "module library libgpsim_modules"
	bench "module load pullup up"
	bench "module load pulldown down"
	bench "up.resistance = 10000.0"
	bench "down.resistance = 4700.0"
	bench "up.xpos = 24.0"
	bench "node high"
	bench "attach high up.pin portb0 portc0"
	bench "node low"
	bench "attach low down.pin portb1 portc1"
	clrf STATUS
	clrf PORTB
	clrf PORTC
	must "(portb & 3) == 1, '*** FAILED inputs on resistors'"
	nop
	must "(portc & 3) == 1, '*** FAILED the other pins of the nets'"
	nop
	bsf STATUS,RP0
	bcf TRISB,0			; an output that is low against the pull-up
	bcf STATUS,RP0
	nop
	must "(portb & 1) == 0 && (portc & 1) == 0, '*** FAILED low output against a pull-up'"
	nop
	bsf STATUS,RP0
	bsf TRISB,0			; lets go
	bcf STATUS,RP0
	nop
	must "(portb & 1) == 1 && (portc & 1) == 1, '*** FAILED a pull-up alone again'"
	nop
	bsf PORTB,1
	bsf STATUS,RP0
	bcf TRISB,1			; an output that is high against the pull-down
	bcf STATUS,RP0
	nop
	must "(portb & 2) == 2 && (portc & 2) == 2, '*** FAILED high output against a pull-down'"
	nop
	bcf PORTB,1
	nop
	must "(portc & 2) == 0, '*** FAILED an output that drives another pin'"
	nop
	bsf PORTB,1
	nop
	must "(portc & 2) == 2, '*** FAILED and high again'"
	nop
	bsf STATUS,RP0
	bsf TRISB,1
	bcf STATUS,RP0
	nop
	must "(portc & 2) == 0, '*** FAILED a pull-down alone again'"
	nop
	bsf STATUS,RP0
	bcf OPTION_REG,7		; pull-ups of port B, weaker than 4.7 kilohms
	bcf STATUS,RP0
	nop
	must "(portb & 2) == 0, '*** FAILED weak pull-up against a pull-down'"
	nop
	.direct "a", "'*** PASSED resistors'"
	goto $
	end
