; Gates from port B to port C: RC0 = not RB0, RC1 = RB0 and RB1, RC2 = RB0 or RB1, RC3 = RB0 xor RB1, RC4 = not not RB1.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
	udata
n	res 1
	global n
start	code 0
	bench "break c 3000"
	bench "module library libgpsim_modules"
	bench "module load not n1"
	bench "module load not n2"
	bench "module load not n3"
	bench "module load and2 a1"
	bench "module load or2 o1"
	bench "module load xor2 x1"
	bench "node b0"
	bench "node b1"
	bench "node c0"
	bench "node c1"
	bench "node c2"
	bench "node c3"
	bench "node c4"
	bench "node inner"
	bench "attach b0 portb0 n1.in0 a1.in0 o1.in0 x1.in0"
	bench "attach b1 portb1 n2.in0 a1.in1 o1.in1 x1.in1"
	bench "attach c0 portc0 n1.out"
	bench "attach c1 portc1 a1.out"
	bench "attach c2 portc2 o1.out"
	bench "attach c3 portc3 x1.out"
	bench "attach inner n2.out n3.in0"
	bench "attach c4 portc4 n3.out"
	clrf STATUS
	clrf PORTB
	bsf STATUS,RP0
	clrf TRISB
	bcf STATUS,RP0
	movlw 4
	movwf n
turn	incf PORTB,f
	nop
	must "(portc & 1) == ((portb & 1) ^ 1), '*** FAILED not'"
	nop
	must "((portc >> 1) & 1) == (portb & (portb >> 1) & 1), '*** FAILED and2'"
	nop
	must "((portc >> 2) & 1) == ((portb | (portb >> 1)) & 1), '*** FAILED or2'"
	nop
	must "((portc >> 3) & 1) == ((portb ^ (portb >> 1)) & 1), '*** FAILED xor2'"
	nop
	must "((portc >> 4) & 1) == ((portb >> 1) & 1), '*** FAILED not of not'"
	nop
	decfsz n,f
	goto turn
	.direct "a", "'*** PASSED gates'"
	goto $
	end
