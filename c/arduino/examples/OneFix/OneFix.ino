/* The localizer without the loop: odometry ten times a second; twice a second it chooses a wall, the servo turns to it, the sonar
 * measures, and the range corrects the pose. Nothing waits. */
#include <Servo.h>

#include "robot.h"

SonarfixClock timer;
SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;

sonarfix_wall_t walls[4];
sonarfix_map_t map_;
sonarfix_localizer_t localizer;
sonarfix_aim_t aim;
sonarfix_robot_config_t robot_;

enum { REST, TURNING, LISTENING } state = REST;
uint64_t since, sampled, rose;
uint32_t rightCount, leftCount;

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    robot_ = measured();
    const sonarfix_start_t start = {{START_X, START_Y, START_HEADING}, START_POSITION, START_DIRECTION};
    sonarfix_map_from_walls(&map_, walls, ROOM, 4);
    const sonarfix_status_t status = sonarfix_localizer_init(&localizer, &robot_.localizer, &map_, &start, timer.now());
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    rightCount = right.counted().count;
    leftCount = left.counted().count;
}

/* Passes the travel since the last call. */
void odometry() {
    const uint32_t r = right.counted().count, l = left.counted().count;
    sampled = timer.now();
    sonarfix_localizer_odometry(&localizer, sampled, int32_t(r - rightCount) * robot_.right_wheel.travel_per_count_m,
                                int32_t(l - leftCount) * robot_.left_wheel.travel_per_count_m);
    rightCount = r;
    leftCount = l;
}

/* Corrects the pose by a flight of sound there and back, microseconds; zero without an echo. */
void fix(uint32_t flight) {
    sonarfix_fix_t result;
    odometry();
    if (flight == 0) {
        sonarfix_localizer_no_echo(&localizer, &aim, &result);
    } else {
        sonarfix_localizer_fix(&localizer, &aim, 0.5e-6f * 343.4f * flight, &result);
    }
}

void chooseWall() {
    since = timer.now();
    if (sonarfix_localizer_aim(&localizer, &aim) != SONARFIX_OK) {
        sonarfix_localizer_skip(&localizer);
        return;
    }
    servo.writeMicroseconds(int(1500 + aim.bearing_rad * (1000 / (100 * DEGREES))));
    state = TURNING;
}

void loop() {
    const uint64_t now = timer.now();
    const sonarfix_ranger_input_t edges = sonar.edges(timer);
    const uint64_t elapsed = now - since;
    if (state == REST && elapsed > 50000) {
        chooseWall();
    } else if (state == TURNING && elapsed > aim.duration_us) {
        sonarfix_ranger_output_t ping = {};
        ping.starts = 1;
        sonar.obey(ping);
        since = now;
        state = LISTENING;
    } else if (state == LISTENING) {
        if (edges.has_risen) rose = edges.rose_us;
        if (edges.has_fallen) {
            const uint32_t flight = uint32_t(edges.fell_us - rose);
            fix(flight < 20400 ? flight : 0); /* 3.5 m */
            state = REST;
        } else if (elapsed > 60000) {
            fix(0);
            state = REST;
        }
    }
    if (now - sampled < 100000) return;
    odometry();
    sonarfix_outputs_t outputs = {};
    sonarfix_health_t health;
    sonarfix_localizer_pose(&localizer, &outputs.pose);
    sonarfix_localizer_health(&localizer, &health);
    outputs.verdict = health.verdict;
    sonarfixPrintPose(Serial, outputs);
}
