/* A robot with two sonars, each on a servo: the second one behind the axle, with its trigger on pin 9, its echo on pin 10 and its
 * servo on pin 11. The robot asks the one that tells more, and only the other one if one fails. */
#include <Servo.h>

#include "robot.h"

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<4> robot;
SonarfixPulseRanger<9, 10> secondSonar;
Servo secondServo;

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    secondSonar.begin();
    secondServo.attach(11, 500, 2500);
    sonarfix_robot_config_t config = measured();
    config.localizer.ranger_count = 2;
    config.localizer.rangers[1] = config.localizer.rangers[0];
    config.localizer.rangers[1].mount_x_m = -0.04f;
    config.drivers[1] = config.drivers[0];
    const sonarfix_status_t status = robot.begin(config, ROOM);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.start(START_X, START_Y, START_HEADING, START_POSITION, START_DIRECTION);
}

void loop() {
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = sonar.edges(robot.clock);
    robot.inputs.rangers[1] = secondSonar.edges(robot.clock);
    robot.poll();
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    sonar.obey(output);
    const sonarfix_ranger_output_t &second = robot.outputs.rangers[1];
    if (second.has_servo_pulse) secondServo.writeMicroseconds(int(second.servo_pulse_us + 0.5f));
    secondSonar.obey(second);
    if (robot.outputs.is_on_time) sonarfixPrintPose(Serial, robot.outputs);
}
