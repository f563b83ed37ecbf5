/* Runs a program for Arduino in steps of the simulator: the signals of the sensors become levels and interrupts, then `loop` runs
 * once, and what it did to the actuators is returned. Simulated time stands still while the program computes. */
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "Arduino.h"
#include "Servo.h"
#include "VL53L1X.h"
#include "Wire.h"
#include "wiring.h"

namespace {

constexpr int PINS = 64;
constexpr int LIGHT = 0;

struct Pin {
    bool is_high = false;
    void (*handler)() = nullptr;
};

Pin pins[PINS];
Inputs inputs;
Outputs outputs;
std::string written;
/* The time, us: that of an edge while its interrupt is handled, else that of the step and what the program has waited. */
uint64_t now;
/* Whether a range of light was started that has not been reported. */
bool is_lit;

/* The number of the element in a table of pins, or that of all of them. */
template <size_t N> size_t number_in(const int (&table)[N], int pin) {
    return size_t(std::find(table, table + N, pin) - table);
}

/* Changes the level of an input. */
void change(int pin, bool is_high) {
    if (pins[pin].is_high == is_high) return;
    pins[pin].is_high = is_high;
    if (pins[pin].handler) pins[pin].handler();
}

/* Turns the disc of an encoder by a count at a time: upwards A leads B. */
void turn(int wheel, uint32_t from, uint32_t to) {
    const int step = int32_t(to - from) > 0 ? 1 : -1;
    while (from != to) {
        from += uint32_t(step);
        const unsigned phase = from & 3;
        change(ENCODERS[wheel][0], phase == 1 || phase == 2);
        change(ENCODERS[wheel][1], phase >= 2);
    }
}

/* The edges of all echo lines, in the order of time. */
void echo(const Inputs &to) {
    struct Edge {
        uint64_t at;
        int pin;
        bool is_high;
    };
    std::vector<Edge> edges;
    for (int ranger = 0; ranger < RANGERS; ++ranger) {
        const Edges &line = to.echoes[ranger];
        if (line.rose) edges.push_back({line.rose, ECHOES[ranger], true});
        if (line.fell) edges.push_back({line.fell, ECHOES[ranger], false});
    }
    std::stable_sort(edges.begin(), edges.end(), [](const Edge &a, const Edge &b) { return a.at < b.at; });
    for (const Edge &edge : edges) {
        now = edge.at;
        change(edge.pin, edge.is_high);
    }
}

void step(const Inputs &to) {
    echo(to);
    now = to.now;
    for (int wheel = 0; wheel < 2; ++wheel) turn(wheel, inputs.ticks[wheel], to.ticks[wheel]);
    inputs = to;
}

} // namespace

SerialPort Serial;
TwoWire Wire;

uint32_t micros() { return uint32_t(now); }
uint32_t millis() { return uint32_t(now / 1000); }
void delay(uint32_t milliseconds) { now += uint64_t(milliseconds) * 1000; }
void delayMicroseconds(uint32_t microseconds) { now += microseconds; }
void pinMode(uint8_t, uint8_t) {}
int digitalRead(uint8_t pin) { return pins[pin % PINS].is_high; }
void attachInterrupt(uint8_t pin, void (*handler)(), int) { pins[pin % PINS].handler = handler; }

void digitalWrite(uint8_t pin, uint8_t level) {
    Pin &output = pins[pin % PINS];
    const size_t ranger = number_in(TRIGGERS, pin);
    if (output.is_high && !level && ranger < RANGERS) outputs.rangers[ranger].has_pinged = 1;
    output.is_high = level;
}

size_t SerialPort::write(const uint8_t *bytes, size_t count) {
    written.append(reinterpret_cast<const char *>(bytes), count);
    return count;
}

size_t SerialPort::print(double number, int digits) {
    char text[40];
    snprintf(text, sizeof text, "%.*f", digits, number);
    return print(text);
}

uint8_t Servo::attach(int pin) {
    number = int(number_in(SERVOS, pin));
    return uint8_t(number);
}

void Servo::writeMicroseconds(int pulse) {
    if (number < RANGERS) outputs.rangers[number].servo = uint16_t(pulse);
}

/* Registers of the MPU-6050 (register map, revision 4.2). */
namespace {
constexpr uint8_t GYRO_CONFIG = 0x1B, GYRO_ZOUT_H = 0x47, GYRO_ZOUT_L = 0x48, WHO_AM_I = 0x75;
uint8_t gyro_range;

uint8_t gyro_register(uint8_t address) {
    /* 131.072 counts of a degree per second in the range of 250 degrees per second. */
    const double scale = 131.072 * 57.29577951308232e-6 / (1 << gyro_range);
    const int16_t counts = int16_t(std::clamp(std::round(inputs.yaw * scale), -32768.0, 32767.0));
    switch (address) {
    case GYRO_ZOUT_H: return uint8_t(uint16_t(counts) >> 8);
    case GYRO_ZOUT_L: return uint8_t(counts);
    case WHO_AM_I: return 0x68;
    default: return 0;
    }
}
} // namespace

void TwoWire::beginTransmission(uint8_t to) {
    address = to;
    written = 0;
}

size_t TwoWire::write(uint8_t byte) {
    if (written++ == 0) {
        target = byte;
    } else if (target == GYRO_CONFIG) {
        gyro_range = (byte >> 3) & 3;
    }
    return 1;
}

uint8_t TwoWire::endTransmission(bool) { return address == 0x68 ? 0 : 2; }

uint8_t TwoWire::requestFrom(uint8_t from, uint8_t count) {
    pending = from == 0x68 ? count : 0;
    return uint8_t(pending);
}

int TwoWire::read() {
    if (pending == 0) return -1;
    --pending;
    return gyro_register(target++);
}

void VL53L1X::readSingle(bool) {
    outputs.rangers[LIGHT].has_pinged = 1;
    inputs.light[LIGHT].status = 0;
    is_lit = true;
}

bool VL53L1X::dataReady() { return is_lit && inputs.light[LIGHT].status != 0; }

uint16_t VL53L1X::read(bool) {
    const Light &light = inputs.light[LIGHT];
    is_lit = false;
    /* The correction gain that Pololu's library applies to the sensor's register. */
    const uint16_t range = uint16_t((light.millimetres * 2011u + 0x400) / 0x800);
    ranging_data = {range, light.status == 9 ? RangeValid : SignalFail};
    return range;
}

int main() {
    Inputs to;
    bool is_set_up = false;
    while (fread(&to, sizeof to, 1, stdin) == 1) {
        step(to);
        outputs = Outputs{};
        if (!is_set_up) setup();
        is_set_up = true;
        loop();
        outputs.serial = uint32_t(written.size());
        fwrite(&outputs, sizeof outputs, 1, stdout);
        fwrite(written.data(), 1, written.size(), stdout);
        fflush(stdout);
        written.clear();
    }
}
