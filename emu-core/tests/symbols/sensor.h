unsigned int sensor_read(unsigned char channel);
void asm_nudge(void);
void on_timer(void) __interrupt(1) __using(1);
