; Interrupts: INT by an edge on its pin, a change of RB4, timer 0; the order of what the handler sees, RETFIE, DI.
        processor 16f877a
        include <p16f877a.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
#define CYCLES .4000
;; wire RC0 RB0
;; wire RC1 RB4
        include "log.inc"
        cblock 20h
        ints, changes, ticks, seen, intedge, rbmasked, rbflag, t0poll
        endc
where   equ 2Bh
keepW   equ 2Ch
keepS   equ 2Dh
        org 0
        goto start
        org 4
        movwf keepW
        swapf STATUS,w
        movwf keepS
        btfss INTCON,INTF
        goto no1
        incf ints,f
        bcf INTCON,INTF
no1     btfss INTCON,RBIF
        goto no2
        btfss INTCON,RBIE
        goto no2
        incf changes,f
        movf PORTB,w
        bcf INTCON,RBIF
no2     btfss INTCON,T0IF
        goto no3
        incf ticks,f
        bcf INTCON,T0IF
no3     movf where,w
        movwf seen
        swapf keepS,w
        movwf STATUS
        swapf keepW,f
        swapf keepW,w
        retfie
start   clrf ints
        clrf changes
        clrf ticks
        clrf where
        clrf PORTC
        bsf STATUS,RP0
        movlw b'11111100'
        movwf TRISC ^ 80h
        bcf STATUS,RP0
        movf PORTB,w
        put INTCON, b'10010000'
        idle .5
        bsf PORTC,0
        incf where,f
        incf where,f
        incf where,f
        incf where,f
        incf where,f
        incf where,f
        note intedge, seen
        bcf PORTC,0
        idle .10
        put1 OPTION_REG, b'10111111'
        bsf PORTC,0
        idle .10
        bcf PORTC,0
        idle .10
        ; A change with RBIE clear sets the flag alone.
        movf PORTB,w
        bcf INTCON,RBIF
        bsf PORTC,1
        idle .6
        note rbmasked, INTCON
        bcf PORTC,1
        idle .6
        note rbflag, INTCON
        movf PORTB,w
        bcf INTCON,RBIF
        bsf INTCON,RBIE
        bsf PORTC,1
        idle .30
        bcf PORTC,1
        idle .30
        bcf INTCON,RBIE
        put1 OPTION_REG, b'10010001'
        clrf TMR0
        bcf INTCON,T0IF
        bsf INTCON,T0IE
        far 2Eh, .2
        note t0poll, ticks
        bcf INTCON,GIE
        goto $
        end
