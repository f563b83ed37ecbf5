/* The pins to which the simulated robot is wired. The examples use the same. */
#ifndef WIRING_H
#define WIRING_H

#include "wire.h"

/* Channels A and B of the encoders of the right and the left wheel. */
constexpr int ENCODERS[2][2] = {{2, 3}, {4, 5}};
constexpr int TRIGGERS[RANGERS] = {6, 9, 12};
constexpr int ECHOES[RANGERS] = {7, 10, 13};
constexpr int SERVOS[RANGERS] = {8, 11, 14};

#endif
