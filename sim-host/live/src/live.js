"use strict";
// The page of a robot, a recording or a simulation as it runs: takes events, appends them to the columns of a run, and draws.

(() => {
  const { OUTCOMES, SIGMAS, VERDICTS, degrees, distance, length, unknown } = Moment;
  const FOLLOW = "8";          // the view that F follows with, metres across
  const MOST_ROWS = 24_000;    // of a column: 40 minutes at ten ticks a second
  const DROPPED_AT_ONCE = 4_000;
  const MOST_NOTICES = 100;
  const REFRESH = 200;         // ticks after which extent and usual deviation are computed again
  const REFRESH_OUTSIDE = 20;  // the same while the picture does not hold the estimate

  const root = document.documentElement;
  const element = (id) => document.getElementById(id);
  const [stage, view, exaggeration, windowMenu, speed, record, drag, tap, pause, poseForm] =
    ["stage", "view", "exaggeration", "window", "speed", "record", "drag", "tap", "pause", "pose"].map(element);
  const readout = Moment.readout(element("readout"));

  const STAGE = stage.getAttribute("aria-label");

  const poses = () => ({ x: [], y: [], heading: [] });
  const emptyRun = () => ({
    walls: [], obstacles: [], cone: 0, track: 0, dropped: 0, searches: [],
    ticks: { time: [], truth: poses(), estimate: poses(), encoders: poses(), sigma_x: [], sigma_y: [], sigma_heading: [], correlation: [], verdict: [] },
    fixes: { time: [], wall: [], x: [], y: [], direction: [], range: [], source: [], outcome: [], reason: [], innovation: [], spread: [] },
    gyro: { time: [], bias: [], sigma: [], slips: [] },
    absolutes: { time: [], x: [], y: [], heading: [], outcome: [], reason: [], sigmas: [] },
    states: { time: [], scale_right: [], scale_left: [], track_width: [], range_scale: [] },
    weights: { weight: [], bearing: [] },
    wheels: { time: [], right: [], left: [] },
    loop: { time: [], longest: [], deadlines: [] },
  });

  const run = emptyRun();
  const beside = emptyRun();   // another run, complete; without ticks if there is none
  // `began`: the time of the first tick, which may have been dropped
  const state = { search: "", isDue: false, ticks: 0, placing: null, hints: [], isRobot: false, began: null };

  const changed = () => { state.isDue = true; };

  // ---- Events ----

  function append(to, from) {
    for (const [name, column] of Object.entries(from)) {
      if (Array.isArray(column)) to[name].push(...column); else append(to[name], column);
    }
  }

  // Drops the oldest rows of columns of equal length.
  function trim(columns) {
    const first = (of) => (Array.isArray(of) ? of : first(Object.values(of)[0]));
    if (first(columns).length <= MOST_ROWS) return 0;
    const drop = (of) => { if (Array.isArray(of)) of.splice(0, DROPPED_AT_ONCE); else Object.values(of).forEach(drop); };
    drop(columns);
    return DROPPED_AT_ONCE;
  }

  function begin({ scene, walls, obstacles }) {
    Object.assign(run, emptyRun(), { walls, obstacles, cone: scene.cone, track: scene.track });
    picture.refresh();
    Object.assign(state, { search: "", began: null });
    element("title").textContent = document.title = scene.title;
    state.isRobot = scene.source === "robot";
    element("robot").hidden = !state.isRobot;
    element("paced").hidden = state.isRobot;
    poseForm.hidden = !scene.commands;
    document.querySelectorAll("[data-order]").forEach((button) => { button.hidden = !scene.commands; });
    drag.hidden = tap.hidden = element("drive").hidden = !scene.commands;
    element("keys").textContent = scene.commands ? ", P sets the pose by dragging, T sends a position by a tap" : "";
  }

  // Another run is shown beside this one, or none any more.
  function beginBeside({ name, run: other }) {
    Object.assign(beside, emptyRun(), other ? Moment.complete(other) : {});
    say("beside-name", `Beside: ${name}`);
    element("beside").hidden = !other;
    besidePicture.refresh();
  }

  function take(event) {
    switch (event.kind) {
      case "scene": begin(event); break;
      case "beside": beginBeside(event); break;
      case "record":
        append(run, event.columns);
        if (event.more) append(run, event.more);
        if (event.search) state.search = event.search;
        if (event.columns.ticks) {
          state.ticks++;
          state.began ??= event.columns.ticks.time[0];
        }
        run.dropped += trim(run.ticks);
        [run.states, run.wheels, run.loop, run.gyro, run.absolutes].forEach(trim);
        [run.fixes, run.weights].forEach(trim);
        if (run.searches.length > 600) run.searches.splice(0, 200);
        break;
      case "status": showStatus(event.status); break;
      case "notice": showNotice(event.text); break;
      case "missed": showNotice(`${event.count} events were missed: this page was too slow`); break;
    }
    state.isDue = true;
  }

  // ---- Text ----

  function say(id, text) { element(id).textContent = text; }

  function fill(list, texts) {
    list.replaceChildren(...texts.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  }

  function showStatus(status) {
    if (status.longest_poll !== null) {
      append(run.loop, { time: [status.time], longest: [1e3 * status.longest_poll], deadlines: [status.deadlines] });
    }
    say("lines", status.lines.join("\n"));
    state.hints = status.hints;
    fill(element("hints"), status.hints);
    element("check").hidden = status.hints.length === 0;
    record.setAttribute("aria-pressed", String(status.recording !== null));
    record.textContent = status.recording === null ? "Record" : "End recording";
  }

  function showNotice(text) {
    const list = element("notices");
    list.prepend(Object.assign(document.createElement("li"), { textContent: text }));
    while (list.children.length > MOST_NOTICES) list.lastChild.remove();
  }

  function showNumbers(moment) {
    const { estimate, ellipse: shape, fix } = moment;
    const last = run.weights.weight.length - 1;
    const weight = last < 0 ? null : run.weights.weight[last];
    const values = {
      time: `${moment.time.toFixed(1)} s`,
      pose: estimate ? `${estimate.x.toFixed(3)} m, ${estimate.y.toFixed(3)} m, ${degrees(estimate.heading)}` : unknown,
      axes: shape ? `${length(SIGMAS * shape.major)} × ${length(SIGMAS * shape.minor)}` : unknown,
      sigma: degrees(moment.sigmaHeading === null ? null : SIGMAS * moment.sigmaHeading),
      ...Moment.fixNumbers(fix, moment.time, run.walls),
      bearing: last < 0 ? unknown : degrees(run.weights.bearing[last]),
      weight: weight === null ? weightOf(fix) : weight.toFixed(3),
      search: state.search || unknown,
      ...Moment.inputNumbers(moment),
    };
    Moment.show(readout, values, fix);
    const verdict = run.ticks.verdict.at(-1);
    element("verdict").dataset.verdict = verdict ?? "none";
    say("verdict", VERDICTS[verdict] ?? "no estimate yet");
  }

  // A robot sends whether a range has a lower weight, not the weight.
  function weightOf(fix) {
    if (!fix || fix.range === null || fix.innovation === null) return unknown;
    if (fix.outcome !== 0) return "0";
    return fix.reason ? "lower" : "full";
  }

  // ---- Curves ----

  const states = (name, scale) => ({ time: () => run.states.time, value: (i) => scale * run.states[name][i] });
  const travel = (name) => ({
    time: () => run.wheels.time,
    value: (i) => i < 1 ? NaN : 1e3 * (run.wheels[name][i] - run.wheels[name][i - 1]) / (run.wheels.time[i] - run.wheels.time[i - 1]),
  });
  const DEGREES = 180 / Math.PI;
  const gyro = (value) => ({ time: () => run.gyro.time, value });
  const absolutes = {
    time: () => run.absolutes.time,
    value: (i) => run.absolutes.sigmas[i] ?? NaN,
    dots: (i) => OUTCOMES[run.absolutes.outcome[i]],
  };
  // By how much the run beside is later than its own clock: both began at the same time.
  const besideShift = () => (state.began ?? 0) - (beside.ticks.time[0] ?? 0);
  // The same of this run and of the one beside it.
  const both = (name, series) => [[name, "estimate", series(run)], ["beside", "error", { ...series(beside), shift: besideShift }]];
  const sigma = (column, scale) => (of) => Curves.deviation(of, column, scale);
  const curves = [
    ["Position error", "mm", both("error", Curves.positionError)],
    ["Innovation in its 3σ band; rejected ones at the edge", "mm", [["innovation", "accepted", Curves.innovation(run)]]],
    ["Verdict: 0 tracking, 1 degraded, 2 lost", "", both("verdict", Curves.verdict)],
    ["Deviation of x", "mm", both("σ", sigma("sigma_x", 1e3))],
    ["Deviation of y", "mm", both("σ", sigma("sigma_y", 1e3))],
    ["Deviation of the heading", "°", both("σ", sigma("sigma_heading", DEGREES))],
    ["Scale errors", "%", [["right", "estimate", states("scale_right", 100)], ["left", "encoders", states("scale_left", 100)],
      ["range", "accepted", states("range_scale", 100)]]],
    ["Track width", "mm", [["estimate", "estimate", states("track_width", 1e3)]]],
    ["Bias of the gyro", "°/s", [["estimate", "estimate", gyro((i) => DEGREES * run.gyro.bias[i])],
      ["σ", "encoders", gyro((i) => DEGREES * run.gyro.sigma[i])]]],
    ["Slips of the wheels so far", "", [["slips", "gated", gyro((i) => run.gyro.slips[i])]]],
    ["Innovation of measurements from outside; outliers at the edge", "σ", [["innovation", "accepted", absolutes]]],
    ["Speed of the wheels", "mm/s", [["right", "estimate", travel("right")], ["left", "encoders", travel("left")]]],
    ["Longest poll of the loop so far", "ms",
      [["longest", "estimate", { time: () => run.loop.time, value: (i) => run.loop.longest[i] }]]],
    ["Missed deadlines so far", "", [["missed", "gated", { time: () => run.loop.time, value: (i) => run.loop.deadlines[i] }]]],
  ].map(([title, unit, series]) =>
    Curves.curve(element("curves"), title, series.map(([name, colour, of]) => ({ name, colour, ...of })), unit));

  // ---- Drawing ----

  const settings = { view: () => view.value, exaggeration: () => exaggeration.value };
  const picture = Drawing.picture(stage, run, settings);
  // Both ellipses are magnified as much.
  const besideSettings = { ...settings, usualSigma: () => picture.usualSigma() };
  const besidePicture = Drawing.picture(element("beside-stage"), beside, besideSettings);
  const pictures = [picture, besidePicture];
  // Shows both pictures as one of them is shown.
  const follow = (of) => { pictures.forEach((other) => other.setZoom(of.zoom())); changed(); };
  picture.navigate(() => follow(picture), () => state.placing !== null);
  besidePicture.navigate(() => follow(besidePicture));

  // What the first estimate waits for.
  function waiting() {
    const needs = state.hints.length > 0 ? state.hints.join("; ")
      : state.isRobot ? "needs a robot that sends, a pose (Set pose) and a loop that runs (Start)" : "needs the first travel of the wheels";
    return `waiting for the first estimate: ${needs}`;
  }

  function drawBeside(time) {
    const end = beside.ticks.time.at(-1);
    if (end === undefined) return;
    const at = Math.max(beside.ticks.time[0], Math.min(time - besideShift(), end));
    const moment = Moment.momentAt(beside, at);
    besidePicture.draw(moment);
    const error = distance(moment.truth, moment.estimate);
    const texts = [`${at.toFixed(1)} s of ${end.toFixed(1)} s`, VERDICTS[moment.verdict], error === null ? "" : `position error ${length(error)}`];
    say("beside-numbers", texts.filter((text) => text).join(", "));
  }

  function draw() {
    drawBeside(run.ticks.time.at(-1) ?? 0);
    if (run.ticks.time.length === 0) {
      picture.drawWaiting(waiting());
      stage.setAttribute("aria-label", waiting());
      say("verdict", "waiting for the first estimate");
    } else {
      const time = run.ticks.time.at(-1);
      const moment = Moment.momentAt(run, time);
      const isOutside = view.value === "map" && moment.estimate && picture.isOutside(moment.estimate);
      if (state.ticks > (isOutside ? REFRESH_OUTSIDE : REFRESH)) { picture.refresh(); state.ticks = 0; }
      stage.setAttribute("aria-label", STAGE);
      // A range may be later than the last tick.
      moment.fix = Moment.momentAt(run, Math.max(time, run.fixes.time.at(-1) ?? time)).fix;
      moment.absolute = Moment.momentAt(run, Math.max(time, run.absolutes.time.at(-1) ?? time)).absolute;
      picture.draw(moment);
      showNumbers(moment);
      const from = Math.max(run.ticks.time[0], time - Number(windowMenu.value));
      const colours = picture.colours();
      curves.forEach((curve) => curve.draw(from, Math.max(time, from + 1), colours));
    }
    if (state.placing?.to) drawPlaced();
    root.dataset.ready = "true";
  }

  // Draws once per picture of the screen, and only after a change.
  function frame() {
    if (state.isDue) { state.isDue = false; draw(); }
    requestAnimationFrame(frame);
  }

  // ---- Orders ----

  async function order(body) {
    say("answer", "…");
    try {
      say("answer", (await Connection.order(body)).text);
    } catch {
      say("answer", "no connection");
    }
  }

  function setPose({ x, y, heading }) {
    const { position, angle } = poseForm.elements;
    const position_deviation = Number(position.value), heading_deviation = Number(angle.value) * Math.PI / 180;
    return order({ order: "set_pose", x, y, heading, position_deviation, heading_deviation });
  }

  // A position from outside, beside the estimate, with the deviation of the form.
  function sendPosition([x, y]) {
    return order({ order: "position", x, y, deviation: Number(poseForm.elements.position.value) });
  }

  function setPlacing(on, isTap = false) {
    if (drag.hidden) return;
    state.placing = on ? { isTap } : null;
    drag.setAttribute("aria-pressed", String(on && !isTap));
    tap.setAttribute("aria-pressed", String(on && isTap));
    stage.classList.toggle("placing", on);
    if (on) say("answer", isTap ? "tap where the robot is" : "press at the robot's position, drag towards its heading, and release");
  }

  // The pose that a drag describes: from its start towards its end.
  function placed() {
    const [x, y] = state.placing.at, [ahead, aside] = state.placing.to;
    return { x, y, heading: Math.atan2(aside - y, ahead - x) };
  }

  function drawPlaced() {
    const g = stage.getContext("2d");
    picture.drawRobot(g, placed(), "gated");
    g.beginPath();
    g.moveTo(...picture.screenAt(...state.placing.at)), g.lineTo(...picture.screenAt(...state.placing.to));
    g.stroke();
  }

  stage.addEventListener("pointerdown", (event) => {
    if (!state.placing) return;
    state.placing.at = picture.floorAt(event.offsetX, event.offsetY);
    if (state.placing.isTap) {
      sendPosition(state.placing.at);
      setPlacing(false);
      return;
    }
    stage.setPointerCapture(event.pointerId);
  });
  stage.addEventListener("pointermove", (event) => {
    if (!state.placing?.at) return;
    state.placing.to = picture.floorAt(event.offsetX, event.offsetY);
    changed();
  });
  stage.addEventListener("pointerup", () => {
    if (state.placing?.to) setPose(placed());
    if (state.placing?.at) setPlacing(false);
    changed();
  });

  // ---- Driving ----

  const REPEAT = 100;           // ms after which a held motion is ordered again
  const TURN = Math.PI / 4;     // rad/s at 0.1 m/s, as in the terminal
  const [pad, knob, fastest] = ["pad", "knob", "fastest"].map(element);
  const ARROWS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
  const held = new Set();       // the arrow keys that are down
  let repeats = null;
  let wanted = [0, 0];          // ahead and to the left, −1 to 1

  // What is held now. At nothing the robot is ordered to stand, once.
  function hold(ahead, left) {
    const holds = ahead !== 0 || left !== 0;
    wanted = [ahead, left];
    knob.style.transform = `translate(${-60 * left}px, ${-60 * ahead}px)`;
    pad.classList.toggle("held", holds);
    if (holds && repeats === null) {
      repeats = setInterval(sendMotion, REPEAT);
      sendMotion();
    } else if (!holds && repeats !== null) {
      clearInterval(repeats);
      repeats = null;
      sendMotion();
    }
  }

  async function sendMotion() {
    const speed = wanted[0] * Number(fastest.value), turn = wanted[1] * TURN * Number(fastest.value) / 0.1;
    const holds = repeats !== null;
    say("motion", holds ? `${speed.toFixed(2)} m/s, ${(turn * DEGREES).toFixed(0)} °/s` : "stands");
    try {
      // An order that is late is worth nothing.
      const signal = AbortSignal.timeout(3 * REPEAT);
      const { done, text } = await Connection.order({ order: "drive", speed, turn }, signal);
      if (holds || !done) say("answer", text);
    } catch {
      if (holds) say("answer", "no answer to a motion: the robot stands");
    }
  }

  function holdKeys() {
    const sum = [...held].map((key) => ARROWS[key]).reduce(([a, b], [c, d]) => [a + c, b + d], [0, 0]);
    hold(...sum);
  }

  function release() {
    held.clear();
    hold(0, 0);
  }

  // Within a tenth of an axis the motion is straight, or on the spot.
  function holdPointer(event) {
    const { left, top, width, height } = pad.getBoundingClientRect();
    const share = (at, from, size) => Math.min(1, Math.max(-1, (2 * (at - from)) / size - 1));
    const free = (value) => Math.abs(value) < 0.1 ? 0 : value;
    hold(free(-share(event.clientY, top, height)), free(-share(event.clientX, left, width)));
  }

  pad.addEventListener("keydown", (event) => {
    if (!(event.key in ARROWS)) return;
    event.preventDefault();
    held.add(event.key);
    holdKeys();
  });
  pad.addEventListener("keyup", (event) => { if (held.delete(event.key)) holdKeys(); });
  pad.addEventListener("blur", release);
  pad.addEventListener("pointerdown", (event) => {
    pad.setPointerCapture(event.pointerId);
    holdPointer(event);
  });
  pad.addEventListener("pointermove", (event) => { if (pad.hasPointerCapture(event.pointerId)) holdPointer(event); });
  pad.addEventListener("lostpointercapture", release);
  window.addEventListener("blur", release);
  document.addEventListener("visibilitychange", () => { if (document.hidden) release(); });
  element("halt").addEventListener("click", () => {
    release();
    sendMotion();
    order({ order: "stop" });
  });
  element("leave").addEventListener("click", () => {
    release();
    order({ order: "leave" });
  });

  // ---- Control ----

  const KEYS = {
    f: () => { view.value = view.value === "map" ? FOLLOW : "map"; changed(); },
    "+": () => { picture.zoomBy(Drawing.ZOOM_STEP); follow(picture); },
    "-": () => { picture.zoomBy(1 / Drawing.ZOOM_STEP); follow(picture); },
    0: () => { picture.resetView(); follow(picture); },
    p: () => setPlacing(!state.placing),
    t: () => setPlacing(!state.placing, true),
    Escape: () => { setPlacing(false); say("answer", ""); },
  };

  stage.addEventListener("keydown", (event) => {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!KEYS[key] || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    KEYS[key]();
  });
  document.querySelectorAll("[data-order]").forEach((button) =>
    button.addEventListener("click", () => order({ order: button.dataset.order })));
  record.addEventListener("click", () => order({ order: "record", on: record.getAttribute("aria-pressed") === "false" }));
  drag.addEventListener("click", () => setPlacing(!state.placing));
  tap.addEventListener("click", () => setPlacing(!state.placing, true));
  pause.addEventListener("click", () => {
    const on = pause.getAttribute("aria-pressed") === "false";
    pause.setAttribute("aria-pressed", String(on));
    pause.textContent = on ? "Continue" : "Pause";
    order({ order: "pause", on });
  });
  speed.addEventListener("change", () => { if (speed.value) order({ order: "speed", factor: Number(speed.value) }); });
  poseForm.addEventListener("submit", (event) => {
    event.preventDefault();
    const value = (name) => Number(poseForm.elements[name].value);
    setPose({ x: value("x"), y: value("y"), heading: value("heading") * Math.PI / 180 });
  });
  for (const menu of [view, exaggeration, windowMenu]) menu.addEventListener("change", changed);
  element("save-picture").addEventListener("click", () => picture.save("sonarfix.png"));
  const refresh = () => { pictures.forEach((of) => of.refresh()); changed(); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
  const sizes = new ResizeObserver(changed);
  pictures.forEach(({ canvas }) => sizes.observe(canvas));
  document.addEventListener("pointermove", changed);
  requestAnimationFrame(frame);
  Connection.listen(take, (text) => say("connection", text));
})();
