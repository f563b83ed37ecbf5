/* A robot that knows where it starts, with an HC-SR04 on a servo, prints its pose ten times a second while it drives.
 *
 * Wiring: encoders of the right wheel on pins 2 and 3, of the left wheel on 4 and 5; sonar: trigger 6, echo 7 (through a divider to the
 * voltage of the board); servo 8. Pins 2 to 5 and 7 need interrupts. */
#include <Servo.h>
#include <Sonarfix.h>

/* The room, metres: 6 m x 8 m. */
static const sonarfix_segment_t ROOM[] = {{0, 0, 6, 0, 0}, {6, 0, 6, 8, 0}, {6, 8, 0, 8, 0}, {0, 8, 0, 0, 0}};

SonarfixEncoder<2, 3> right;
SonarfixEncoder<4, 5> left;
SonarfixPulseRanger<6, 7> sonar;
Servo servo;
SonarfixRobot<4> robot;

/* The robot, as it was measured. */
sonarfix_robot_config_t measured() {
    const float degrees = 0.017453293f;
    sonarfix_robot_config_t config;
    sonarfix_robot_config_default(0.12f, &config); /* the track width */
    config.right_wheel.travel_per_count_m = config.left_wheel.travel_per_count_m = 0.0004887f;
    config.localizer.wheel_noise_m = 0.003f;
    config.localizer.prior_scale_right = config.localizer.prior_scale_left = 0.015f;
    config.localizer.prior_track_width_m = 0.005f;
    config.localizer.prior_range_scale = 0.015f;
    config.localizer.gating_confidence = 2;
    sonarfix_ranger_config_t &ranger = config.localizer.rangers[0];
    ranger.mount_x_m = 0.06f; /* the sonar is 6 cm ahead of the axle */
    ranger.servo_right_rad = -100 * degrees;
    ranger.servo_left_rad = 100 * degrees;
    ranger.cone_rad = 12 * degrees;
    ranger.min_range_m = 0.1f;
    ranger.max_range_m = 3.5f;
    ranger.noise_floor_m = 0.002f;
    ranger.noise_per_metre = 0.001f;
    ranger.ping_period_us = 500000;
    sonarfix_driver_config_t &driver = config.drivers[0];
    driver.servo_pulse_us[0] = 500; /* the pulses of two bearings */
    driver.servo_pulse_us[1] = 2500;
    driver.servo_bearing_rad[0] = -100 * degrees;
    driver.servo_bearing_rad[1] = 100 * degrees;
    return config;
}

void setup() {
    Serial.begin(115200);
    right.begin();
    left.begin();
    sonar.begin();
    servo.attach(8, 500, 2500);
    const sonarfix_status_t status = robot.begin(measured(), ROOM);
    if (status != SONARFIX_OK) Serial.println(sonarfix_status_text(status));
    robot.start(1.5f, 1.5f, 0, 0.02f, 0.035f);
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
