/* A robot that localizes itself in a room of 4 m x 3 m: wheels, ping, fix, pose. Its own code is in drivers.h. */
#include "drivers.h"
#include "sonarfix.h"

static const sonarfix_segment_t room[4] = {
    {0, 0, 4, 0, 0}, {4, 0, 4, 3, 0}, {4, 3, 0, 3, 0}, {0, 3, 0, 0, 0}};
static const sonarfix_start_t start = {{1.0f, 1.0f, 0.0f}, 0.05f, 0.02f};

static sonarfix_wall_t walls[4];
static sonarfix_map_t map;
static sonarfix_localizer_t localizer;

int main(void) {
  sonarfix_config_t config;
  sonarfix_config_default(0.16f, &config);
  sonarfix_config_set_sensor(&config, 0, SONARFIX_SENSOR_HC_SR04);
  sonarfix_config_set_servo(&config, 0, SONARFIX_SERVO_SG90, -1.6f, 1.6f);
  if (sonarfix_map_from_walls(&map, walls, room, 4) != SONARFIX_OK) return 1;
  if (sonarfix_localizer_init(&localizer, &config, &map, &start, clock_us()) != SONARFIX_OK) return 1;

  float right_m, left_m, range_m;
  while (read_wheels(&right_m, &left_m)) {
    sonarfix_aim_t aim;
    sonarfix_fix_t fix;
    sonarfix_pose_t pose;
    sonarfix_health_t health;
    sonarfix_localizer_odometry(&localizer, clock_us(), right_m, left_m);
    if (sonarfix_localizer_aim(&localizer, &aim) != SONARFIX_OK) {
      sonarfix_localizer_skip(&localizer);
      continue;
    }
    turn_servo(aim.bearing_rad);
    if (ping(&range_m)) sonarfix_localizer_fix(&localizer, &aim, range_m, &fix);
    else sonarfix_localizer_no_echo(&localizer, &aim, &fix);
    sonarfix_localizer_pose(&localizer, &pose);
    sonarfix_localizer_health(&localizer, &health);
    show_pose(pose.x_m, pose.y_m, pose.heading_rad, health.position_deviation_m);
  }
  return 0;
}
