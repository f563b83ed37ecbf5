/* A robot with an MPU-6050 calibrates itself while it drives: it prints the errors of its wheels and of its track width, which belong
 * into robot.h. A few laps along the walls, with turns to both sides, determine them. */
#include <Servo.h>
#include <Wire.h>

#include "robot.h"

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<4> robot;
SonarfixMpu6050<TwoWire> gyro(Wire);

void setup() {
    Serial.begin(115200);
    Wire.begin();
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    sonarfix_robot_config_t config = measured();
    config.localizer.gyro.is_fitted = 1;
    if (!gyro.begin()) Serial.println("the gyro does not answer");
    const sonarfix_status_t status = robot.begin(config, ROOM);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.start(START_X, START_Y, START_HEADING, START_POSITION, START_DIRECTION);
}

/* Prints the errors with their standard deviations, per cent and millimetres. */
void printCalibration() {
    sonarfix_state_t state, deviation;
    if (sonarfix_robot_state(robot.handle(), &state) != SONARFIX_OK) return;
    if (sonarfix_robot_deviations(robot.handle(), &deviation) != SONARFIX_OK) return;
    const float values[][2] = {{100 * state.scale_right, 100 * deviation.scale_right},
                               {100 * state.scale_left, 100 * deviation.scale_left},
                               {1000 * state.track_width_error_m, 1000 * deviation.track_width_error_m}};
    const char *names[] = {"right wheel ", "left wheel ", "track width "};
    for (int k = 0; k < 3; ++k) {
        Serial.print(names[k]);
        Serial.print(values[k][0], 2);
        Serial.print(" +- ");
        Serial.println(values[k][1], 2);
    }
}

void loop() {
    static uint32_t ticks;
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = sonar.edges(robot.clock);
    gyro.sense(robot.inputs);
    robot.poll();
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    sonar.obey(output);
    if (!robot.outputs.is_on_time) return;
    sonarfixPrintPose(Serial, robot.outputs);
    if (++ticks % 100 == 0) printCalibration();
}
