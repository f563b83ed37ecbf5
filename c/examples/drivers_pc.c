/* A simulated robot behind drivers.h: it drives a circle in the room of one_fix.c, and its right wheel is 1 % larger than stated. */
#include "drivers.h"

#include <math.h>
#include <stdio.h>

enum { STEPS = 300 };

static const float RIGHT_M = 0.0220f, LEFT_M = 0.0180f, TRACK_WIDTH_M = 0.16f;

static int step;
static double x = 1.0, y = 1.0, heading, beam;

uint64_t clock_us(void) { return 100000u * (uint64_t)step; }

bool read_wheels(float *right_m, float *left_m) {
  if (step == STEPS) return false;
  step += 1;
  double right = 1.01 * (double)RIGHT_M, left = (double)LEFT_M;
  double turn = (right - left) / (double)TRACK_WIDTH_M;
  x += 0.5 * (right + left) * cos(heading + 0.5 * turn);
  y += 0.5 * (right + left) * sin(heading + 0.5 * turn);
  heading += turn;
  *right_m = RIGHT_M;
  *left_m = LEFT_M;
  return true;
}

void turn_servo(float bearing_rad) { beam = heading + (double)bearing_rad; }

/* The wall that the beam is square to within 15 degrees. */
bool ping(float *range_m) {
  double along_x = cos(beam), along_y = sin(beam), square = cos(0.26);
  if (along_x > square) *range_m = (float)(4.0 - x);
  else if (along_y > square) *range_m = (float)(3.0 - y);
  else if (-along_x > square) *range_m = (float)x;
  else if (-along_y > square) *range_m = (float)y;
  else return false;
  return true;
}

void show_pose(float x_m, float y_m, float heading_rad, float deviation_m) {
  double error_mm = 1e3 * hypot((double)x_m - x, (double)y_m - y);
  if (step % 50 == 0 || step == STEPS) {
    printf("%5.1f s: %.3f m, %.3f m, %4.0f deg; deviation %.1f mm, error %.1f mm\n", 1e-6 * (double)clock_us(), (double)x_m,
           (double)y_m, (double)heading_rad * 57.29578, 1e3 * (double)deviation_m, error_mm);
  }
}
