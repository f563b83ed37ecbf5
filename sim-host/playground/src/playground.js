"use strict";
// The playground: a scenario, its fields and handles, and its run in the player.

const playground = (() => {
  const element = (id) => document.getElementById(id);
  const simulator = openSimulator(element("wasm").textContent);
  const SONARS = ["hc_sr04", "nxt", "lv_maxsonar", "srf08", "polaroid_6500", "ideal"];
  const NEAR = { mouse: 12, pen: 18, touch: 26 }; // pixels from a handle at which it is grasped
  const STEP = 0.1;            // metres of one key
  const UNDOS = 100;
  const MOST_BYTES = 32 << 20; // of a file with a map

  // Of the scenario: its key, or keys that have the same value. Of the run: a name.
  const FIELDS = [
    { label: "Policy", keys: ["robot.schedule.policy"], options: ["informative", "nearest"] },
    { label: "Sonar", keys: ["sensor.model", "robot.echo.sensor"], options: SONARS },
    { label: "Reach of the sonar", keys: ["robot.sonar.max_range"], unit: "m", step: 0.5, from: 0.2, to: 10 },
    { label: "Range noise of the sonar \"ideal\"", keys: ["truth.range_noise"], unit: "mm", step: 1, from: 0, to: 100 },
    { label: "Range noise that the robot assumes", keys: ["robot.sonar.noise"], unit: "mm", step: 1, from: 1, to: 100 },
    { label: "Time between pings", keys: ["robot.sonar.fix_period"], unit: "ms", step: 50, from: 100, to: 5000 },
    { label: "Noise of the wheels", keys: ["truth.wheel_noise"], unit: "mm/sqrt(m)", step: 1, from: 0, to: 50 },
    { label: "Scale error of the right wheel", keys: ["truth.scale_right"], unit: "%", step: 0.5, from: -10, to: 10 },
    { label: "Scale error of the left wheel", keys: ["truth.scale_left"], unit: "%", step: 0.5, from: -10, to: 10 },
    { label: "True track width", keys: ["truth.track_width"], unit: "mm", step: 1, from: 50, to: 400 },
    { label: "Speed", keys: ["path.speed"], unit: "m/s", step: 0.05, from: 0.05, to: 0.8 },
    { label: "Air", keys: ["world.temperature"], unit: "degC", step: 1, from: -20, to: 45 },
    { label: "Error of the start position", keys: ["start.position"], unit: "cm", step: 1, from: 1, to: 50 },
    { label: "Searches for its pose when lost", run: "searches", isSwitch: true },
    { label: "Seconds", run: "seconds", step: 10, from: 10, to: 3600 },
    { label: "Seed", run: "seed", step: 1, from: 0, to: 999999 },
  ];

  const scenes = simulator.scenes();
  const state = {
    scene: null, request: null,
    past: [],                  // earlier requests as JSON, for `undo`
    handles: [], selected: null, dragged: null, place: null,
  };
  let player = null;

  // ---- Keys of the scenario ----

  function holder(key) {
    const names = key.split("."), last = names.pop();
    const of = names.reduce((table, name) => (table[name] ??= {}), state.request.scenario);
    return [of, last];
  }

  const read = (key) => { const [of, last] = holder(key); return of[last]; };
  const write = (key, value) => { const [of, last] = holder(key); of[last] = value; };

  // ---- Run ----

  // Computes the run again; a change that has no run is undone when the next one is made.
  function compute() {
    const began = performance.now();
    const answer = simulator.run(state.request);
    const took = performance.now() - began;
    const error = element("error");
    error.hidden = !answer.error;
    error.textContent = answer.error ?? "";
    state.handles = Handles.of(state.request.scenario);
    if (answer.error) { player?.draw(); return; }
    if (player) player.replace(answer.run); else player = openPlayer(answer.run, { overlay, isBusy: () => state.dragged !== null });
    showResult(answer.summary, took);
    history.replaceState(null, "", Address.write(state.scene, state.request));
  }

  function showResult({ digest, verdict, position_rms: rms, cycles }, took) {
    const texts = {
      rms: Moment.length(rms), verdict, digest,
      cycles: `${cycles[0]} accepted, ${cycles[1]} gated, ${cycles[2]} refused`,
      moves: state.request.moves.map(({ at }) => `at ${at.toFixed(1)} s`).join(", ") || "never",
      time: `${took.toFixed(0)} ms`,
    };
    for (const [name, text] of Object.entries(texts)) document.querySelector(`[data-result="${name}"]`).textContent = text;
  }

  // ---- Scenes ----

  // Shows the scene of an address with its changes, and plays it.
  function open(address) {
    Object.assign(state, Address.read(address, scenes), { past: [], selected: null });
    compute();
    if (!player) {             // the changes in the address have no run
      const { textContent } = element("error");
      state.request = structuredClone(state.scene.request);
      compute();
      Object.assign(element("error"), { textContent, hidden: false });
    }
    showScene();
    showFields();
    player.goTo(-Infinity);
    if (!player.state.playing && !matchMedia("(prefers-reduced-motion: reduce)").matches) player.setPlaying(true);
  }

  function showScene() {
    const { name, title, shows, exercise } = state.scene;
    Object.entries({ title, shows, exercise }).forEach(([part, text]) => { element(`scene-${part}`).textContent = text; });
    for (const link of document.querySelectorAll("#scenes a")) {
      if (link.hash === `#scene=${name}`) link.setAttribute("aria-current", "page"); else link.removeAttribute("aria-current");
    }
  }

  function sceneLink({ name, title }) {
    const item = document.createElement("li");
    item.append(Object.assign(document.createElement("a"), { href: `#scene=${name}`, textContent: title }));
    return item;
  }

  // ---- Changes ----

  // Applies a change that can be undone.
  function change(apply) {
    state.past.push(JSON.stringify(state.request));
    if (state.past.length > UNDOS) state.past.shift();
    apply(state.request);
    compute();
    showFields();
  }

  function undo() {
    if (state.past.length === 0) return;
    state.request = JSON.parse(state.past.pop());
    compute();
    showFields();
  }

  // ---- Fields ----

  const number = (text) => Number.parseFloat(text);

  function makeField(field) {
    const label = document.createElement("label");
    const input = document.createElement(field.options ? "select" : "input");
    label.append(field.unit ? `${field.label} (${field.unit.replace("sqrt(m)", "√m").replace("degC", "°C")})` : field.label, input);
    if (field.options) input.append(...field.options.map((name) => new Option(name)));
    else if (field.isSwitch) input.type = "checkbox";
    else Object.assign(input, { type: "number", min: field.from, max: field.to, step: field.step, required: true });
    input.addEventListener("change", () => {
      if (!input.checkValidity()) { input.reportValidity(); return; }
      change((request) => {
        if (field.run) request[field.run] = field.isSwitch ? input.checked : number(input.value);
        else for (const key of field.keys) write(key, field.unit ? `${input.value} ${field.unit}` : input.value);
      });
    });
    element("fields").append(label);
    return Object.assign(field, { input });
  }

  function showFields() {
    for (const { input, keys, run, isSwitch, options, step } of FIELDS) {
      const value = run ? state.request[run] : read(keys[0]);
      if (isSwitch) input.checked = value;
      else if (options) input.value = value;
      else {
        input.step = "any"; // a value of the scenario may lie between the steps
        input.value = number(value);
        input.title = `step ${step}`;
      }
    }
    element("undo").disabled = state.past.length === 0;
    element("delete").disabled = !selected()?.remove;
  }

  // ---- Handles ----

  const selected = () => state.handles.find(({ name }) => name === state.selected);

  // The robot can be kidnapped at the time of the slider; at the start the path begins elsewhere instead.
  function robot() {
    const hasBegun = player && player.state.time > player.data.ticks.time[0];
    const truth = hasBegun && Moment.momentAt(player.data, player.state.time).truth;
    if (!truth) return [];
    const move = ([x, y]) => {
      const at = Math.max(player.state.time, 0);
      const heading = truth.heading + number(element("turn").value) * Math.PI / 180;
      const others = state.request.moves.filter((other) => Math.abs(other.at - at) > 1e-3);
      state.request.moves = [...others, { at, x, y, heading }].sort((a, b) => a.at - b.at);
    };
    return [{ kind: "robot", name: "robot", at: [truth.x, truth.y], move }];
  }

  function nearest(event) {
    const reach = NEAR[event.pointerType] ?? NEAR.mouse;
    const distance = ({ at }) => {
      const [left, top] = player.picture.screenAt(...at);
      return Math.hypot(left - event.offsetX, top - event.offsetY);
    };
    const near = [...robot(), ...state.handles].filter((handle) => distance(handle) < reach);
    return near.sort((a, b) => distance(a) - distance(b))[0] ?? null;
  }

  function onDown(event) {
    if (player.state.playing || event.button !== 0) return;
    const handle = nearest(event);
    state.dragged = handle;
    state.selected = handle?.name ?? null;
    state.place = null;
    if (handle) event.target.setPointerCapture(event.pointerId);
    showFields();
    player.draw();
  }

  function onMove(event) {
    if (!state.dragged) {
      event.target.style.cursor = !player.state.playing && nearest(event) ? "grab" : "";
      return;
    }
    state.place = player.picture.floorAt(event.offsetX, event.offsetY);
    player.draw();
  }

  function onUp() {
    const { dragged, place } = state;
    state.dragged = state.place = null;
    if (!dragged || !place) return;
    const isRobot = dragged.kind === "robot";
    change(() => dragged.move(place));
    if (isRobot && element("error").hidden) player.setPlaying(true);
  }

  function moveSelected(right, up) {
    const handle = selected();
    if (handle) change(() => handle.move([handle.at[0] + right * STEP, handle.at[1] + up * STEP]));
  }

  function select(step) {
    const { handles } = state;
    const index = handles.findIndex(({ name }) => name === state.selected);
    state.selected = handles[(index + step + handles.length) % handles.length]?.name ?? null;
    showFields();
    player.draw();
  }

  const COLOURS = { path: "estimate", object: "obstacle", end: "obstacle", corner: "wall", wall: "wall", robot: "truth" };

  // The path to follow and the handles, while the run is paused.
  function overlay(g) {
    const isPaused = Boolean(player) && !player.state.playing;
    element("stage").classList.toggle("paused", isPaused);
    if (!isPaused) return;
    const { screenAt, colours } = player.picture;
    const { scenario: { path, map } } = state.request;
    g.save();
    g.lineWidth = 1;
    const line = (points, colour, dash) => {
      g.strokeStyle = colours()[colour];
      g.setLineDash(dash);
      g.beginPath();
      points.forEach((point) => g.lineTo(...screenAt(...point)));
      g.stroke();
    };
    line([path.start, ...path.corners], "estimate", [2, 6]);
    if (!element("error").hidden) map.wall.forEach(({ from, to }) => line([from, to], "gated", [6, 4]));
    g.setLineDash([]);
    for (const handle of state.handles) drawHandle(g, handle, screenAt(...handle.at), colours());
    if (state.dragged && state.place) {
      line([state.dragged.at, state.place], "ink", [4, 4]);
      g.setLineDash([]);
      drawHandle(g, { ...state.dragged, name: state.selected }, screenAt(...state.place), colours());
    }
    g.restore();
  }

  function drawHandle(g, { kind, name }, [left, top], colours) {
    const isSelected = name === state.selected;
    const size = (kind === "corner" || kind === "end" ? 4 : 5) + (isSelected ? 3 : 0);
    g.fillStyle = isSelected ? colours.ink : colours.paper;
    g.strokeStyle = colours[COLOURS[kind]];
    g.lineWidth = 2;
    g.beginPath();
    if (kind === "path") g.arc(left, top, size, 0, 2 * Math.PI); else g.rect(left - size, top - size, 2 * size, 2 * size);
    g.fill();
    g.stroke();
  }

  // ---- Buttons and keys ----

  function add(obstacle) {
    change(({ scenario }) => (scenario.world.obstacle ??= []).push(obstacle));
    state.selected = state.handles.findLast(({ kind }) => kind === "object")?.name ?? null;
    showFields();
    player.draw();
  }

  // A wall of a metre in the middle of the walls; its ends can be dragged to other walls.
  function addWall() {
    const [x, y] = free();
    change(({ scenario: { map } }) => {
      const names = new Set(map.wall.map(({ name }) => name));
      let number = map.wall.length + 1;
      while (names.has(`wall ${number}`)) number += 1;
      map.wall.push({ name: `wall ${number}`, from: Handles.rounded([x - 0.5, y]), to: Handles.rounded([x + 0.5, y]) });
    });
    state.selected = state.handles.findLast(({ kind }) => kind === "wall")?.name ?? null;
    showFields();
    player.draw();
  }

  // Where the robot is not: the middle of the walls.
  function free() {
    const ends = state.request.scenario.map.wall.flatMap(({ from, to }) => [from, to]);
    const mean = (axis) => ends.reduce((sum, end) => sum + end[axis], 0) / ends.length;
    return [mean(0), mean(1)];
  }

  function save(text, name) {
    const file = new Blob([text], { type: "text/plain" });
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(file), download: name });
    link.click();
    URL.revokeObjectURL(link.href);
  }

  const download = () => save(simulator.file(state.request), "playground.toml");

  // ---- Own maps ----

  function showMap({ error = "", title = "", notes = [] }) {
    Object.assign(element("map-error"), { textContent: error, hidden: error === "" });
    const list = document.createElement("ul");
    list.append(...notes.map((note) => Object.assign(document.createElement("li"), { textContent: note })));
    element("map-result").replaceChildren(title, ...(notes.length > 0 ? [list] : []));
  }

  // Makes the map in a file that of the scene; the objects and kidnappings of the old room are removed.
  async function useMap(file) {
    const options = { name: file.name, unit: element("map-unit").value, is_plan: element("map-plan").checked };
    if (file.size > MOST_BYTES) {
      showMap({ error: `${file.name}: it has more than ${MOST_BYTES >> 20} MiB: remove what is no wall, or use sonarfix map import` });
      return;
    }
    const bytes = new Uint8Array(await file.arrayBuffer());
    const { error, map, path, notes } = simulator.ownMap(options, bytes);
    if (error) { showMap({ error: `${file.name}: ${error}` }); return; }
    change((request) => {
      Object.assign(request.scenario, { map });
      Object.assign(request.scenario.path, path);
      request.scenario.world.obstacle = []; // the address can state this, but not that a key is missing
      request.moves = [];
    });
    state.selected = null;
    player.goTo(-Infinity);
    showMap({ title: `${file.name}: ${map.wall.length} walls`, notes });
  }

  function downloadMap() {
    const { error, text } = simulator.mapFile(state.request);
    if (error) showMap({ error }); else save(text, "map.toml");
  }

  const hasFile = (event) => event.dataTransfer?.types.includes("Files");

  function onDrop(event) {
    if (!hasFile(event)) return;
    event.preventDefault();
    const [file] = event.dataTransfer.files;
    if (file) useMap(file);
  }

  const BUTTONS = {
    undo,
    "download-map": downloadMap,
    "add-wall": addWall,
    "add-post": () => add({ centre: Handles.rounded(free()), radius: "10 cm" }),
    "add-box": () => { const [x, y] = free(); add({ from: Handles.rounded([x - 0.4, y]), to: Handles.rounded([x + 0.4, y]) }); },
    delete: () => { const handle = selected(); if (handle?.remove) change(() => handle.remove()); },
    download,
    reset: () => change((request) => Object.assign(request, structuredClone(state.scene.request))),
  };

  const KEYS = {
    n: (event) => select(event.shiftKey ? -1 : 1),
    i: () => moveSelected(0, 1), k: () => moveSelected(0, -1),
    j: () => moveSelected(-1, 0), l: () => moveSelected(1, 0),
    z: (event) => { if (event.ctrlKey || event.metaKey) undo(); },
    delete: BUTTONS.delete,
  };

  FIELDS.forEach(makeField);
  element("scenes").append(...scenes.map(sceneLink));
  open(location.hash);
  window.addEventListener("hashchange", () => open(location.hash));
  element("scenario").addEventListener("submit", (event) => event.preventDefault());
  for (const [id, act] of Object.entries(BUTTONS)) element(id).addEventListener("click", act);
  element("map-file").addEventListener("change", ({ target }) => {
    const [file] = target.files;
    target.value = ""; // the same file can be chosen again, with another unit
    if (file) useMap(file);
  });
  window.addEventListener("dragover", (event) => { if (hasFile(event)) event.preventDefault(); });
  window.addEventListener("drop", onDrop);
  const stage = element("stage");
  stage.addEventListener("pointerdown", onDown, true); // before the player decides whether it pans
  stage.addEventListener("pointermove", onMove);
  for (const name of ["pointerup", "pointercancel"]) stage.addEventListener(name, onUp);
  stage.addEventListener("keydown", (event) => KEYS[event.key.toLowerCase()]?.(event));
  return { scenes, simulator, state, open, useMap, player: () => player };
})();
