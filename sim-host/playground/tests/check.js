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
  changes("adding a wall", () => element("add-wall").click());
  assert(state.request.scenario.map.wall.length === 5, "no wall was added");
  const added = state.request.scenario.map.wall[4], [right, up] = added.to;
  changes("dragging its end", () => drag([right, up], [right + 0.3, up + 0.4]));
  assert(near(state.request.scenario.map.wall[4].to, [right + 0.3, up + 0.4]), "the end of the wall moves");
  changes("deleting it", () => { state.selected = "wall wall 5"; stage.dispatchEvent(new KeyboardEvent("keydown", { key: "Delete" })); });
  assert(state.request.scenario.map.wall.length === 4, "the wall is not deleted");
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

  // A file with a map. The browser prints the page when it is loaded, which may be before it has read a file: here the contents are
  // there at once.
  const contents = new Map();
  Blob.prototype.arrayBuffer = async function arrayBuffer() { return new TextEncoder().encode(contents.get(this.name)).buffer; };
  async function ownMaps() {
    const room = "x1_m,y1_m,x2_m,y2_m,name\n0,0,5,0,a\n5,0,5,4,b\n5,4,0,4,c\n0,4,0,0,d\n";
    const of = (name, text) => { contents.set(name, text); return new File([text], name); };
    const before = digest();
    await playground.useMap(of("room.csv", room));
    const { map, path, world } = state.request.scenario;
    assert(element("map-error").hidden && element("error").hidden, `a CSV: ${element("map-error").textContent}${element("error").textContent}`);
    assert(element("map-result").textContent === "room.csv: 4 walls", `what was read: ${element("map-result").textContent}`);
    assert(map.wall.length === 4 && path.start.length === 2 && world.obstacle.length === 0 && digest() !== before, "the room is not that of the run");
    assert(simulator.mapFile(state.request).text.includes("to = [5.0, 4.0]"), "the map cannot be saved");
    const address = location.hash, own = digest();
    playground.open("#scene=drift");
    playground.open(address);
    player.setPlaying(false);
    assert(digest() === own, "the address has the map, but not the same run");

    await playground.useMap(of("room.dxf", "no drawing"));
    assert(!element("map-error").hidden && element("map-error").textContent.startsWith("room.dxf: "), "a wrong file is not named");
    assert(digest() === own, "a wrong file changes the map");

    const files = new DataTransfer();
    files.items.add(of("dropped.csv", room.replaceAll("5,", "6,")));
    const drop = new DragEvent("drop", { dataTransfer: files, cancelable: true });
    window.dispatchEvent(drop);
    assert(drop.defaultPrevented, "the browser opens a dropped file instead of the page");
    for (let turn = 0; turn < 1000 && digest() === own; turn++) await null;
    assert(state.request.scenario.map.wall[0].to[0] === 6 && element("map-error").hidden, "a dropped file is not read");
    const input = element("map-file");
    assert(input.labels.length === 1 && input.tabIndex === 0, "the file input has no label, or no key reaches it");
    root.dataset.checked = "true";
  }
  ownMaps().catch(({ message }) => { root.dataset.error = message; });
}
