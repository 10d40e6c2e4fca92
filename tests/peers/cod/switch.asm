; A switch between an output and an input that rests on a pull-down.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
start	code 0
	bench "break c 2000"
	bench "module library libgpsim_modules"
	bench "module load switch sw1"
	bench "module load pulldown down"
	bench "sw1.state = open"
	bench "node a"
	bench "node b"
	bench "attach a sw1.A portb0 portc0"
	bench "attach b sw1.B down.pin portc1"
	clrf STATUS
	clrf PORTB
	bsf STATUS,RP0
	bcf TRISB,0
	bcf STATUS,RP0
	bsf PORTB,0
	nop
	must "(portc & 3) == 1, '*** FAILED open'"
	nop
	does "sw1.state = closed"
	nop
	nop
	must "(portc & 3) == 3, '*** FAILED closed'"
	nop
	bcf PORTB,0
	nop
	must "(portc & 3) == 0, '*** FAILED low through the switch'"
	nop
	bsf PORTB,0
	nop
	must "(portc & 3) == 3, '*** FAILED high through the switch'"
	nop
	does "sw1.state = false"
	nop
	nop
	must "(portc & 3) == 1, '*** FAILED open again'"
	nop
	.direct "a", "'*** PASSED switch'"
	goto $
	end
