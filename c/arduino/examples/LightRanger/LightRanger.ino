/* A robot with a VL53L1X on its servo, by Pololu's library VL53L1X. */
#include <Servo.h>
#include <VL53L1X.h>
#include <Wire.h>

#include "robot.h"

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
VL53L1X sensor;
SonarfixVl53l1x<VL53L1X> ranger(sensor);
Servo servo;
SonarfixRobot<4> robot;

void setup() {
    Serial.begin(115200);
    Wire.begin();
    if (!sensor.init()) Serial.println("the VL53L1X does not answer");
    right.begin();
    left.begin();
    ranger.begin();
    servo.attach(8, 500, 2500);
    sonarfix_robot_config_t config = measured();
    sonarfix_config_set_sensor(&config.localizer, 0, SONARFIX_SENSOR_VL53L1X);
    sonarfix_ranger_config_t &light = config.localizer.rangers[0];
    light.cone_rad = 15 * DEGREES;
    light.min_range_m = 0.05f;
    light.max_range_m = 3.2f;
    light.noise_floor_m = light.noise_per_metre = 0.005f;
    config.drivers[0].driver = SONARFIX_DRIVER_CUSTOM;
    const sonarfix_status_t status = robot.begin(config, ROOM);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.start(START_X, START_Y, START_HEADING, START_POSITION, START_DIRECTION);
}

void loop() {
    robot.inputs.right = right.counted();
    robot.inputs.left = left.counted();
    robot.inputs.rangers[0] = ranger.reading(robot.clock);
    robot.poll();
    const sonarfix_ranger_output_t &output = robot.outputs.rangers[0];
    if (output.has_servo_pulse) servo.writeMicroseconds(int(output.servo_pulse_us + 0.5f));
    ranger.obey(output);
    if (robot.outputs.is_on_time) sonarfixPrintPose(Serial, robot.outputs);
}
