/* The part of Pololu's library VL53L1X that the example uses. The simulated sensor is that of the first ranger. */
#ifndef VL53L1X_H
#define VL53L1X_H

#include <stdint.h>

class VL53L1X {
  public:
    enum RangeStatus : uint8_t { RangeValid = 0, SignalFail = 2, None = 255 };
    enum DistanceMode { Short, Medium, Long };
    struct RangingData {
        uint16_t range_mm;
        RangeStatus range_status;
    };
    RangingData ranging_data{0, None};

    bool init() { return true; }
    void setTimeout(uint16_t) {}
    bool setDistanceMode(DistanceMode) { return true; }
    bool setMeasurementTimingBudget(uint32_t) { return true; }
    void readSingle(bool blocking);
    bool dataReady();
    uint16_t read(bool blocking);
};

#endif
