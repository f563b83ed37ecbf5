/* Sonarfix for C++17: thin classes on sonarfix.h, which has the meaning, unit, frame and errors of every call.
 *
 * No exception, no heap, no virtual function. A class opens its handle by `begin`, and closes it when it ends. It can be neither
 * copied nor moved, because a handle stays where it is. A call returns a Status, or a Result: a value, or the reason for none.
 */
#ifndef SONARFIX_HPP
#define SONARFIX_HPP

#include "sonarfix.h"

namespace sonarfix {

/// The status of a call.
class [[nodiscard]] Status {
 public:
  constexpr Status(sonarfix_status_t code) noexcept : code_(code) {}
  constexpr bool ok() const noexcept { return code_ == SONARFIX_OK; }
  constexpr explicit operator bool() const noexcept { return ok(); }
  constexpr sonarfix_status_t code() const noexcept { return code_; }
  /// In English. A program that does not call it does not link the texts.
  const char *text() const noexcept { return sonarfix_status_text(static_cast<int32_t>(code_)); }

 private:
  sonarfix_status_t code_;
};

/// A value, or the status that says why there is none.
template <typename T>
class [[nodiscard]] Result {
 public:
  /// From a call that writes its result: `Result<T>::of([](T *out) { return …; })`.
  template <typename Call>
  static Result of(Call call) noexcept {
    Result result;
    result.status_ = call(&result.value_);
    return result;
  }
  bool has_value() const noexcept { return status_.ok(); }
  explicit operator bool() const noexcept { return has_value(); }
  Status status() const noexcept { return status_; }
  /// The value; zeros if there is none.
  const T &operator*() const noexcept { return value_; }
  const T *operator->() const noexcept { return &value_; }
  T value_or(const T &other) const noexcept { return has_value() ? value_ : other; }

 private:
  T value_{};
  Status status_{SONARFIX_ERROR_OTHER};
};

enum class Verdict : int32_t {
  tracking = SONARFIX_VERDICT_TRACKING,
  degraded = SONARFIX_VERDICT_DEGRADED,
  lost = SONARFIX_VERDICT_LOST,
};

enum class Mode : int32_t {
  tracking = SONARFIX_MODE_TRACKING,
  searching = SONARFIX_MODE_SEARCHING,
  provisional = SONARFIX_MODE_PROVISIONAL,
};

enum class Outcome : int32_t {
  accepted = SONARFIX_OUTCOME_ACCEPTED,
  downweighted = SONARFIX_OUTCOME_DOWNWEIGHTED,
  gated = SONARFIX_OUTCOME_GATED,
  refused = SONARFIX_OUTCOME_REFUSED,
  searched = SONARFIX_OUTCOME_SEARCHED,
  not_novel = SONARFIX_OUTCOME_NOT_NOVEL,
  other = SONARFIX_OUTCOME_OTHER,
};

enum class Sensor : int32_t {
  ideal = SONARFIX_SENSOR_IDEAL,
  hc_sr04 = SONARFIX_SENSOR_HC_SR04,
  vl53l1x = SONARFIX_SENSOR_VL53L1X,
};

enum class Servo : int32_t { instant = SONARFIX_SERVO_INSTANT, sg90 = SONARFIX_SERVO_SG90 };

using Aim = sonarfix_aim_t;
using Covariance = sonarfix_covariance_t;
using Deviations = sonarfix_state_t;
using Pose = sonarfix_pose_t;
using PoseNoise = sonarfix_pose_noise_t;
using Segment = sonarfix_segment_t;
using Start = sonarfix_start_t;
using State = sonarfix_state_t;
using Wall = sonarfix_wall_t;

/// What the localizer did with a ping.
struct Fix : sonarfix_fix_t {
  Outcome what() const noexcept { return static_cast<Outcome>(outcome); }
  bool is_used() const noexcept { return what() == Outcome::accepted || what() == Outcome::downweighted; }
};

/// What the localizer did with an absolute measurement.
struct AbsoluteFix : sonarfix_absolute_fix_t {
  Outcome what() const noexcept { return static_cast<Outcome>(outcome); }
};

/// The verdict and the numbers behind it.
struct Health : sonarfix_health_t {
  Verdict what() const noexcept { return static_cast<Verdict>(verdict); }
};

/// The parameters of a localizer, with the defaults for a track width.
struct Config : sonarfix_config_t {
  explicit Config(float width_m) noexcept : sonarfix_config_t{} { (void)sonarfix_config_default(width_m, this); }
  Status set_sensor(uint32_t ranger, Sensor sensor) noexcept {
    return sonarfix_config_set_sensor(this, ranger, static_cast<int32_t>(sensor));
  }
  Status set_servo(uint32_t ranger, Servo servo, float right_rad, float left_rad) noexcept {
    return sonarfix_config_set_servo(this, ranger, static_cast<int32_t>(servo), right_rad, left_rad);
  }
};

/// What all handles have in common.
template <typename Handle, sonarfix_status_t (*Close)(Handle *)>
class Owner {
 public:
  Owner() noexcept = default;
  Owner(const Owner &) = delete;
  Owner &operator=(const Owner &) = delete;
  ~Owner() { close(); }
  /// Closes the handle, if it is open.
  void close() noexcept { (void)Close(&handle_); }
  /// The handle, for functions of sonarfix.h.
  Handle *get() noexcept { return &handle_; }
  const Handle *get() const noexcept { return &handle_; }

 private:
  Handle handle_{};
};

/// A map.
class Map : public Owner<sonarfix_map_t, sonarfix_map_close> {
 public:
  template <size_t N>
  Status begin(Wall (&walls)[N], const Segment (&segments)[N]) noexcept {
    return sonarfix_map_from_walls(get(), walls, segments, N);
  }
  Status begin(const uint8_t *image, size_t length) noexcept { return sonarfix_map_from_image(get(), image, length); }
};

/// A search for the pose. It outlives the localizer to which it is attached.
class Search : public Owner<sonarfix_search_t, sonarfix_search_close> {
 public:
  Status begin() noexcept { return sonarfix_search_init(get()); }
  Result<sonarfix_answer_t> answer() const noexcept {
    return Result<sonarfix_answer_t>::of([this](auto *out) { return sonarfix_search_answer(get(), out); });
  }
  Result<sonarfix_hypothesis_t> hypothesis(uint32_t rank) const noexcept {
    return Result<sonarfix_hypothesis_t>::of([this, rank](auto *out) { return sonarfix_search_hypothesis(get(), rank, out); });
  }
};

/// A localizer.
class Localizer : public Owner<sonarfix_localizer_t, sonarfix_localizer_close> {
 public:
  Status begin(const sonarfix_config_t &config, const Map &map, const Start &start, uint64_t now_us) noexcept {
    return sonarfix_localizer_init(get(), &config, map.get(), &start, now_us);
  }
  Status resume(const sonarfix_config_t &config, const Map &map, const State &state, const Deviations &deviations,
                uint64_t now_us) noexcept {
    return sonarfix_localizer_resume(get(), &config, map.get(), &state, &deviations, now_us);
  }
  Status odometry(uint64_t now_us, float right_m, float left_m) noexcept {
    return sonarfix_localizer_odometry(get(), now_us, right_m, left_m);
  }
  Status odometry(uint64_t now_us, float right_m, float left_m, float turn_rad, uint32_t turn_us) noexcept {
    return sonarfix_localizer_odometry_with_turn(get(), now_us, right_m, left_m, turn_rad, turn_us);
  }
  Status odometry_missing(uint64_t now_us) noexcept { return sonarfix_localizer_odometry_missing(get(), now_us); }
  Status set_pose(const Start &start) noexcept { return sonarfix_localizer_set_pose(get(), &start); }
  Status set_clock(uint64_t now_us) noexcept { return sonarfix_localizer_set_clock(get(), now_us); }
  Result<Aim> aim() noexcept {
    return Result<Aim>::of([this](Aim *out) { return sonarfix_localizer_aim(get(), out); });
  }
  Result<Aim> aim_of(uint32_t ranger, const sonarfix_standing_t &standing) noexcept {
    return Result<Aim>::of([&](Aim *out) { return sonarfix_localizer_aim_of(get(), ranger, &standing, out); });
  }
  Result<Aim> aim_at(uint32_t ranger, float bearing_rad) const noexcept {
    return Result<Aim>::of([&](Aim *out) { return sonarfix_localizer_aim_at(get(), ranger, bearing_rad, out); });
  }
  Result<Fix> fix(const Aim &aim, float range_m) noexcept {
    return Result<Fix>::of([&](Fix *out) { return sonarfix_localizer_fix(get(), &aim, range_m, out); });
  }
  Result<Fix> no_echo(const Aim &aim) noexcept {
    return Result<Fix>::of([&](Fix *out) { return sonarfix_localizer_no_echo(get(), &aim, out); });
  }
  Status skip() noexcept { return sonarfix_localizer_skip(get()); }
  Status skip_unplanned() noexcept { return sonarfix_localizer_skip_unplanned(get()); }
  Status ranger_failed(uint32_t ranger) noexcept { return sonarfix_localizer_ranger_failed(get(), ranger); }
  Result<AbsoluteFix> heading(uint64_t at_us, float heading_rad, float deviation_rad) noexcept {
    return Result<AbsoluteFix>::of(
        [&](AbsoluteFix *out) { return sonarfix_localizer_heading(get(), at_us, heading_rad, deviation_rad, out); });
  }
  Result<AbsoluteFix> position(uint64_t at_us, const Pose &measured, const PoseNoise &noise) noexcept {
    return Result<AbsoluteFix>::of(
        [&](AbsoluteFix *out) { return sonarfix_localizer_position(get(), at_us, &measured, &noise, out); });
  }
  Result<AbsoluteFix> measured_pose(uint64_t at_us, const Pose &measured, const PoseNoise &noise) noexcept {
    return Result<AbsoluteFix>::of(
        [&](AbsoluteFix *out) { return sonarfix_localizer_measured_pose(get(), at_us, &measured, &noise, out); });
  }
  Result<Pose> pose() const noexcept {
    return Result<Pose>::of([this](Pose *out) { return sonarfix_localizer_pose(get(), out); });
  }
  Result<State> state() const noexcept {
    return Result<State>::of([this](State *out) { return sonarfix_localizer_state(get(), out); });
  }
  Result<Deviations> deviations() const noexcept {
    return Result<Deviations>::of([this](Deviations *out) { return sonarfix_localizer_deviations(get(), out); });
  }
  Result<Covariance> covariance() const noexcept {
    return Result<Covariance>::of([this](Covariance *out) { return sonarfix_localizer_covariance(get(), out); });
  }
  Result<Health> health() const noexcept {
    return Result<Health>::of([this](Health *out) { return sonarfix_localizer_health(get(), out); });
  }
  Result<sonarfix_gyro_status_t> gyro() const noexcept {
    return Result<sonarfix_gyro_status_t>::of([this](auto *out) { return sonarfix_localizer_gyro(get(), out); });
  }
  Mode mode() const noexcept {
    sonarfix_mode_t mode = SONARFIX_MODE_TRACKING;
    (void)sonarfix_localizer_mode(get(), &mode);
    return static_cast<Mode>(mode);
  }
  Status attach(Search &search) noexcept { return sonarfix_localizer_attach_search(get(), search.get()); }
  Status detach() noexcept { return sonarfix_localizer_attach_search(get(), nullptr); }
  Status search() noexcept { return sonarfix_localizer_search(get()); }
  Status search_anywhere() noexcept { return sonarfix_localizer_search_anywhere(get()); }
  Status search_in(const sonarfix_region_t &region) noexcept { return sonarfix_localizer_search_in(get(), &region); }
  Status work(uint16_t evaluations) noexcept {
    sonarfix_mode_t mode = SONARFIX_MODE_TRACKING;
    return sonarfix_localizer_work(get(), evaluations, &mode);
  }
};

/// A robot: the loop and its link.
class Robot : public Owner<sonarfix_robot_t, sonarfix_robot_close> {
 public:
  Status begin(const sonarfix_robot_config_t &config, const Map &map, uint8_t (&store)[SONARFIX_STORE_SIZE],
               uint64_t now_us) noexcept {
    return sonarfix_robot_init(get(), &config, map.get(), store, now_us);
  }
  Result<sonarfix_outputs_t> poll(const sonarfix_inputs_t &inputs) noexcept {
    return Result<sonarfix_outputs_t>::of([&](auto *out) { return sonarfix_robot_poll(get(), &inputs, out); });
  }
  Status set_pose(const Start &start) noexcept { return sonarfix_robot_set_pose(get(), &start); }
  Status start() noexcept { return sonarfix_robot_start(get()); }
  Status stop() noexcept { return sonarfix_robot_stop(get()); }
  Status search() noexcept { return sonarfix_robot_search(get()); }
  Status reset_calibration() noexcept { return sonarfix_robot_reset_calibration(get()); }
  Result<State> state() const noexcept {
    return Result<State>::of([this](State *out) { return sonarfix_robot_state(get(), out); });
  }
  Result<Health> health() const noexcept {
    return Result<Health>::of([this](Health *out) { return sonarfix_robot_health(get(), out); });
  }
  Result<sonarfix_faults_t> faults() const noexcept {
    return Result<sonarfix_faults_t>::of([this](auto *out) { return sonarfix_robot_faults(get(), out); });
  }
};

}  // namespace sonarfix

#endif
