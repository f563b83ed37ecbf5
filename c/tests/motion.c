/* A robot that searches for its pose is to turn once on the spot, as its configuration says, and then to stand. */
#include <math.h>
#include <string.h>

#include "sonarfix.h"

enum { WALLS = 4, POLLS = 20000 };

static const sonarfix_segment_t ROOM[WALLS] = {{0, 0, 6, 0, 0}, {6, 0, 6, 8, 0}, {6, 8, 0, 8, 0}, {0, 8, 0, 0, 0}};
static const float TRACK_WIDTH = 0.12f;

static sonarfix_wall_t walls[WALLS];
static sonarfix_map_t map;
static sonarfix_robot_t robot;
static sonarfix_robot_config_t config;
static uint8_t store[SONARFIX_STORE_SIZE];

/* The turn that the robot has made when its motion ends, radians; negative: it did not end. */
static float turned(void) {
  sonarfix_inputs_t inputs;
  sonarfix_outputs_t outputs;
  memset(&inputs, 0, sizeof inputs);
  double right = 0, left = 0;
  const double travel = (double)config.right_wheel.travel_per_count_m;
  int has_moved = 0;
  for (int poll = 0; poll < POLLS; poll++) {
    const uint64_t before = inputs.now_us;
    if (sonarfix_robot_poll(&robot, &inputs, &outputs) != SONARFIX_OK) return -1;
    if (outputs.mode != SONARFIX_MODE_SEARCHING && has_moved) return -1;
    const int moves = outputs.has_motion && outputs.motion.turn_rad_per_s != 0;
    if (has_moved && !moves) return (float)((right - left) * travel) / TRACK_WIDTH;
    has_moved = has_moved || moves;
    if (outputs.has_motion && outputs.motion.right_m_per_s != -outputs.motion.left_m_per_s) return -1;
    inputs.now_us = outputs.next_poll_us > before ? outputs.next_poll_us : before + 1;
    if (inputs.now_us > before + 10000) inputs.now_us = before + 10000;
    if (outputs.has_motion) {
      const double seconds = (double)(inputs.now_us - before) * 1e-6;
      right += seconds * (double)outputs.motion.right_m_per_s / travel;
      left += seconds * (double)outputs.motion.left_m_per_s / travel;
    }
    inputs.right.count = (uint32_t)(int32_t)right;
    inputs.left.count = (uint32_t)(int32_t)left;
  }
  return -1;
}

int main(void) {
  sonarfix_config_error_t error;
  if (sonarfix_robot_config_default(TRACK_WIDTH, &config) != SONARFIX_OK) return 1;
  if (sonarfix_map_from_walls(&map, walls, ROOM, WALLS) != SONARFIX_OK) return 2;
  memset(store, 0xff, sizeof store);
  config.may_drive_lost = 1;
  config.may_drive_without_link = 1;
  config.searches = 1;
  config.search_motion = 7;
  if (sonarfix_robot_init(&robot, &config, &map, store, 0) != SONARFIX_ERROR_VALUE) return 3;
  config.search_motion = SONARFIX_SEARCH_MOTION_AHEAD;
  config.bumper_distance_m = -1;
  if (sonarfix_robot_config_check(&config, &error) != SONARFIX_OK) return 4;
  if (strcmp(error.field, "start.motion.bumper") != 0) return 5;
  config.search_motion = SONARFIX_SEARCH_MOTION_SPIN;
  config.bumper_distance_m = 0.3f;
  if (sonarfix_robot_init(&robot, &config, &map, store, 0) != SONARFIX_OK) return 6;
  if (sonarfix_robot_start(&robot) != SONARFIX_OK) return 7;
  return fabsf(turned() - 6.2832f) < 0.2f ? 0 : 8;
}
