/* A robot that knows where it starts prints its pose ten times a second, while something else drives it. */
#include <Servo.h>

#include "robot.h"

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<4> robot;

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    const sonarfix_status_t status = robot.begin(measured(), ROOM);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.start(START_X, START_Y, START_HEADING, START_POSITION, START_DIRECTION);
}

void loop() {
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = sonar.edges(robot.clock);
    robot.poll();
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    sonar.obey(output);
    if (robot.outputs.is_on_time) sonarfixPrintPose(Serial, robot.outputs);
}
