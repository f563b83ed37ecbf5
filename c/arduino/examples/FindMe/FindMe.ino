/* A robot that does not know where it is: it sweeps its sonar while something else drives it, until one pose explains the ranges. */
#include <Servo.h>

#include "robot.h"

/* The room with an alcove: a rectangle alone would look the same from two places, and the search would find both. */
static const sonarfix_segment_t ALCOVE[] = {{0, 0, 6, 0, 0},       {6, 0, 6, 8, 0},     {6, 8, 2.2f, 8, 0},
                                            {2.2f, 8, 2.2f, 10, 0}, {2.2f, 10, 0, 10, 0}, {0, 10, 0, 0, 0}};

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<6> robot;

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    sonarfix_robot_config_t config = measured();
    config.searches = 1;
    const sonarfix_status_t status = robot.begin(config, ALCOVE);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.search();
}

void loop() {
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = sonar.edges(robot.clock);
    robot.poll();
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    sonar.obey(output);
    if (robot.outputs.mode != SONARFIX_MODE_TRACKING) robot.work();
    if (robot.outputs.is_on_time) sonarfixPrintPose(Serial, robot.outputs);
}
