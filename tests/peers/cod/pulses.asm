; A pulse generator that repeats, one that is set while the program runs, and a stimulus. Times are cycles.
	list p=16f873, r=dec
	include <p16f873.inc>
	include "messages.inc"
	udata
n	res 1
width	res 1
	global n, width
start	code 0
	bench "break c 20000"
	bench "module library libgpsim_modules"
	bench "module load pulsegen p1"
	bench "module load pulsegen p2"
	bench "p1.clear = 0"
	bench "p1.set = 100"
	bench "p1.clear = 160"
	bench "p1.period = 400"
	bench "p2.initial = 5.0"
	bench "stimulus asynchronous_stimulus"
	bench "initial_state 0"
	bench "start_cycle 1000"
	bench "period 500"
	bench "{ 50, 1,"
	bench "80, 0 }"
	bench "name s1"
	bench "end"
	bench "node n0"
	bench "node n1"
	bench "node n2"
	bench "attach n0 portb0 p1.pin"
	bench "attach n1 portb1 p2.pin"
	bench "attach n2 portb2 s1"
	clrf STATUS
	must "(portb & 2) == 2, '*** FAILED initial'"
	nop
; A loop of three cycles measures how long RB0 is high: 60 cycles are 20 turns.
	clrf width
	btfsc PORTB,0
	goto $-1
	btfss PORTB,0
	goto $-1
first	incf width,f
	btfsc PORTB,0
	goto first
	must "width >= 14 && width <= 16, '*** FAILED first pulse'"
	nop
	must "cycles >= 160 && cycles < 170, '*** FAILED end of the first pulse'"
	nop
	clrf width
	btfss PORTB,0
	goto $-1
second	incf width,f
	btfsc PORTB,0
	goto second
	must "width >= 14 && width <= 16, '*** FAILED second pulse'"
	nop
	must "cycles >= 560 && cycles < 570, '*** FAILED end of the second pulse'"
	nop
	does "p2.clear = cycles + 20"
	nop
	does "p2.set = cycles + 60"
	nop
	must "(portb & 2) == 2, '*** FAILED before the pulse'"
	nop
	movlw 10
	movwf n
	decfsz n,f
	goto $-1
	must "(portb & 2) == 0, '*** FAILED in the pulse'"
	nop
	movlw 20
	movwf n
	decfsz n,f
	goto $-1
	must "(portb & 2) == 2, '*** FAILED after the pulse'"
	nop
	btfss PORTB,2
	goto $-1
	must "cycles >= 1050 && cycles < 1058, '*** FAILED stimulus high'"
	nop
	btfsc PORTB,2
	goto $-1
	must "cycles >= 1080 && cycles < 1088, '*** FAILED stimulus low'"
	nop
	btfss PORTB,2
	goto $-1
	must "cycles >= 1550 && cycles < 1558, '*** FAILED stimulus again'"
	nop
	.direct "a", "'*** PASSED pulses'"
	goto $
	end
