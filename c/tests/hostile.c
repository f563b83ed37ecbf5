/* Random and hostile calls: any order, NULL, misaligned, closed and copied handles, NaN, unknown numbers of enumerations.
 * `hostile CALLS SEED`. After every call the memory around all objects must be untouched and every estimate finite; after an
 * error the handle must be unchanged, and so must the result. Built with sanitizers, it is the library's test of abuse. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sonarfix.h"

enum { MAPS = 3, LOCALIZERS = 3, SEARCHES = 2, ROBOTS = 2, WALLS = 8, GUARD = 32, LINK = 700 };

/* An object between guards. */
#define GUARDED(type)      \
  struct {                 \
    uint8_t before[GUARD]; \
    type object;           \
    uint8_t after[GUARD];  \
  }

static struct {
  uint8_t first[GUARD];
  GUARDED(sonarfix_map_t) maps[MAPS];
  GUARDED(sonarfix_localizer_t) localizers[LOCALIZERS];
  GUARDED(sonarfix_search_t) searches[SEARCHES];
  GUARDED(sonarfix_robot_t) robots[ROBOTS];
  GUARDED(sonarfix_localizer_t) copies[1];
  uint8_t last[GUARD];
} world;

static sonarfix_wall_t walls[MAPS][WALLS];
static uint8_t stores[ROBOTS][SONARFIX_STORE_SIZE];
static uint64_t clock_us, state, calls, refused;
/* What must happen for the calls to mean anything. */
static uint64_t accepted, running, sought;

static uint32_t any(uint32_t below) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (uint32_t)(state >> 16) % below;
}

static uint8_t once_in(uint32_t times) { return any(times) == 0; }

/* A number about a middle; once in 200 a hostile one. */
static float number(float middle, float width) {
  static const float hostile[] = {NAN, INFINITY, -INFINITY, 1e38f, -1e38f, 1e-40f, -0.0f, 0.0f, 1e6f, -1e6f};
  if (once_in(200)) return hostile[any(sizeof hostile / sizeof *hostile)];
  return middle + width * ((float)any(20001) / 10000.0f - 1.0f);
}

/* A time near the clock, which runs on; once in 3,000 a hostile one. */
static uint64_t a_time(void) {
  if (once_in(3000)) return once_in(2) ? UINT64_MAX - any(1000) : (uint64_t)any(UINT32_MAX) << any(33);
  clock_us += any(60000);
  return once_in(30) ? clock_us - any(2000000) % (clock_us + 1) : clock_us;
}

static int32_t a_choice(int32_t count) { return once_in(20) ? (int32_t)any(UINT32_MAX) : (int32_t)any((uint32_t)count); }

static uint32_t a_count(uint32_t count) { return once_in(30) ? any(UINT32_MAX) : any(count); }

/* A pointer to an object; once in 100 NULL, once in 100 misaligned. */
static void *pointer(void *object) {
  if (once_in(100)) return NULL;
  return once_in(100) ? (void *)((uint8_t *)object + 1) : object;
}

/* A pointer to bytes, which have no alignment; once in 50 NULL. */
static void *byte_pointer(void *bytes) { return once_in(50) ? NULL : bytes; }

#define POINTER(object) pointer(&(object))
#define A_MAP ((sonarfix_map_t *)POINTER(world.maps[any(MAPS)].object))
#define A_LOCALIZER ((sonarfix_localizer_t *)POINTER(world.localizers[any(LOCALIZERS)].object))
#define A_SEARCH ((sonarfix_search_t *)POINTER(world.searches[any(SEARCHES)].object))
#define A_ROBOT ((sonarfix_robot_t *)POINTER(world.robots[any(ROBOTS)].object))

static void fail(const char *what) {
  printf("call %" PRIu64 ": %s\n", calls, what);
  abort();
}

static void set_guards(void) { memset(&world, 0xA5, sizeof world); }

static void check_guard(const uint8_t *guard) {
  for (int i = 0; i < GUARD; i++) {
    if (guard[i] != 0xA5) fail("memory beside an object was written");
  }
}

#define CHECK_GUARDS(objects, count)          \
  for (int i = 0; i < (count); i++) {         \
    check_guard(world.objects[i].before);     \
    check_guard(world.objects[i].after);      \
  }

static void check_world(void) {
  check_guard(world.first);
  check_guard(world.last);
  CHECK_GUARDS(maps, MAPS)
  CHECK_GUARDS(localizers, LOCALIZERS)
  CHECK_GUARDS(searches, SEARCHES)
  CHECK_GUARDS(robots, ROBOTS)
  CHECK_GUARDS(copies, 1)
}

static void check_estimate(const sonarfix_state_t *estimate, const sonarfix_state_t *deviations) {
  const float *numbers[2] = {&estimate->x_m, &deviations->x_m};
  for (int i = 0; i < 7; i++) {
    if (!isfinite(numbers[0][i]) || !isfinite(numbers[1][i]) || numbers[1][i] < 0) fail("an estimate is no number");
  }
}

static sonarfix_config_t a_config(void) {
  sonarfix_config_t config = {0};
  sonarfix_config_default(number(0.16f, 0.05f), &config);
  if (once_in(2)) sonarfix_config_set_sensor(&config, any(3), a_choice(3));
  if (once_in(2)) sonarfix_config_set_servo(&config, any(3), a_choice(2), number(-1.5f, 0.1f), number(1.5f, 0.1f));
  if (once_in(10)) config.ranger_count = 1 + a_count(3);
  if (once_in(10)) config.policy = a_choice(2);
  if (once_in(3)) config.gyro.is_fitted = 1;
  if (once_in(20)) ((float *)&config)[any(25)] = number(0, 2);
  if (once_in(10)) config.rangers[any(3)].ping_period_us = a_count(1000000);
  return config;
}

static sonarfix_start_t a_start(void) {
  sonarfix_start_t start = {{number(2, 2), number(1.5f, 1.5f), number(0, 4)}, number(0.05f, 0.05f), number(0.05f, 0.05f)};
  if (once_in(5)) sonarfix_start_unknown(&start);
  return start;
}

static sonarfix_pose_t a_pose(void) { return a_start().pose; }

static sonarfix_pose_noise_t a_noise(void) {
  sonarfix_pose_noise_t noise = {number(0.01f, 0.01f), number(0, 0.005f), number(0.01f, 0.01f),
                                 number(0, 0.001f),    number(0, 0.001f), number(0.01f, 0.01f)};
  return noise;
}

static sonarfix_aim_t last_aim;

static sonarfix_aim_t an_aim(void) {
  sonarfix_aim_t aim = last_aim;
  if (once_in(10)) aim.wall = a_count(9);
  if (once_in(10)) aim.ranger = a_count(4);
  if (once_in(10)) aim.bearing_rad = number(0, 3);
  if (once_in(20)) aim.range_m = number(1, 1);
  if (once_in(20)) aim.candidates = any(UINT32_MAX);
  return aim;
}

static sonarfix_status_t open_map(void) {
  static const sonarfix_segment_t rooms[MAPS][WALLS] = {
      {{0, 0, 4, 0, 0}, {4, 0, 4, 3, 0}, {4, 3, 0, 3, 0.01f}, {0, 3, 0, 0, 0}, {1, 1, 2, 1, 0}, {2, 1, 2, 2, 0}, {3, 0, 3, 1, 0}, {0, 2, 1, 2, 0}},
      {{0, 0, 3, 0, 0}, {3, 0, 3, 3, 0}, {3, 3, 0, 3, 0}, {0, 3, 0, 0, 0}, {1, 0, 1, 1, 0}, {2, 2, 2, 3, 0}, {0, 1, 0.5f, 1, 0}, {2, 1, 3, 1, 0}},
      {{-5, -5, 5, -5, 0}, {5, -5, 5, 5, 0}, {5, 5, -5, 5, 0}, {-5, 5, -5, -5, 0}, {0, 0, 1, 1, 0}, {1, 1, 2, 0, 0}, {2, 0, 1, -1, 0}, {1, -1, 0, 0, 0}}};
  uint32_t which = any(MAPS);
  sonarfix_segment_t segments[WALLS];
  memcpy(segments, rooms[which], sizeof segments);
  if (once_in(10)) {
    uint8_t garbage[256];
    for (size_t i = 0; i < sizeof garbage; i++) garbage[i] = (uint8_t)any(256);
    memcpy(garbage, "SFXM", 4);
    return sonarfix_map_from_image(POINTER(world.maps[which].object), garbage, any(sizeof garbage));
  }
  /* Walls of an open map stay as they are: only segments that are refused differ. */
  if (once_in(5)) segments[any(WALLS)].to_x_m = NAN;
  size_t count = once_in(20) ? SIZE_MAX - any(3) : once_in(20) ? 0 : WALLS;
  return sonarfix_map_from_walls(POINTER(world.maps[which].object), pointer(walls[which]), pointer(segments), count);
}

static sonarfix_status_t open_robot(void) {
  uint32_t which = any(ROBOTS);
  sonarfix_robot_config_t config;
  sonarfix_robot_config_default(0.16f, &config);
  if (once_in(4)) config.localizer = a_config();
  if (once_in(3)) config.searches = 1;
  if (once_in(3)) config.drivers[any(3)].driver = a_choice(5);
  if (once_in(10)) config.encoder_period_us = a_count(200000);
  if (once_in(10)) config.drivers[any(3)].servo_pulse_us[any(2)] = a_count(3000);
  if (once_in(10)) config.left_wheel.travel_per_count_m = number(0.0001f, 0.001f);
  return sonarfix_robot_init(POINTER(world.robots[which].object), POINTER(config), A_MAP, byte_pointer(stores[which]), a_time());
}

static sonarfix_status_t poll_robot(void) {
  static uint32_t right, left;
  uint8_t received[64], to_send[LINK + GUARD];
  sonarfix_inputs_t inputs;
  sonarfix_outputs_t outputs;
  memset(&inputs, 0, sizeof inputs);
  memset(to_send, 0xA5, sizeof to_send);
  inputs.now_us = a_time();
  inputs.right.count = right += any(20);
  inputs.left.count = left += any(20);
  inputs.right.has_failed = once_in(50);
  if (once_in(100)) inputs.left.count = any(UINT32_MAX);
  for (int i = 0; i < SONARFIX_RANGERS; i++) {
    inputs.rangers[i].has_risen = once_in(3);
    inputs.rangers[i].rose_us = once_in(20) ? a_time() : inputs.now_us - any(10000);
    inputs.rangers[i].has_fallen = once_in(3);
    inputs.rangers[i].fell_us = once_in(20) ? a_time() : inputs.now_us;
    inputs.rangers[i].reading = a_choice(4);
    inputs.rangers[i].range_m = number(1, 1);
    inputs.rangers[i].measured_us = inputs.now_us - any(1000);
  }
  inputs.has_yaw_rate = once_in(2);
  inputs.yaw_rate_rad_per_s = number(0, 1);
  inputs.received_length = any(sizeof received);
  for (size_t i = 0; i < inputs.received_length; i++) received[i] = (uint8_t)any(256);
  inputs.received = once_in(50) ? NULL : received;
  inputs.to_send_length = any(LINK);
  inputs.to_send = once_in(50) ? NULL : to_send;
  sonarfix_outputs_t *place = POINTER(outputs);
  sonarfix_status_t status = sonarfix_robot_poll(A_ROBOT, POINTER(inputs), place);
  running += status == SONARFIX_OK && outputs.is_running;
  check_guard(to_send + inputs.to_send_length);
  return status;
}

static sonarfix_status_t command_robot(void) {
  sonarfix_start_t start = a_start();
  sonarfix_pose_t pose = a_pose();
  sonarfix_pose_noise_t noise = a_noise();
  switch (any(9)) {
    case 0: return sonarfix_robot_set_pose(A_ROBOT, POINTER(start));
    case 1: return sonarfix_robot_start(A_ROBOT);
    case 2: return once_in(5) ? sonarfix_robot_stop(A_ROBOT) : sonarfix_robot_start(A_ROBOT);
    case 3: return sonarfix_robot_search(A_ROBOT);
    case 4: return sonarfix_robot_reset_calibration(A_ROBOT);
    case 5: return sonarfix_robot_heading(A_ROBOT, a_time(), number(0, 3), number(0.1f, 0.1f));
    case 6: return sonarfix_robot_position(A_ROBOT, a_time(), POINTER(pose), POINTER(noise));
    case 7: return sonarfix_robot_measured_pose(A_ROBOT, a_time(), POINTER(pose), POINTER(noise));
    default: return sonarfix_robot_work(A_ROBOT, a_time());
  }
}

static sonarfix_status_t read_robot(void) {
  sonarfix_state_t estimate, deviations;
  sonarfix_covariance_t covariance;
  sonarfix_health_t health;
  sonarfix_mismatch_t mismatch;
  sonarfix_faults_t faults;
  const sonarfix_robot_t *robot = A_ROBOT;
  sonarfix_robot_covariance(robot, POINTER(covariance));
  sonarfix_robot_health(robot, POINTER(health));
  sonarfix_robot_mismatch(robot, POINTER(mismatch));
  sonarfix_robot_faults(robot, POINTER(faults));
  sonarfix_status_t status = sonarfix_robot_deviations(robot, &deviations);
  if (status == SONARFIX_OK && sonarfix_robot_state(robot, &estimate) == SONARFIX_OK) check_estimate(&estimate, &deviations);
  return status;
}

static sonarfix_status_t open_localizer(void) {
  sonarfix_config_t config = a_config();
  sonarfix_start_t start = a_start();
  sonarfix_state_t estimate = {number(1, 1), number(1, 1), number(0, 3), 0.01f, -0.01f, 0, 0};
  sonarfix_state_t deviations = {number(0.1f, 0.1f), number(0.1f, 0.1f), number(0.1f, 0.1f), 0.01f, 0.01f, number(0.001f, 0.001f), 0};
  if (once_in(3)) return sonarfix_localizer_resume(A_LOCALIZER, POINTER(config), A_MAP, POINTER(estimate), POINTER(deviations), a_time());
  return sonarfix_localizer_init(A_LOCALIZER, POINTER(config), A_MAP, POINTER(start), a_time());
}

static sonarfix_status_t move(sonarfix_localizer_t *localizer) {
  float right_m = number(0.02f, 0.02f), left_m = number(0.02f, 0.02f);
  sonarfix_start_t start = a_start();
  switch (any(12)) {
    case 0: return sonarfix_localizer_odometry_missing(localizer, a_time());
    case 1: return sonarfix_localizer_odometry_with_turn(localizer, a_time(), right_m, left_m, number(0, 0.1f), a_count(60000));
    case 2: return once_in(5) ? sonarfix_localizer_set_clock(localizer, a_time()) : SONARFIX_OK;
    case 3: return once_in(5) ? sonarfix_localizer_set_pose(localizer, POINTER(start)) : SONARFIX_OK;
    default: return sonarfix_localizer_odometry(localizer, a_time(), right_m, left_m);
  }
}

static sonarfix_status_t aim(sonarfix_localizer_t *localizer) {
  sonarfix_standing_t standing = {number(0, 2), a_count(100000), (uint8_t)any(3)};
  sonarfix_aim_t aim;
  float score;
  memset(&aim, 0x5A, sizeof aim);
  sonarfix_status_t status;
  switch (any(4)) {
    case 0: status = sonarfix_localizer_aim_of(localizer, a_count(3), POINTER(standing), &aim); break;
    case 1: status = sonarfix_localizer_aim_at(localizer, a_count(3), number(0, 3), &aim); break;
    default: status = sonarfix_localizer_aim(localizer, &aim); break;
  }
  if (status == SONARFIX_OK) {
    last_aim = aim;
    sonarfix_aim_score(POINTER(aim), a_choice(2), &score);
  } else {
    for (size_t i = 0; i < sizeof aim; i++) {
      if (((const uint8_t *)&aim)[i] != 0x5A) fail("a result was written in spite of an error");
    }
  }
  return status;
}

static sonarfix_status_t measure(sonarfix_localizer_t *localizer) {
  sonarfix_aim_t aim = an_aim();
  sonarfix_pose_t pose = a_pose();
  sonarfix_pose_noise_t noise = a_noise();
  sonarfix_fix_t fix;
  sonarfix_absolute_fix_t absolute;
  sonarfix_status_t status;
  switch (any(10)) {
    case 0: return sonarfix_localizer_no_echo(localizer, POINTER(aim), POINTER(fix));
    case 1: return sonarfix_localizer_skip(localizer);
    case 2: return sonarfix_localizer_skip_unplanned(localizer);
    case 3: return sonarfix_localizer_ranger_failed(localizer, a_count(3));
    case 4: return sonarfix_localizer_heading(localizer, a_time(), number(0, 3), number(0.1f, 0.1f), POINTER(absolute));
    case 5: return sonarfix_localizer_position(localizer, a_time(), POINTER(pose), POINTER(noise), POINTER(absolute));
    case 6: return sonarfix_localizer_measured_pose(localizer, a_time(), POINTER(pose), POINTER(noise), POINTER(absolute));
    default:
      status = sonarfix_localizer_fix(localizer, &aim, number(aim.range_m, 0.05f), &fix);
      accepted += status == SONARFIX_OK && fix.outcome == SONARFIX_OUTCOME_ACCEPTED;
      sought += status == SONARFIX_OK && fix.outcome == SONARFIX_OUTCOME_SEARCHED;
      return status;
  }
}

static sonarfix_status_t search(sonarfix_localizer_t *localizer) {
  sonarfix_region_t region = {number(0, 1), number(0, 1), number(3, 1), number(3, 1)};
  sonarfix_mode_t mode;
  sonarfix_answer_t answer;
  sonarfix_hypothesis_t hypothesis;
  switch (any(10)) {
    case 0: return sonarfix_search_init(A_SEARCH);
    case 1: return once_in(10) ? sonarfix_search_close(A_SEARCH) : SONARFIX_OK;
    case 2: return sonarfix_localizer_attach_search(localizer, A_SEARCH);
    case 3: return once_in(5) ? sonarfix_localizer_search(localizer) : SONARFIX_OK;
    case 4: return once_in(5) ? sonarfix_localizer_search_anywhere(localizer) : SONARFIX_OK;
    case 5: return once_in(5) ? sonarfix_localizer_search_in(localizer, POINTER(region)) : SONARFIX_OK;
    case 6: return sonarfix_search_answer(A_SEARCH, POINTER(answer));
    case 7: return sonarfix_search_hypothesis(A_SEARCH, a_count(9), POINTER(hypothesis));
    default: return sonarfix_localizer_work(localizer, (uint16_t)any(40), POINTER(mode));
  }
}

static sonarfix_status_t read_localizer(const sonarfix_localizer_t *localizer) {
  sonarfix_state_t estimate, deviations;
  sonarfix_covariance_t covariance;
  sonarfix_health_t health;
  sonarfix_gyro_status_t gyro;
  sonarfix_mode_t mode;
  sonarfix_pose_t pose;
  sonarfix_mismatch_t mismatch;
  uint64_t time_us;
  uint8_t is_missing;
  float association;
  sonarfix_localizer_pose(localizer, POINTER(pose));
  sonarfix_localizer_covariance(localizer, POINTER(covariance));
  sonarfix_localizer_health(localizer, POINTER(health));
  sonarfix_localizer_mismatch(localizer, POINTER(mismatch));
  sonarfix_localizer_gyro(localizer, POINTER(gyro));
  sonarfix_localizer_mode(localizer, POINTER(mode));
  sonarfix_localizer_time(localizer, POINTER(time_us));
  sonarfix_localizer_is_odometry_missing(localizer, byte_pointer(&is_missing));
  sonarfix_localizer_association(localizer, POINTER(association));
  sonarfix_status_t status = sonarfix_localizer_deviations(localizer, &deviations);
  if (status == SONARFIX_OK && sonarfix_localizer_state(localizer, &estimate) == SONARFIX_OK) check_estimate(&estimate, &deviations);
  return status;
}

/* Calls with a localizer; after an error it must be as before. */
static sonarfix_status_t use_localizer(void) {
  static sonarfix_localizer_t before;
  uint32_t which = any(LOCALIZERS);
  sonarfix_localizer_t *place = &world.localizers[which].object, *localizer = pointer(place);
  memcpy(&before, place, sizeof before);
  sonarfix_status_t status;
  switch (any(5)) {
    case 0: return move(localizer);
    case 1: status = aim(localizer); break;
    case 2: status = measure(localizer); break;
    case 3: status = search(localizer); break;
    default: status = read_localizer(localizer); break;
  }
  if (status != SONARFIX_OK && memcmp(&before, place, sizeof before) != 0) fail("an error changed a localizer");
  return status;
}

static sonarfix_status_t rare(void) {
  sonarfix_config_error_t error;
  sonarfix_config_t config = a_config();
  sonarfix_robot_config_t robot;
  sonarfix_start_t start = a_start();
  uint32_t count;
  uint8_t garbage[64];
  for (size_t i = 0; i < sizeof garbage; i++) garbage[i] = (uint8_t)any(256);
  memcpy(garbage, "SFXC\x08\x00", 6);
  switch (any(12)) {
    case 0: return once_in(8) ? sonarfix_map_close(A_MAP) : open_map();
    case 1: return once_in(8) ? sonarfix_localizer_close(A_LOCALIZER) : open_map();
    case 2: return once_in(8) ? sonarfix_robot_close(A_ROBOT) : open_robot();
    case 3: return sonarfix_config_check(POINTER(config), byte_pointer(&error));
    case 4: return sonarfix_config_from_image(once_in(20) ? NULL : garbage, any(sizeof garbage), POINTER(config));
    case 5: return sonarfix_robot_config_from_image(garbage, any(sizeof garbage), POINTER(robot));
    case 6: return sonarfix_map_count(A_MAP, POINTER(count));
    case 7: return sonarfix_start_unknown(POINTER(start));
    case 8: return sonarfix_status_text((int32_t)any(UINT32_MAX))[0] ? SONARFIX_OK : SONARFIX_ERROR_OTHER;
    case 9: /* A copy of a handle is closed. */
      memcpy(&world.copies[0].object, &world.localizers[any(LOCALIZERS)].object, sizeof(sonarfix_localizer_t));
      if (read_localizer(&world.copies[0].object) != SONARFIX_ERROR_NOT_OPEN) fail("a copy of a handle is open");
      return SONARFIX_OK;
    case 10: return open_robot();
    default: return open_map();
  }
}

static sonarfix_status_t call(void) {
  switch (any(40)) {
    case 0: return rare();
    case 1: return once_in(3) ? open_robot() : open_localizer();
    case 2: return command_robot();
    case 3: return read_robot();
    case 4:
    case 5:
    case 6:
    case 7:
    case 8:
    case 9:
    case 10:
    case 11: return poll_robot();
    default: return use_localizer();
  }
}

int main(int argc, char **argv) {
  uint64_t count = argc > 1 ? strtoull(argv[1], NULL, 10) : 100000;
  state = argc > 2 ? strtoull(argv[2], NULL, 10) : 1;
  state = state * 0x9E3779B97F4A7C15u + 1;
  set_guards();
  memset(stores, 0xFF, sizeof stores);
  for (calls = 0; calls < count; calls++) {
    refused += call() != SONARFIX_OK;
    check_world();
  }
  printf("%" PRIu64 " calls: %" PRIu64 " errors, %" PRIu64 " ranges accepted, %" PRIu64 " searched, %" PRIu64 " polls of a running loop\n",
         calls, refused, accepted, sought, running);
  return accepted < count / 1000 || sought < count / 10000 || running < count / 1000;
}
