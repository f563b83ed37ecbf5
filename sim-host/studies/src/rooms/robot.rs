//! The robots of the study: what the robot's file says of a robot that is otherwise.

use sonarfix::geometry::units::Radians;
use sonarfix_hal::config::RobotConfig;
use sonarfix_hal::ranger::Celsius;
use sonarfix_map::Scenario;

/// A robot, whose software may be configured with a wrong robot file.
#[derive(Debug, Clone, Copy)]
pub struct Robot {
    /// Its name.
    name: &'static str,
    /// Changes the file from what the robot is.
    believes: fn(&mut RobotConfig),
}

impl Robot {
    /// The robot as its file describes it.
    pub const NOMINAL: Self = Self { name: "nominal", believes: |_| {} };

    /// Those whose file is wrong, by what is wrong in it.
    pub const WRONG: [Self; 16] = [
        Self { name: "mount 15 mm ahead", believes: |of| mount(of, [-15.0, 0.0]) },
        Self { name: "mount 15 mm left", believes: |of| mount(of, [0.0, -15.0]) },
        Self { name: "mount 12 and 6 mm", believes: |of| mount(of, [12.0, 6.0]) },
        Self { name: "wheels 3 %", believes: |of| wheels(of, [1.03, 1.03]) },
        Self { name: "wheels ±2 %", believes: |of| wheels(of, [1.02, 0.98]) },
        Self { name: "wheels ±3 %", believes: |of| wheels(of, [1.03, 0.97]) },
        Self { name: "track width 5 %", believes: |of| track(of, 1.05) },
        Self { name: "track width -5 %", believes: |of| track(of, 0.95) },
        Self { name: "air 15 °C warmer", believes: |of| air(of, 5.0) },
        Self { name: "air 15 °C colder", believes: |of| air(of, 35.0) },
        Self { name: "noise a third", believes: |of| noise(of, 1.0 / 3.0) },
        Self { name: "noise thrice", believes: |of| noise(of, 3.0) },
        Self { name: "servo zero 3°", believes: |of| servo(of, 1.0, 3.0) },
        Self { name: "servo zero -3°", believes: |of| servo(of, 1.0, -3.0) },
        Self { name: "servo scale 3 %", believes: |of| servo(of, 1.03, 0.0) },
        Self { name: "servo scale -3 %", believes: |of| servo(of, 0.97, 0.0) },
    ];

    /// Those whose file is wrong by more than its deviations permit.
    pub const OUTSIDE: [Self; 4] = [
        Self { name: "wheels ±4 %", believes: |of| wheels(of, [1.04, 0.96]) },
        Self { name: "wheels ±6 %", believes: |of| wheels(of, [1.06, 0.94]) },
        Self { name: "track width 20 %", believes: |of| track(of, 1.2) },
        Self { name: "mount 25 mm ahead", believes: |of| mount(of, [-25.0, 0.0]) },
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.name
    }

    /// All of them.
    #[must_use]
    pub fn all() -> Vec<Self> {
        std::iter::once(Self::NOMINAL).chain(Self::WRONG).chain(Self::OUTSIDE).collect()
    }

    /// The scenario of a robot that is as its file describes it, with the file of this one. The robot remains as it is.
    pub(super) fn drive(&self, scenario: &mut Scenario) {
        let built = scenario.robot;
        (self.believes)(&mut scenario.robot);
        let (file, truth) = (&scenario.robot, &mut scenario.truth);
        let wheels = [
            (&mut truth.scale_right, built.right_wheel, file.right_wheel),
            (&mut truth.scale_left, built.left_wheel, file.left_wheel),
        ];
        for (scale, built, file) in wheels {
            let [built, file] = [built, file].map(|it| f64::from(it.travel_per_edge.0));
            *scale = (1.0 + *scale) * built / file - 1.0;
        }
        let mount = built.localizer.rangers.first.mount;
        truth.mount = [mount.x, mount.y].map(|at| Some(at.0.into()));
        truth.servo_pulses = Some(built.rangers.first.servo_pulses);
    }

    /// Whether its file is wrong by more than its deviations permit.
    #[must_use]
    pub fn is_outside(&self) -> bool {
        Self::OUTSIDE.iter().any(|other| other.name == self.name)
    }

    /// Whether its file is right.
    #[must_use]
    pub fn is_nominal(&self) -> bool {
        self.name == Self::NOMINAL.name
    }
}

/// The mount is this far from where the robot has it, ahead and to the left, mm.
fn mount(of: &mut RobotConfig, [ahead, left]: [f32; 2]) {
    let mount = &mut of.localizer.rangers.first.mount;
    mount.x.0 += 0.001 * ahead;
    mount.y.0 += 0.001 * left;
}

/// The diameters of the right and of the left wheel are so many times the true ones.
fn wheels(of: &mut RobotConfig, [right, left]: [f32; 2]) {
    of.right_wheel.travel_per_edge = of.right_wheel.travel_per_edge * right;
    of.left_wheel.travel_per_edge = of.left_wheel.travel_per_edge * left;
}

fn track(of: &mut RobotConfig, times: f32) {
    let width = &mut of.localizer.drive.track_width;
    *width = *width * times;
}

/// The air is assumed to have this temperature; it has 14 to 26 °C.
fn air(of: &mut RobotConfig, celsius: f32) {
    of.rangers.first.temperature = Celsius(celsius);
}

/// The noise of the wheels is so many times the true one.
fn noise(of: &mut RobotConfig, times: f32) {
    let noise = &mut of.localizer.drive.wheel_noise.0;
    *noise = *noise * times;
}

/// The bearings of the servo's pulses are scaled by `scale` and off by so many degrees.
fn servo(of: &mut RobotConfig, scale: f32, degrees: f32) {
    for pulse in &mut of.rangers.first.servo_pulses {
        pulse.bearing = Radians(pulse.bearing.0 * scale) + Radians::from_degrees(degrees);
    }
}
