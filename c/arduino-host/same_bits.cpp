/* A robot by Arduino's classes and one by the functions of C, with the same inputs: pose, outputs and telemetry must be the same bits,
 * also when micros() wraps around. */
#include <cstdio>
#include <vector>

#include "Sonarfix.h"

namespace {

/* micros() wraps around a minute after the start. */
constexpr uint64_t START = (uint64_t(1) << 32) - 60'000'000;
constexpr int POLLS = 180'000;
uint64_t now = START;

/* What a serial port has sent. */
struct Port {
    std::vector<uint8_t> sent;
    int available() const { return 0; }
    int read() { return -1; }
    size_t write(const uint8_t *bytes, size_t count) {
        sent.insert(sent.end(), bytes, bytes + count);
        return count;
    }
};

const sonarfix_segment_t ROOM[] = {{0, 0, 6, 0, 0}, {6, 0, 6, 8, 0}, {6, 8, 0, 8, 0}, {0, 8, 0, 0, 0}};
const sonarfix_start_t POSE = {{1.5f, 1.5f, 0.0f}, 0.02f, 0.035f};

/* The robot by the functions of C. */
sonarfix_wall_t walls[4];
sonarfix_map_t map;
sonarfix_robot_t plain;
uint8_t store[SONARFIX_STORE_SIZE];
uint8_t to_send[1200];

sonarfix_status_t open(const sonarfix_robot_config_t &config) {
    memset(store, 0xFF, sizeof store);
    const sonarfix_status_t status = sonarfix_map_from_walls(&map, walls, ROOM, 4);
    if (status != SONARFIX_OK) return status;
    return sonarfix_robot_init(&plain, &config, &map, store, now);
}

bool is_same(const sonarfix_outputs_t &one, const sonarfix_outputs_t &other) {
    const sonarfix_ranger_output_t &a = one.rangers[0], &b = other.rangers[0];
    return memcmp(&one.pose, &other.pose, sizeof one.pose) == 0 && one.verdict == other.verdict &&
           one.has_fix == other.has_fix && one.next_poll_us == other.next_poll_us && a.starts == b.starts &&
           a.trigger == b.trigger && memcmp(&a.servo_pulse_us, &b.servo_pulse_us, sizeof a.servo_pulse_us) == 0;
}

} // namespace

uint32_t micros() { return uint32_t(now); }
void delayMicroseconds(uint32_t) {}
void pinMode(uint8_t, uint8_t) {}
void digitalWrite(uint8_t, uint8_t) {}
int digitalRead(uint8_t) { return 0; }
void attachInterrupt(uint8_t, void (*)(), int) {}

int main() {
    sonarfix_robot_config_t config;
    sonarfix_robot_config_default(0.12f, &config);
    static SonarfixRobot<4> robot;
    SonarfixLink link;
    Port port;
    sonarfix_outputs_t outputs;
    sonarfix_inputs_t inputs = {};
    if (robot.begin(config, ROOM) != SONARFIX_OK || open(config) != SONARFIX_OK) return 1;
    inputs.now_us = now;
    robot.start(POSE.pose.x_m, POSE.pose.y_m, POSE.pose.heading_rad, POSE.position_deviation_m, POSE.heading_deviation_rad);
    sonarfix_robot_set_pose(&plain, &POSE);
    sonarfix_robot_poll(&plain, &inputs, &outputs);
    sonarfix_robot_start(&plain);

    uint64_t sent_at = 0;
    int fixes = 0;
    for (uint32_t poll = 1; poll <= POLLS; ++poll) {
        now += 1000;
        inputs.now_us = now;
        inputs.right.count = inputs.left.count = poll / 3;
        /* An echo of a wall at about 1.5 m. */
        sonarfix_ranger_input_t echo = {};
        if (sent_at != 0 && now - sent_at > 12'000) {
            echo.rose_us = sent_at + 460;
            echo.fell_us = sent_at + 460 + 8'740 + poll % 7;
            echo.has_risen = echo.has_fallen = 1;
            sent_at = 0;
        }
        inputs.rangers[0] = echo;
        inputs.to_send = to_send;
        inputs.to_send_length = sizeof to_send;
        sonarfix_robot_poll(&plain, &inputs, &outputs);

        robot.inputs.right = inputs.right;
        robot.inputs.left = inputs.left;
        robot.inputs.rangers[0] = echo;
        port.sent.clear();
        link.receive(port, robot.inputs);
        robot.poll();
        link.send(port, robot.outputs);

        const bool is_sent = port.sent == std::vector<uint8_t>(to_send, to_send + outputs.to_send);
        if (!is_same(outputs, robot.outputs) || !is_sent) {
            printf("different in poll %u\n", poll);
            return 1;
        }
        if (outputs.rangers[0].starts) sent_at = now;
        fixes += outputs.has_fix;
    }
    printf("equal in %d polls with %d fixes\n", POLLS, fixes);
    return fixes > 100 ? 0 : 1;
}
