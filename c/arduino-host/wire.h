/* What a program exchanges with the simulator in each step: sim-host/sketch/src/wire.rs is the other end. Little-endian,
 * without gaps. */
#ifndef WIRE_H
#define WIRE_H

#include <stdint.h>

constexpr int RANGERS = 3;

#pragma pack(push, 1)
/* The edges of an echo line since the last step, us; zero if there was none. */
struct Edges {
    uint64_t rose, fell;
};

/* What a time-of-flight ranger has: the status of the VL53L1X (9: a range; 4: no light; 0: not finished) and the range in mm. */
struct Light {
    uint16_t millimetres;
    uint8_t status, has_failed;
};

struct Inputs {
    uint64_t now;
    Edges echoes[RANGERS];
    /* Decoder counts of the right and the left wheel. */
    uint32_t ticks[2];
    /* Yaw rate, millionths of a radian per second. */
    int32_t yaw;
    Light light[RANGERS];
};

struct Ranger {
    /* Pulse of the servo, us; zero if it is unchanged. */
    uint16_t servo;
    uint16_t has_pinged;
};

/* Followed by `serial` bytes. */
struct Outputs {
    Ranger rangers[RANGERS];
    uint32_t serial;
};
#pragma pack(pop)

#endif
