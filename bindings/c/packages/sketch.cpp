/* Runs a sketch on the host as its board would: SKETCH names the .ino file. */
#include "Arduino.h"
#include SKETCH

int main()
{
    setup();
    for (int i = 0; i < 6200; i++) {
        loop();
    }
}
