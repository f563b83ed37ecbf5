/* Arduino's library Wire, with an MPU-6050 at the address 0x68. */
#ifndef TWO_WIRE_H
#define TWO_WIRE_H

#include <stdint.h>

class TwoWire {
  public:
    void begin() {}
    void setClock(uint32_t) {}
    void beginTransmission(uint8_t address);
    size_t write(uint8_t byte);
    uint8_t endTransmission(bool stop = true);
    uint8_t requestFrom(uint8_t address, uint8_t count);
    int available() const { return pending; }
    int read();

  private:
    uint8_t address = 0;
    /* The number of the next byte of a transmission. */
    int written = 0;
    int pending = 0;
    uint8_t target = 0;
};
extern TwoWire Wire;

#endif
