; A register list names the chip.
$NOMOD51
$INCLUDE (89C4051.MCU)
        ORG     0
        MOV     P1, #1
        SJMP    $
        END
