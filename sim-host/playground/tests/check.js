"use strict";
// Appended to the page by `cargo xtask playground`: computes runs and uses the page as a person does. The hashes go to `data-digests`, a
// failure to `data-error`.
{
  const root = document.documentElement;
  const { scenes, simulator, state } = playground;
  const player = playground.player();
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const element = (id) => document.getElementById(id);
  const stage = element("stage");

  // The first scene is played at once; each has a run, a sentence and one thing to try.
  assert(player.state.playing && state.scene === scenes[0], "the first scene is not played");
  for (const { name } of scenes) {
    playground.open(`#scene=${name}`);
    assert(element("error").hidden && state.scene.name === name, `the scene ${name} has no run`);
    assert(player.state.playing && player.state.time === player.data.ticks.time[0], `the scene ${name} is not played from its start`);
    assert(document.querySelectorAll("#scenes [aria-current]").length === 1, "one scene is the current one");
  }
  playground.open("#scene=furniture");
  player.setPlaying(false);
  const { scenario } = structuredClone(state.request);

  const began = performance.now();
  const runs = [0, 1, 2].map((seed) => simulator.run({ scenario, seed, seconds: Number(root.dataset.seconds), moves: [] }));
  root.dataset.digests = runs.map(({ summary, error }) => summary?.digest ?? error).join(" ");
  root.dataset.milliseconds = (performance.now() - began).toFixed(0);

  // Drags from one place of the floor to another.
  stage.setPointerCapture = () => {}; // there is no pointer
  function drag(from, to) {
    const box = stage.getBoundingClientRect();
    [["pointerdown", from], ["pointermove", to], ["pointerup", to]].forEach(([name, place]) => {
      const [left, top] = player.picture.screenAt(...place);
      const at = { clientX: box.left + left, clientY: box.top + top };
      stage.dispatchEvent(new PointerEvent(name, { ...at, button: 0, pointerId: 1, pointerType: "mouse", bubbles: true }));
    });
  }
  const digest = () => document.querySelector('[data-result="digest"]').textContent;
  const near = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) < 0.02;
  // Does something that must change the run.
  function changes(what, act) {
    const before = digest();
    act();
    assert(element("error").hidden, `${what}: ${element("error").textContent}`);
    assert(digest() !== before, `${what} has no effect`);
  }

  changes("moving a corner of the room", () => drag([6, 8], [6.5, 8.4]));
  const ends = state.request.scenario.map.wall.flatMap(({ from, to }) => [from, to]).filter((end) => near(end, [6.5, 8.4]));
  assert(ends.length === 2, "both walls of the corner move");
  changes("moving the bin", () => drag([0.5, 4], [3, 2]));
  changes("moving the start", () => drag([1.5, 1.5], [1.8, 1.2]));
  const { path } = state.request.scenario;
  assert(near(path.start, [1.8, 1.2]) && near(path.corners[3], [1.8, 1.2]), "the closed path stays closed");

  player.goTo(30);
  const { truth } = Moment.momentAt(player.data, 30);
  changes("picking up the robot", () => drag([truth.x, truth.y], [2, 5]));
  player.setPlaying(false);
  const after = Moment.momentAt(player.data, 30.3);
  assert(Math.hypot(after.truth.x - 2, after.truth.y - 5) < 0.2, "the robot is where it was put");
  assert(Math.hypot(after.estimate.x - 2, after.estimate.y - 5) > 0.5, "the estimate does not know");

  const fields = [...document.querySelectorAll("#fields label")];
  const field = (name) => fields.find((label) => label.textContent.startsWith(name)).querySelector("input, select");
  const set = (name, value) => { field(name).value = value; field(name).dispatchEvent(new Event("change")); };
  changes("the policy", () => set("Policy", "nearest"));
  changes("the sonar", () => set("Sonar", "ideal"));
  changes("the noise of the wheels", () => set("Noise of the wheels", "20"));
  changes("undoing", () => element("undo").click());

  // The address has the scene and all changes: opening it gives the same run.
  const shared = location.hash, sharedDigest = digest();
  playground.open("#scene=drift");
  assert(digest() !== sharedDigest, "another scene has another run");
  playground.open(shared);
  assert(digest() === sharedDigest && state.scene.name === "furniture", "a shared address has the same run");
  assert(location.hash === shared, "an opened address stays the same");
  player.setPlaying(false);
  changes("a setting", () => set("Seed", "7"));
  playground.open("#scene=furniture&scenario.robot.sonar.cone=120+deg");
  assert(!element("error").hidden && element("error").textContent.includes("robot.sonar.cone"), "a mistake in an address is shown");
  playground.open("#scene=furniture");
  player.setPlaying(false);

  // A wall across the path has no run: the mistake is shown, the last run stays, and undoing removes it.
  const last = digest();
  drag([3, 0], [3, 3]);
  assert(!element("error").hidden && element("error").textContent.includes("path"), "a wall across the path is a mistake");
  assert(digest() === last, "the last run stays");
  element("undo").click();
  assert(element("error").hidden, "undoing removes the mistake");
  root.dataset.checked = "true";
}
