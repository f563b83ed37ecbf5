"""The paper's table: 50 runs, with the bound beside the errors."""

import sonarfix as sf

paper = sf.Scenario("paper")
rows = paper.monte_carlo(runs=50)
for state in sf.summary(rows)["states"]:
    if state["rms_over_bound"] is not None:
        print(f"{state['name']:12} RMS {state['rms_error']:.3e} {state['unit']}, bound {state['bound']:.3e}")
