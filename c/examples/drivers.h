/* What a robot's own code does for one_fix.c. */
#ifndef DRIVERS_H
#define DRIVERS_H

#include <stdbool.h>
#include <stdint.h>

/* Microseconds since the start. */
uint64_t clock_us(void);
/* Waits for the next sample of the encoders, and reads the travel of each wheel since the last one, metres; false: the end. */
bool read_wheels(float *right_m, float *left_m);
/* Turns the servo to a bearing, radians, counter-clockwise from the heading, and waits until it has settled. */
void turn_servo(float bearing_rad);
/* Pings; false without an echo. */
bool ping(float *range_m);
/* Shows a pose: metres and radians. */
void show_pose(float x_m, float y_m, float heading_rad, float deviation_m);

#endif
