; A binary counter of 16 bits, M1 to M16, that counts program cycles: the state of the machine does not repeat
; for 65,536 of them. M0 is the carry, M31 the new value of a bit.
        channels 8, 4
        ld      M1
        sto     M0
        stoc    M1
        irp     bit, M2, M3, M4, M5, M6, M7, M8, M9, M10, M11, M12, M13, M14, M15, M16
        ld      bit
        xor     M0
        sto     M31
        ld      bit
        and     M0
        sto     M0
        ld      M31
        sto     bit
        endm
        ld      M16
        sto     E0
