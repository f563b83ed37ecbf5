/* A robot that talks to the programs on a PC: `sonarfix monitor` shows and records it, and sets its pose; `sonarfix calibrate` and
 * `sonarfix survey` use the recording. */
#include <Servo.h>

#include "robot.h"

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<4> robot;
SonarfixLink link;

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    robot.begin(measured(), ROOM);
    robot.start(START_X, START_Y, START_HEADING, START_POSITION, START_DIRECTION);
}

void loop() {
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = sonar.edges(robot.clock);
    link.receive(Serial, robot.inputs);
    robot.poll();
    link.send(Serial, robot.outputs);
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    sonar.obey(output);
}
