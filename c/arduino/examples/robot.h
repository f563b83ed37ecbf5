/* The robot of the examples and its room. Measure your own, and change this file; docs/build-a-robot.md tells how.
 *
 * Wiring: encoders of the right wheel on pins 2 and 3, of the left wheel on 4 and 5; sonar: trigger 6, echo 7, through a divider to
 * the voltage of the board; servo 8. Pins 2 to 5 and 7 need interrupts. */
#ifndef ROBOT_H
#define ROBOT_H

#include <Sonarfix.h>

/* A room of 6 m x 8 m. The robot starts at (1.5 m, 1.5 m) and faces along x. */
static const sonarfix_segment_t ROOM[] = {{0, 0, 6, 0, 0}, {6, 0, 6, 8, 0}, {6, 8, 0, 8, 0}, {0, 8, 0, 0, 0}};
static const float START_X = 1.5f, START_Y = 1.5f, START_HEADING = 0;
/* How well the start is known: 2 cm, 2 degrees. */
static const float START_POSITION = 0.02f, START_DIRECTION = 0.035f;

static const float DEGREES = 0.017453293f;

inline sonarfix_robot_config_t measured() {
    sonarfix_robot_config_t config;
    sonarfix_robot_config_default(0.12f, &config); /* the track width */
    config.right_wheel.travel_per_count_m = config.left_wheel.travel_per_count_m = 0.0004887f;
    config.localizer.wheel_noise_m = 0.003f;
    config.localizer.scale_walk = 1e-4f;
    config.localizer.track_width_walk_m = 2e-5f;
    config.localizer.max_wheel_speed_m_per_s = 1;
    config.localizer.prior_scale_right = config.localizer.prior_scale_left = 0.015f;
    config.localizer.prior_track_width_m = 0.005f;
    config.localizer.prior_range_scale = 0.015f;
    config.localizer.gating_confidence = 2;
    sonarfix_ranger_config_t &ranger = config.localizer.rangers[0];
    ranger.mount_x_m = 0.06f; /* the servo is 6 cm ahead of the axle */
    ranger.servo_right_rad = -100 * DEGREES;
    ranger.servo_left_rad = 100 * DEGREES;
    ranger.cone_rad = 12 * DEGREES;
    ranger.min_range_m = 0.1f;
    ranger.max_range_m = 3.5f;
    ranger.noise_floor_m = 0.002f;
    ranger.noise_per_metre = 0.001f;
    ranger.ping_period_us = 500000;
    sonarfix_driver_config_t &driver = config.drivers[0];
    driver.servo_pulse_us[0] = 500; /* two pulses and their bearings */
    driver.servo_pulse_us[1] = 2500;
    driver.servo_bearing_rad[0] = -100 * DEGREES;
    driver.servo_bearing_rad[1] = 100 * DEGREES;
    return config;
}

#endif
