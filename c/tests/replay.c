/* Replays a golden trace through the C interface, and compares a hash of all that the library returns with that of the trace.
 * The trace is linked into the program (trace.S); `golden_in_c` of sonarfix-pil-host has its format. */
#include "replay.h"

#include "sonarfix.h"

extern const uint8_t trace[];

enum { END, ODOMETRY, AIM, FIX, NO_ECHO, SKIP, ABSOLUTE, POLL };
enum { LINK = 4096 };

static const uint8_t *next;
static uint64_t hash = 0xcbf29ce484222325u;

static sonarfix_map_t map;
static sonarfix_localizer_t localizer;
static sonarfix_robot_t robot;
static sonarfix_robot_config_t config;
static sonarfix_aim_t aim;
static uint8_t store[SONARFIX_STORE_SIZE];
static uint8_t link[LINK];

/* memcpy without a C library. */
static void copy(void *to, const void *from, size_t length) {
  for (size_t i = 0; i < length; i++) ((uint8_t *)to)[i] = ((const uint8_t *)from)[i];
}

static uint8_t byte(void) { return *next++; }

static uint32_t word(void) {
  uint32_t value;
  copy(&value, next, sizeof value);
  next += sizeof value;
  return value;
}

static uint64_t two_words(void) {
  uint64_t low = word();
  return low | (uint64_t)word() << 32;
}

static float number(void) {
  float value;
  copy(&value, next, sizeof value);
  next += sizeof value;
  return value;
}

static const uint8_t *block(size_t *length) {
  *length = word();
  const uint8_t *bytes = next;
  next += *length;
  return bytes;
}

static void add(uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) hash = (hash ^ (value >> shift & 0xff)) * 0x100000001b3u;
}

static void add_number(float value) {
  uint32_t bits;
  copy(&bits, &value, sizeof bits);
  add(bits);
}

static void add_estimate(const sonarfix_state_t *state, const sonarfix_covariance_t *covariance) {
  const float states[7] = {state->x_m,         state->y_m,        state->heading_rad,        state->scale_right,
                           state->scale_left, state->track_width_error_m, state->range_scale};
  for (int i = 0; i < 7; i++) add_number(states[i]);
  for (int i = 0; i < SONARFIX_COVARIANCE_ENTRIES; i++) add_number(covariance->upper[i]);
}

static void add_health(const sonarfix_health_t *health) {
  add((uint32_t)health->time_since_fix_us);
  add((uint32_t)(health->time_since_fix_us >> 32));
  add((uint32_t)health->verdict);
  add_number(health->evidence);
  add_number(health->nis);
  add_number(health->rolled_since_fix_m);
  add_number(health->position_deviation_m);
  add_number(health->heading_deviation_rad);
  add(health->accepted_in_a_row);
  add(health->gated_in_a_row);
  add(health->silent_in_a_row);
  add(health->inflations);
}

static void add_localizer(void) {
  sonarfix_state_t state;
  sonarfix_covariance_t covariance;
  sonarfix_health_t health;
  sonarfix_localizer_state(&localizer, &state);
  sonarfix_localizer_covariance(&localizer, &covariance);
  sonarfix_localizer_health(&localizer, &health);
  add_estimate(&state, &covariance);
  add_health(&health);
}

static void odometry(void) {
  uint64_t at = two_words();
  float right_m = number(), left_m = number();
  uint8_t has_turn = byte();
  float turn_rad = number();
  uint32_t turn_us = word();
  sonarfix_status_t status =
      has_turn ? sonarfix_localizer_odometry_with_turn(&localizer, at, right_m, left_m, turn_rad, turn_us)
               : sonarfix_localizer_odometry(&localizer, at, right_m, left_m);
  add((uint32_t)status);
  add_localizer();
}

static void choose(void) {
  sonarfix_status_t status = sonarfix_localizer_aim(&localizer, &aim);
  add((uint32_t)status);
  if (status != SONARFIX_OK) return;
  add(aim.wall);
  add(aim.ranger);
  add_number(aim.bearing_rad);
  add_number(aim.range_m);
  add_number(aim.gain_m2);
  add_number(aim.success);
  add(aim.duration_us);
  add(aim.candidates);
}

static void measure(int has_echo) {
  sonarfix_fix_t fix = {0};
  if (has_echo) sonarfix_localizer_fix(&localizer, &aim, number(), &fix);
  else sonarfix_localizer_no_echo(&localizer, &aim, &fix);
  add((uint32_t)fix.outcome);
  add((uint32_t)fix.refusal);
  add((uint32_t)fix.filter_error);
  add_number(fix.innovation_m);
  add_number(fix.variance_m2);
  add_localizer();
}

static void skip(void) {
  sonarfix_health_t health;
  sonarfix_localizer_skip(&localizer);
  sonarfix_localizer_health(&localizer, &health);
  add_health(&health);
}

static void measure_absolute(int has_loop) {
  uint64_t at = two_words();
  uint8_t kind = byte();
  sonarfix_pose_t pose;
  sonarfix_pose_noise_t noise;
  pose.x_m = number();
  pose.y_m = number();
  pose.heading_rad = number();
  noise.xx_m2 = number();
  noise.xy_m2 = number();
  noise.yy_m2 = number();
  noise.xh_m_rad = number();
  noise.yh_m_rad = number();
  noise.hh_rad2 = number();
  sonarfix_absolute_fix_t fix = {0};
  if (has_loop) {
    sonarfix_status_t status = kind == 0   ? sonarfix_robot_heading(&robot, at, pose.heading_rad, noise.hh_rad2)
                               : kind == 1 ? sonarfix_robot_position(&robot, at, &pose, &noise)
                                           : sonarfix_robot_measured_pose(&robot, at, &pose, &noise);
    add(status == SONARFIX_OK);
    return;
  }
  if (kind == 0) sonarfix_localizer_heading(&localizer, at, pose.heading_rad, noise.hh_rad2, &fix);
  else if (kind == 1) sonarfix_localizer_position(&localizer, at, &pose, &noise, &fix);
  else sonarfix_localizer_measured_pose(&localizer, at, &pose, &noise, &fix);
  add((uint32_t)fix.outcome);
  add((uint32_t)fix.refusal);
  add((uint32_t)fix.filter_error);
  add_number(fix.nis);
  add(fix.dimensions);
  add_localizer();
}

/* CRC-32 of the bytes that were sent. */
static uint32_t checksum(const uint8_t *bytes, size_t length) {
  uint32_t crc = 0xffffffffu;
  for (size_t i = 0; i < length; i++) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (0xedb88320u & (0u - (crc & 1u)));
  }
  return ~crc;
}

static void add_robot(const sonarfix_outputs_t *outputs) {
  for (int i = 0; i < SONARFIX_RANGERS; i++) {
    const sonarfix_ranger_output_t *ranger = &outputs->rangers[i];
    float frame_us = (float)config.localizer.rangers[i].servo_frame_us;
    add(ranger->has_servo_pulse);
    add(ranger->has_servo_pulse ? (uint32_t)(ranger->servo_pulse_us * 65535.0f / frame_us + 0.5f) : 0);
    add(ranger->trigger);
    add(ranger->starts);
  }
  sonarfix_state_t state;
  int has_estimate = outputs->has_worked && sonarfix_robot_state(&robot, &state) == SONARFIX_OK;
  add((uint32_t)has_estimate);
  if (has_estimate) {
    sonarfix_covariance_t covariance;
    sonarfix_health_t health;
    sonarfix_robot_covariance(&robot, &covariance);
    sonarfix_robot_health(&robot, &health);
    add_estimate(&state, &covariance);
    add_health(&health);
  }
  add(checksum(link, outputs->to_send));
}

static void poll(void) {
  sonarfix_inputs_t inputs = {0};
  sonarfix_outputs_t outputs;
  inputs.now_us = two_words();
  sonarfix_encoder_input_t *encoders[2] = {&inputs.right, &inputs.left};
  for (int i = 0; i < 2; i++) {
    encoders[i]->count = word();
    encoders[i]->illegal = word();
    encoders[i]->has_failed = byte();
  }
  for (int i = 0; i < SONARFIX_RANGERS; i++) {
    inputs.rangers[i].has_risen = byte();
    inputs.rangers[i].rose_us = two_words();
    inputs.rangers[i].has_fallen = byte();
    inputs.rangers[i].fell_us = two_words();
  }
  inputs.has_yaw_rate = byte();
  inputs.yaw_rate_rad_per_s = number();
  inputs.to_send = link;
  inputs.to_send_length = sizeof link;
  if (sonarfix_robot_poll(&robot, &inputs, &outputs) == SONARFIX_OK) add_robot(&outputs);
}

/* Starts the loop by commands over its link. */
static sonarfix_status_t start_loop(uint64_t at, uint32_t commands) {
  sonarfix_outputs_t outputs;
  for (size_t i = 0; i < sizeof store; i++) store[i] = 0xff;
  sonarfix_status_t status = sonarfix_robot_init(&robot, &config, &map, store, at);
  while (status == SONARFIX_OK && commands-- > 0) {
    sonarfix_inputs_t inputs = {0};
    inputs.now_us = at;
    inputs.has_yaw_rate = 1;
    inputs.received = block(&inputs.received_length);
    inputs.to_send = link;
    inputs.to_send_length = sizeof link;
    status = sonarfix_robot_poll(&robot, &inputs, &outputs);
  }
  return status;
}

static sonarfix_status_t begin(int *has_loop) {
  size_t length;
  *has_loop = byte();
  const uint8_t *image = block(&length);
  sonarfix_status_t status = SONARFIX_OK;
  if (*has_loop) status = sonarfix_robot_config_from_image(image, length, &config);
  else copy(&config.localizer, image, sizeof config.localizer);
  if (status != SONARFIX_OK) return status;
  image = block(&length);
  status = sonarfix_map_from_image(&map, image, length);
  if (status != SONARFIX_OK) return status;
  uint64_t at = two_words();
  sonarfix_start_t start;
  start.pose.x_m = number();
  start.pose.y_m = number();
  start.pose.heading_rad = number();
  start.position_deviation_m = number();
  start.heading_deviation_rad = number();
  uint32_t commands = word();
  if (*has_loop) return start_loop(at, commands);
  return sonarfix_localizer_init(&localizer, &config.localizer, &map, &start, at);
}

int replay(void) {
  int has_loop;
  next = trace;
  if (begin(&has_loop) != SONARFIX_OK) return 0;
  for (;;) {
    switch (byte()) {
      case ODOMETRY: odometry(); break;
      case AIM: choose(); break;
      case FIX: measure(1); break;
      case NO_ECHO: measure(0); break;
      case SKIP: skip(); break;
      case ABSOLUTE: measure_absolute(has_loop); break;
      case POLL: poll(); break;
      case END: return hash == two_words();
      default: return 0;
    }
  }
}
