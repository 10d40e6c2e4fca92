; chip: pic16f88
; reports: 302
; A program as people write them: a lamp follows the converter; two configuration words, EEPROM, four banks.
        LIST    P=16F88, R=DEC
        #include "p16f88.inc"
        __CONFIG _CONFIG1, _CP_OFF & _CCP1_RB0 & _DEBUG_OFF & _WRT_PROTECT_OFF & _CPD_OFF & _LVP_OFF & _BODEN_ON & _MCLR_ON & _PWRTE_ON & _WDT_OFF & _INTRC_IO
        __CONFIG _CONFIG2, _IESO_OFF & _FCMEN_OFF
        __idlocs 0x0088

        CBLOCK  0x20
        level, previous
        tally:2
        ENDC
UDATA_START equ 0x70
        CBLOCK  UDATA_START
        w_kept, status_kept
        ENDC
#define LAMP    PORTB, 3
#define BUSY    ADCON0, GO

        ORG     0x0000
        goto    setup
        ORG     0x0004
isr     movwf   w_kept
        swapf   STATUS, W
        movwf   status_kept
        bcf     STATUS, RP0
        bcf     STATUS, RP1
        btfss   INTCON, TMR0IF
        goto    leave
        bcf     INTCON, TMR0IF
        incfsz  tally, F
        goto    leave
        incf    tally+1, F
leave   swapf   status_kept, W
        movwf   STATUS
        swapf   w_kept, F
        swapf   w_kept, W
        retfie

setup   banksel OSCCON
        movlw   B'01110000'
        movwf   OSCCON
        movlw   1
        movwf   ANSEL
        bcf     TRISB ^ 0x80, 3
        movlw   (1 << T0CS) >> 5 | 7
        movwf   OPTION_REG ^ 0x80
        banksel ADCON0
        movlw   (1 << ADON) | 0x40
        movwf   ADCON0
        bsf     INTCON, TMR0IE
        bsf     INTCON, GIE
loop    bsf     BUSY
        btfsc   BUSY
        goto    $-1
        movf    ADRESH, W
        movwf   level
        subwf   previous, W
        btfsc   STATUS, Z
        goto    loop
        movf    level, W
        movwf   previous
        sublw   HIGH 0x8000
        btfss   STATUS, C
        goto    bright
        bcf     LAMP
        goto    loop
bright  bsf     LAMP
        goto    loop

        ORG     0x2100
        DE      "level", 0x80, .10
        END
