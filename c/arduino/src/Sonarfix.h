/* Sonarfix for Arduino: drivers of the parts of a robot, and the loop. All functions of the C library can be used as well: sonarfix.h
 * has their documentation. Times are microseconds, lengths metres, angles radians counter-clockwise.
 *
 * C++11, without allocation. Interrupts only stamp edges and count. */
#ifndef SONARFIX_ARDUINO_H
#define SONARFIX_ARDUINO_H

#include <Arduino.h>

#include "sonarfix.h"

#if defined(ESP8266) || defined(ESP32)
#define SONARFIX_ISR IRAM_ATTR
#else
#define SONARFIX_ISR
#endif

/* The clock of Arduino, which wraps around after 71 minutes, in 64 bits. It must be read more often than that. */
class SonarfixClock {
  public:
    /* The time, microseconds. */
    uint64_t now() {
        const uint32_t counted = micros();
        time += uint32_t(counted - latest);
        latest = counted;
        return time;
    }

    /* The time of a reading of micros() that was made in the last 71 minutes. */
    uint64_t at(uint32_t counted) {
        const uint64_t present = now();
        return present - uint32_t(latest - counted);
    }

  private:
    uint64_t time = 0;
    uint32_t latest = 0;
};

/* A quadrature encoder on two pins with interrupts. It counts up while A leads B. */
template <uint8_t A, uint8_t B> class SonarfixEncoder {
  public:
    void begin() {
        pinMode(A, INPUT_PULLUP);
        pinMode(B, INPUT_PULLUP);
        levels() = read();
        attachInterrupt(digitalPinToInterrupt(A), changed, CHANGE);
        attachInterrupt(digitalPinToInterrupt(B), changed, CHANGE);
    }

    /* Its count, for sonarfix_inputs_t. */
    sonarfix_encoder_input_t counted() const {
        sonarfix_encoder_input_t input = {};
        noInterrupts();
        input.count = count();
        input.illegal = illegal();
        interrupts();
        return input;
    }

  private:
    static volatile uint32_t &count() {
        static volatile uint32_t counter;
        return counter;
    }
    static volatile uint32_t &illegal() {
        static volatile uint32_t counter;
        return counter;
    }
    static volatile uint8_t &levels() {
        static volatile uint8_t latest;
        return latest;
    }
    /* The place in the period: 0, 1, 2, 3 while A leads B. */
    static uint8_t read() {
        const uint8_t a = digitalRead(A), b = digitalRead(B);
        return uint8_t((b << 1) | (a ^ b));
    }
    static void SONARFIX_ISR changed() {
        const uint8_t present = read();
        const uint8_t step = (present - levels()) & 3;
        levels() = present;
        if (step == 1) count() = count() + 1;
        if (step == 3) count() = count() - 1;
        if (step == 2) illegal() = illegal() + 1;
    }
};

/* A sonar with a trigger pin and an echo pin with interrupts: HC-SR04 and its like, LV-MaxSonar. It never waits. */
template <uint8_t TRIGGER, uint8_t ECHO> class SonarfixPulseRanger {
  public:
    void begin() {
        pinMode(TRIGGER, OUTPUT);
        digitalWrite(TRIGGER, LOW);
        pinMode(ECHO, INPUT);
        attachInterrupt(digitalPinToInterrupt(ECHO), changed, CHANGE);
    }

    /* The edges since the last call. */
    sonarfix_ranger_input_t edges(SonarfixClock &clock) {
        noInterrupts();
        const Stamps taken = {stamps().rose, stamps().fell, stamps().has_risen, stamps().has_fallen};
        stamps().has_risen = stamps().has_fallen = false;
        interrupts();
        sonarfix_ranger_input_t input = {};
        input.rose_us = clock.at(taken.rose);
        input.fell_us = clock.at(taken.fell);
        input.has_risen = taken.has_risen;
        input.has_fallen = taken.has_fallen;
        return input;
    }

    /* Sets the trigger as an output says. */
    void obey(const sonarfix_ranger_output_t &output) {
        if (output.starts && !is_high) {
            digitalWrite(TRIGGER, HIGH);
            delayMicroseconds(10);
            digitalWrite(TRIGGER, LOW);
            return;
        }
        if (bool(output.trigger) == is_high) return;
        is_high = output.trigger;
        digitalWrite(TRIGGER, is_high ? HIGH : LOW);
    }

  private:
    struct Stamps {
        uint32_t rose, fell;
        bool has_risen, has_fallen;
    };
    bool is_high = false;

    static volatile Stamps &stamps() {
        static volatile Stamps latest;
        return latest;
    }
    static void SONARFIX_ISR changed() {
        volatile Stamps &latest = stamps();
        if (digitalRead(ECHO)) {
            latest.rose = micros();
            latest.has_risen = true;
        } else {
            latest.fell = micros();
            latest.has_fallen = true;
        }
    }
};

/* A VL53L1X by Pololu's library of that name, whose object is passed: `#include <VL53L1X.h>` first. */
template <class Sensor> class SonarfixVl53l1x {
  public:
    explicit SonarfixVl53l1x(Sensor &sensor) : sensor(sensor) {}

    /* Prepares ranges of 50 ms. Call sensor.init() before. */
    void begin() {
        sensor.setDistanceMode(Sensor::Long);
        sensor.setMeasurementTimingBudget(BUDGET);
    }

    /* The range that has ended since the last call. */
    sonarfix_ranger_input_t reading(SonarfixClock &clock) {
        sonarfix_ranger_input_t input = {};
        if (!is_measuring || !sensor.dataReady()) return input;
        is_measuring = false;
        sensor.read(false);
        const bool is_valid = sensor.ranging_data.range_status == Sensor::RangeValid;
        input.reading = is_valid ? SONARFIX_READING_RANGE : SONARFIX_READING_NO_ECHO;
        input.range_m = 0.001f * sensor.ranging_data.range_mm;
        input.measured_us = clock.at(started) + MIDDLE;
        const uint64_t now = clock.now();
        if (input.measured_us > now) input.measured_us = now;
        return input;
    }

    /* Starts a range if an output says so. */
    void obey(const sonarfix_ranger_output_t &output) {
        if (!output.starts) return;
        started = micros();
        is_measuring = true;
        sensor.readSingle(false);
    }

  private:
    static constexpr uint32_t BUDGET = 50000;
    /* From the start to the middle of the time in which the light is collected. */
    static constexpr uint32_t MIDDLE = 27000;
    Sensor &sensor;
    uint32_t started = 0;
    bool is_measuring = false;
};

/* The gyro of an MPU-6050 on a bus of Arduino's library Wire, in the range of 500 degrees per second. */
template <class Bus> class SonarfixMpu6050 {
  public:
    explicit SonarfixMpu6050(Bus &bus, uint8_t address = 0x68) : bus(bus), address(address) {}

    /* Wakes it. Call bus.begin() before. False if it does not answer. */
    bool begin() { return write(POWER_MANAGEMENT, 0) && write(GYRO_CONFIG, 1 << 3); }

    /* Reads the yaw rate into the inputs of a poll. */
    void sense(sonarfix_inputs_t &inputs) {
        bus.beginTransmission(address);
        bus.write(GYRO_Z_HIGH);
        inputs.has_yaw_rate = bus.endTransmission(false) == 0 && bus.requestFrom(address, uint8_t(2)) == 2;
        if (!inputs.has_yaw_rate) return;
        const int high = bus.read(), low = bus.read();
        /* 65.536 counts of a degree per second. */
        inputs.yaw_rate_rad_per_s = int16_t((high << 8) | low) * (0.017453293f / 65.536f);
    }

  private:
    static constexpr uint8_t POWER_MANAGEMENT = 0x6B, GYRO_CONFIG = 0x1B, GYRO_Z_HIGH = 0x47;
    Bus &bus;
    uint8_t address;

    bool write(uint8_t to, uint8_t value) {
        bus.beginTransmission(address);
        bus.write(to);
        bus.write(value);
        return bus.endTransmission() == 0;
    }
};

/* Bytes between the robot and a program on a PC: `sonarfix monitor`, the live page, recordings. */
class SonarfixLink {
  public:
    /* Passes what was received to the inputs of a poll. */
    template <class Port> void receive(Port &port, sonarfix_inputs_t &inputs) {
        while (length < sizeof received && port.available() > 0) received[length++] = uint8_t(port.read());
        inputs.received = received;
        inputs.received_length = length;
        inputs.to_send = to_send;
        inputs.to_send_length = sizeof to_send;
    }

    /* Sends what a poll has written. */
    template <class Port> void send(Port &port, const sonarfix_outputs_t &outputs) {
        memmove(received, received + outputs.received_taken, length - outputs.received_taken);
        length -= outputs.received_taken;
        if (outputs.to_send > 0) port.write(to_send, outputs.to_send);
    }

  private:
    uint8_t received[64];
    uint8_t to_send[1200];
    size_t length = 0;
};

/* A robot in a map of so many walls. Fill the inputs, call poll(), and do what the outputs say, as often as possible. */
template <size_t WALLS> class SonarfixRobot {
  public:
    SonarfixClock clock;
    /* What was sensed and received since the last poll; the time is filled by poll(). */
    sonarfix_inputs_t inputs = {};
    /* What to do after the last poll. */
    sonarfix_outputs_t outputs = {};

    /* Opens the robot. Its loop starts by start() or search(), or by a command over the link. */
    sonarfix_status_t begin(const sonarfix_robot_config_t &config, const sonarfix_segment_t (&room)[WALLS]) {
        memset(store, 0xFF, sizeof store);
        const sonarfix_status_t status = sonarfix_map_from_walls(&map, walls, room, WALLS);
        if (status != SONARFIX_OK) return status;
        return sonarfix_robot_init(&robot, &config, &map, store, clock.now());
    }

    /* Starts at a pose that is known to so many metres and radians. */
    void start(float x, float y, float heading, float position_deviation, float heading_deviation) {
        const sonarfix_start_t at = {{x, y, heading}, position_deviation, heading_deviation};
        sonarfix_robot_set_pose(&robot, &at);
        poll();
        sonarfix_robot_start(&robot);
    }

    /* Starts without a pose: the configuration must let the robot search. */
    void search() { sonarfix_robot_start(&robot); }

    /* Handles what is due. It never waits. */
    sonarfix_status_t poll() {
        inputs.now_us = clock.now();
        const sonarfix_status_t status = sonarfix_robot_poll(&robot, &inputs, &outputs);
        for (int ranger = 0; ranger < SONARFIX_RANGERS; ++ranger) inputs.rangers[ranger] = {};
        return status;
    }

    /* Works on the search for the pose in the time that is left after a poll. */
    void work() { sonarfix_robot_work(&robot, inputs.now_us); }

    /* The handle, for functions of sonarfix.h. */
    sonarfix_robot_t *handle() { return &robot; }

  private:
    sonarfix_wall_t walls[WALLS];
    sonarfix_map_t map;
    sonarfix_robot_t robot;
    uint8_t store[SONARFIX_STORE_SIZE];
};

/* Writes the pose as a line of text: `pose X Y HEADING VERDICT`, in metres and degrees. */
template <class Port> void sonarfixPrintPose(Port &port, const sonarfix_outputs_t &outputs) {
    port.print("pose ");
    port.print(outputs.pose.x_m, 4);
    port.print(" ");
    port.print(outputs.pose.y_m, 4);
    port.print(" ");
    port.print(outputs.pose.heading_rad * 57.29578f, 2);
    port.println(outputs.verdict == SONARFIX_VERDICT_TRACKING   ? " tracking"
                 : outputs.verdict == SONARFIX_VERDICT_DEGRADED ? " degraded"
                                                                : " lost");
}

#endif
