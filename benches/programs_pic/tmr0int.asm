; Timer 0 at 1:4 interrupts every 1024 cycles; the handler saves W and STATUS and counts at 20h,21h. Meanwhile a 16-bit shift
; register (Galois, B400h, start 1) runs at 22h,23h and counts its steps at 24h,25h,26h.
        processor 16f873
        include <p16f873.inc>
        __config _WDT_OFF & _PWRTE_OFF & _CP_OFF & _LVP_OFF & _BODEN_OFF & _HS_OSC
tickL   equ 20h
tickH   equ 21h
regL    equ 22h
regH    equ 23h
steps0  equ 24h
steps1  equ 25h
steps2  equ 26h
keepW   equ 2Eh
keepS   equ 2Fh

        org 0
        goto start
        org 4
        movwf keepW
        swapf STATUS,w
        movwf keepS
        bcf INTCON,T0IF
        incf tickL,f
        btfsc STATUS,Z
        incf tickH,f
        swapf keepS,w
        movwf STATUS
        swapf keepW,f
        swapf keepW,w
        retfie

start   clrf tickL
        clrf tickH
        clrf steps0
        clrf steps1
        clrf steps2
        movlw 1
        movwf regL
        clrf regH
        bsf STATUS,RP0
        movlw b'11010001'       ; Instruction clock, prescaler to timer 0, 1:4.
        movwf OPTION_REG
        bcf STATUS,RP0
        clrf TMR0
        movlw 1<<GIE | 1<<T0IE
        movwf INTCON
shift   bcf STATUS,C
        rrf regH,f
        rrf regL,f
        movlw 0B4h
        btfsc STATUS,C
        xorwf regH,f
        incfsz steps0,f
        goto shift
        incfsz steps1,f
        goto shift
        incf steps2,f
        goto shift
        end
