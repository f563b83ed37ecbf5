/* Arduino's library Servo: a pulse each 20 ms. */
#ifndef SERVO_H
#define SERVO_H

#include <stdint.h>

class Servo {
  public:
    uint8_t attach(int pin);
    uint8_t attach(int pin, int, int) { return attach(pin); }
    void writeMicroseconds(int pulse);

  private:
    int number = 0;
};

#endif
