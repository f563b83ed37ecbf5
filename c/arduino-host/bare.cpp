/* Arduino's API without a board, so that an example can be linked for a processor. Nothing of it is run. */
#include "Arduino.h"
#include "Servo.h"
#include "VL53L1X.h"
#include "Wire.h"

SerialPort Serial;
TwoWire Wire;

uint32_t micros() { return 0; }
uint32_t millis() { return 0; }
void delay(uint32_t) {}
void delayMicroseconds(uint32_t) {}
void pinMode(uint8_t, uint8_t) {}
void digitalWrite(uint8_t, uint8_t) {}
int digitalRead(uint8_t) { return 0; }
void attachInterrupt(uint8_t, void (*)(), int) {}

size_t SerialPort::write(const uint8_t *, size_t count) { return count; }
size_t SerialPort::print(double, int) { return 0; }
uint8_t Servo::attach(int) { return 0; }
void Servo::writeMicroseconds(int) {}
void TwoWire::beginTransmission(uint8_t) {}
size_t TwoWire::write(uint8_t) { return 1; }
uint8_t TwoWire::endTransmission(bool) { return 0; }
uint8_t TwoWire::requestFrom(uint8_t, uint8_t count) { return count; }
int TwoWire::read() { return 0; }
void VL53L1X::readSingle(bool) {}
bool VL53L1X::dataReady() { return false; }
uint16_t VL53L1X::read(bool) { return 0; }

int main() {
    setup();
    for (;;) loop();
}
