; Without `channels` there are 512 inputs and 256 outputs; this program names three.
        ld      i1
        and     i2
        sto     e1
