/* The part of Arduino's interface that the example needs, for a host: `Serial` prints to standard output. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stdint.h>
#include <stdio.h>

class HostSerial {
public:
    void begin(unsigned long) {}
    void print(char c) { (void)putchar(c); }
    void print(float number, int digits) { (void)printf("%.*f", digits, (double)number); }
    void println(float number, int digits) { (void)printf("%.*f\n", digits, (double)number); }
    void println(const char *text) { (void)puts(text); }
};

static HostSerial Serial;

static inline void delay(unsigned long) {}

void setup();
void loop();

#endif
