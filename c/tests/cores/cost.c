/* Replays the linked golden trace on an emulated Cortex-M, and prints the instructions of its calls of the library: linked with
 * --wrap of each. One instruction takes 128 ns of QEMU's time (-icount shift=7), which SysTick counts at 25 MHz. */
#include "../replay.h"
#include "core.h"
#include "sonarfix.h"

#define SYSTICK ((volatile uint32_t *)0xE000E010)

typedef struct {
  uint32_t calls;
  uint32_t ticks;
} cost_t;

static cost_t empty, odometry, aim, fix;

static void start(void) { SYSTICK[2] = 0; }

static void stop(cost_t *cost) {
  cost->ticks += 0xFFFFFFu - SYSTICK[2];
  cost->calls++;
}

__attribute__((noinline)) sonarfix_status_t nothing(sonarfix_localizer_t *, const sonarfix_aim_t *, float, sonarfix_fix_t *);
sonarfix_status_t nothing(sonarfix_localizer_t *localizer, const sonarfix_aim_t *at, float range_m, sonarfix_fix_t *result) {
  (void)localizer, (void)at, (void)range_m, (void)result;
  __asm volatile("");
  return SONARFIX_OK;
}

sonarfix_status_t __real_sonarfix_localizer_odometry(sonarfix_localizer_t *, uint64_t, float, float);
sonarfix_status_t __wrap_sonarfix_localizer_odometry(sonarfix_localizer_t *, uint64_t, float, float);
sonarfix_status_t __wrap_sonarfix_localizer_odometry(sonarfix_localizer_t *localizer, uint64_t now_us, float right_m, float left_m) {
  start();
  sonarfix_status_t status = __real_sonarfix_localizer_odometry(localizer, now_us, right_m, left_m);
  stop(&odometry);
  return status;
}

sonarfix_status_t __real_sonarfix_localizer_aim(sonarfix_localizer_t *, sonarfix_aim_t *);
sonarfix_status_t __wrap_sonarfix_localizer_aim(sonarfix_localizer_t *, sonarfix_aim_t *);
sonarfix_status_t __wrap_sonarfix_localizer_aim(sonarfix_localizer_t *localizer, sonarfix_aim_t *result) {
  start();
  sonarfix_status_t status = __real_sonarfix_localizer_aim(localizer, result);
  stop(&aim);
  return status;
}

sonarfix_status_t __real_sonarfix_localizer_fix(sonarfix_localizer_t *, const sonarfix_aim_t *, float, sonarfix_fix_t *);
sonarfix_status_t __wrap_sonarfix_localizer_fix(sonarfix_localizer_t *, const sonarfix_aim_t *, float, sonarfix_fix_t *);
sonarfix_status_t __wrap_sonarfix_localizer_fix(sonarfix_localizer_t *localizer, const sonarfix_aim_t *at, float range_m,
                                                sonarfix_fix_t *result) {
  start();
  nothing(localizer, at, range_m, result);
  stop(&empty);
  start();
  sonarfix_status_t status = __real_sonarfix_localizer_fix(localizer, at, range_m, result);
  stop(&fix);
  return status;
}

/* The mean, without the overhead of the measurement, as `name number`. */
static void report(const char *name, const cost_t *cost) {
  if (cost->calls == 0 || empty.calls == 0) return;
  uint32_t ticks = cost->ticks / cost->calls - empty.ticks / empty.calls;
  uint32_t instructions = ticks * 40 / 128;
  char text[12];
  int at = sizeof text - 1;
  text[at] = 0;
  text[--at] = '\n';
  do {
    text[--at] = (char)('0' + instructions % 10);
    instructions /= 10;
  } while (instructions != 0);
  print(name);
  print(&text[at]);
}

int run(void) {
  SYSTICK[1] = 0xFFFFFFu;
  SYSTICK[0] = 5;
  int is_equal = replay();
  report("odometry ", &odometry);
  report("aim ", &aim);
  report("fix ", &fix);
  return is_equal;
}
