/* Replays the golden trace of a localizer alone through the classes of sonarfix.hpp. replay.c has the hash and the format. */
#include "sonarfix.hpp"

#include <cstdio>
#include <cstring>
#include <initializer_list>

extern "C" const uint8_t trace[];

namespace {

class Reader {
 public:
  explicit Reader(const uint8_t *at) : at_(at) {}
  template <typename T>
  T read() {
    T value;
    std::memcpy(&value, at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  const uint8_t *block(size_t &length) {
    length = read<uint32_t>();
    const uint8_t *bytes = at_;
    at_ += length;
    return bytes;
  }

 private:
  const uint8_t *at_;
};

class Hash {
 public:
  void add(uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) value_ = (value_ ^ (word >> shift & 0xff)) * 0x100000001b3u;
  }
  void add(float number) {
    uint32_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    add(bits);
  }
  template <typename T>
  void add_code(T code) { add(static_cast<uint32_t>(code)); }
  void add(const sonarfix_health_t &health) {
    add(static_cast<uint32_t>(health.time_since_fix_us));
    add(static_cast<uint32_t>(health.time_since_fix_us >> 32));
    add_code(health.verdict);
    for (float number : {health.evidence, health.nis, health.rolled_since_fix_m}) add(number);
    for (float number : {health.position_deviation_m, health.heading_deviation_rad}) add(number);
    for (uint16_t count : {health.accepted_in_a_row, health.gated_in_a_row}) add(uint32_t{count});
    for (uint16_t count : {health.silent_in_a_row, health.inflations}) add(uint32_t{count});
  }
  void add(const sonarfix::Localizer &localizer) {
    auto state = localizer.state();
    for (float number : {state->x_m, state->y_m, state->heading_rad, state->scale_right, state->scale_left}) add(number);
    add(state->track_width_error_m);
    add(state->range_scale);
    for (float number : localizer.covariance()->upper) add(number);
    add(*localizer.health());
  }
  void add(const sonarfix::Fix &fix) {
    add_code(fix.what());
    add_code(fix.refusal);
    add_code(fix.filter_error);
    add(fix.innovation_m);
    add(fix.variance_m2);
  }
  void add(const sonarfix::Aim &aim) {
    add(aim.wall);
    add(aim.ranger);
    for (float number : {aim.bearing_rad, aim.range_m, aim.gain_m2, aim.success}) add(number);
    add(aim.duration_us);
    add(aim.candidates);
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xcbf29ce484222325u;
};

sonarfix::Map map;
sonarfix::Localizer localizer;

bool begin(Reader &reader) {
  if (reader.read<uint8_t>() != 0) return false;
  size_t length;
  sonarfix::Config config(0.1f);
  std::memcpy(static_cast<sonarfix_config_t *>(&config), reader.block(length), sizeof(sonarfix_config_t));
  const uint8_t *image = reader.block(length);
  if (!map.begin(image, length)) return false;
  auto at = reader.read<uint64_t>();
  auto start = reader.read<sonarfix::Start>();
  return reader.read<uint32_t>() == 0 && localizer.begin(config, map, start, at).ok();
}

bool replay() {
  Reader reader(trace);
  Hash hash;
  sonarfix::Aim aim{};
  if (!begin(reader)) return false;
  for (;;) {
    switch (reader.read<uint8_t>()) {
      case 0: return hash.value() == reader.read<uint64_t>();
      case 1: {
        auto at = reader.read<uint64_t>();
        auto right_m = reader.read<float>(), left_m = reader.read<float>();
        auto has_turn = reader.read<uint8_t>() != 0;
        auto turn_rad = reader.read<float>();
        auto turn_us = reader.read<uint32_t>();
        auto status = has_turn ? localizer.odometry(at, right_m, left_m, turn_rad, turn_us) : localizer.odometry(at, right_m, left_m);
        hash.add_code(status.code());
        hash.add(localizer);
        break;
      }
      case 2: {
        auto chosen = localizer.aim();
        hash.add_code(chosen.status().code());
        if (chosen) hash.add(aim = *chosen);
        break;
      }
      case 3: {
        hash.add(*localizer.fix(aim, reader.read<float>()));
        hash.add(localizer);
        break;
      }
      case 4: {
        hash.add(*localizer.no_echo(aim));
        hash.add(localizer);
        break;
      }
      case 5: {
        if (localizer.skip()) hash.add(*localizer.health());
        break;
      }
      default: return false;
    }
  }
}

}  // namespace

int main() {
  bool is_equal = replay();
  std::puts(is_equal ? "equal" : "different");
  return is_equal ? 0 : 1;
}
