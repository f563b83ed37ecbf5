"""A localizer step by step, as a program on a robot would use it."""

import sonarfix as sf

paper = sf.Scenario("paper")
localizer = sf.Localizer(paper.robot, paper.map, (0.0, 0.0, 1.57))
for tick in range(1, 101):
    localizer.odometry(0.1 * tick, right=0.04, left=0.04)
    if tick % 10 == 0 and (aim := localizer.aim()) is not None:
        # On a robot: turn the servo to aim.bearing, and ping.
        fix = localizer.fix(aim, aim.range)
        print(f"{localizer.time:.1f} s: {localizer.pose} {localizer.verdict}, wall {aim.wall}: {fix.outcome}")
