; chip: pic16f873
; reports: 203 205 302
; A rung as a compiler of ladder diagrams puts it: instructions and directives in column 1, contacts as texts of two operands.
list p=16F873
radix dec
include <p16f873.inc>
#define T0 0FH,6
#define T1 0FH,7
#define T2 10H,0
#define first PORTA,0
#define second PORTA,1
#define third PORTA,2
#define fourth PORTA,3
#define lamp PORTA,4
org 0
goto Start
Start
bsf TRISA,0
bsf TRISA,1
bsf TRISA,2
bsf TRISA,3
bcf TRISA,4
bcf lamp
Again
Rung0:
BSF T0
BTFSS first
BCF T0
BTFSS second
BCF T0
BCF T1
BTFSC third
BSF T1
BTFSC fourth
BSF T1
BSF T2
BTFSS T0
BCF T2
BTFSS T1
BCF T2
BTFSS T2
BCF lamp
BTFSC T2
BSF lamp
goto Again
END
