/* The part of Arduino's API that the library and its examples use, on a PC whose pins are simulated. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stddef.h>
#include <stdint.h>
#if __has_include(<string.h>)
#include <string.h>
#else
/* A compiler without a C library. */
extern "C" {
void *memmove(void *to, const void *from, size_t count);
void *memset(void *to, int value, size_t count);
size_t strlen(const char *text);
}
#endif

#define ARDUINO 10819
#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2
#define CHANGE 1
#define DEC 10
#define IRAM_ATTR
#define digitalPinToInterrupt(pin) (pin)

using byte = uint8_t;

uint32_t micros();
uint32_t millis();
void delay(uint32_t milliseconds);
void delayMicroseconds(uint32_t microseconds);
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t level);
int digitalRead(uint8_t pin);
void attachInterrupt(uint8_t pin, void (*handler)(), int mode);
inline void interrupts() {}
inline void noInterrupts() {}
void setup();
void loop();

/* A serial port without limit: what is written is sent at the end of the step. */
class SerialPort {
  public:
    void begin(unsigned long) {}
    int available() const { return 0; }
    int read() { return -1; }
    int availableForWrite() const { return 256; }
    size_t write(const uint8_t *bytes, size_t count);
    size_t write(uint8_t byte) { return write(&byte, 1); }
    size_t print(const char *text) { return write(reinterpret_cast<const uint8_t *>(text), strlen(text)); }
    size_t print(double number, int digits = 2);
    size_t print(int number) { return print(double(number), 0); }
    size_t println(const char *text = "") { return print(text) + print("\r\n"); }
    size_t println(double number, int digits = 2) { return print(number, digits) + println(); }
    explicit operator bool() const { return true; }
};
extern SerialPort Serial;

#endif
