/* The drivers of one_fix.c on an emulated core: a robot that drives a circle and always hears the same. */
#include "core.h"
#include "drivers.h"

enum { STEPS = 300 };

static int step;

int main(void);

int run(void) { return main() == 0; }

uint64_t clock_us(void) { return 100000u * (uint64_t)step; }

bool read_wheels(float *right_m, float *left_m) {
  *right_m = 0.0220f;
  *left_m = 0.0180f;
  return step++ < STEPS;
}

void turn_servo(float bearing_rad) { (void)bearing_rad; }

bool ping(float *range_m) {
  *range_m = 1.0f;
  return true;
}

void show_pose(float x_m, float y_m, float heading_rad, float deviation_m) {
  (void)x_m, (void)y_m, (void)heading_rad, (void)deviation_m;
}
