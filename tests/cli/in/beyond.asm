        .device ATmega2560      ; of which there is no model
loop:   rjmp    loop
