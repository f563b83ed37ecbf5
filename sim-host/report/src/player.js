"use strict";
// Plays a run with the drawing of `drawing.js` and the numbers of `moment.js`.
// The address may have a time and a view: report.html#time=612.5&view=8&exaggeration=100

// Opens the player on a run. `overlay(g)` draws over the picture; while `isBusy()`, dragging the picture does not move it.
const openPlayer = (data, { overlay = () => {}, isBusy = () => false } = {}) => {
  data.searches ??= [];
  data.gyro ??= { time: [] };
  data.absolutes ??= { time: [] };
  const root = document.documentElement;

  const { OUTCOMES, SIGMAS, distance, degrees, length, unknown, wrap } = Moment;
  const FOLLOW = "8";          // the view that F follows with, metres across

  const element = (id) => document.getElementById(id);
  const [section, stage, strip, scrub, play, speed, view, exaggeration] =
    ["player", "stage", "strip", "scrub", "play", "speed", "view", "exaggeration"].map(element);
  const readout = Object.fromEntries(
    [...document.querySelectorAll("#readout [data-value]")].map((dd) => [dd.dataset.value, dd]));
  let [start, end] = spanOf(data.ticks.time);
  const state = { time: start, playing: false, lastFrame: 0 };
  const settings = { view: () => view.value, exaggeration: () => exaggeration.value };
  const picture = Drawing.picture(stage, data, settings);
  const cycles = { canvas: document.createElement("canvas"), key: null };

  function spanOf(times) {
    return [times[0], times[times.length - 1]];
  }

  // Plays another run from the same time on.
  function replace(run) {
    Object.assign(data, run);
    [start, end] = spanOf(data.ticks.time);
    Object.assign(scrub, { min: start, max: end });
    cycles.key = null;
    picture.refresh();
    goTo(state.time);
  }

  // ---- Drawing ----

  function draw() {
    const moment = Moment.momentAt(data, state.time);
    picture.draw(moment);
    overlay(stage.getContext("2d"), moment);
    drawStrip();
    showNumbers(moment);
    scrub.value = state.time;
    scrub.setAttribute("aria-valuetext", `${state.time.toFixed(1)} seconds`);
  }

  // Every measurement cycle over time. Those that did not correct the filter are few: they are
  // drawn last and taller, so that none is hidden.
  // The cycles do not change: they are painted once for a width and a scheme, and the time over them.
  function drawStrip() {
    const width = strip.clientWidth, height = strip.clientHeight;
    const { ink } = picture.colours();
    const key = [width, height, window.devicePixelRatio, ink].join();
    if (cycles.key !== key) paintCycles(width, height);
    cycles.key = key;
    const { g } = Drawing.prepare(strip);
    g.clearRect(0, 0, width, height);
    g.drawImage(cycles.canvas, 0, 0, width, height);
    g.fillStyle = ink;
    g.fillRect((end > start ? (state.time - start) / (end - start) * width : 0) - 1, 0, 2, height);
  }

  function paintCycles(width, height) {
    const { g } = Drawing.prepare(cycles.canvas, width, height);
    const colours = picture.colours();
    g.fillStyle = colours.paper;
    g.fillRect(0, 0, width, height);
    const x = (time) => (end > start ? (time - start) / (end - start) * width : 0);
    OUTCOMES.forEach((name, outcome) => {
      g.fillStyle = colours[name];
      const top = outcome === 0 ? height / 2 : 0;
      data.fixes.time.forEach((time, index) => {
        if (data.fixes.outcome[index] === outcome) g.fillRect(x(time) - 0.75, top, 1.5, height - top);
      });
    });
    // When the robot has no pose, and the moments of decision.
    g.fillStyle = colours.estimate;
    data.searches.forEach((search, index) => {
      const isDecision = search.provisional && !(data.searches[index - 1]?.provisional);
      if (!search.provisional) g.fillRect(x(search.time) - 0.75, 0, 1.5, 4);
      if (isDecision) g.fillRect(x(search.time) - 1.5, 0, 3, height);
    });
  }

  // ---- Numbers ----

  function showNumbers(moment) {
    const { truth, estimate, encoders, ellipse: shape, fix } = moment;
    const values = {
      time: `${moment.time.toFixed(1)} s of ${end.toFixed(1)} s`,
      error: length(distance(truth, estimate)),
      axes: shape ? `${length(SIGMAS * shape.major)} × ${length(SIGMAS * shape.minor)}` : unknown,
      heading: degrees(truth && estimate ? wrap(estimate.heading - truth.heading) : null),
      sigma: degrees(moment.sigmaHeading === null ? null : SIGMAS * moment.sigmaHeading),
      encoders: length(distance(truth ?? estimate, encoders)),
      ...Moment.fixNumbers(fix, moment.time, data.walls),
      ...Moment.inputNumbers(moment),
    };
    Moment.show(readout, values);
    readout.outcome.style.setProperty("--of", fix ? `var(--${OUTCOMES[fix.outcome]})` : "transparent");
  }

  // ---- Control ----

  function goTo(time) {
    state.time = Math.min(end, Math.max(start, time));
    draw();
  }

  function setPlaying(playing) {
    state.playing = playing;
    play.textContent = playing ? "Pause" : "Play";
    if (!playing) { draw(); return; }
    if (state.time >= end) state.time = start;
    state.lastFrame = performance.now();
    requestAnimationFrame(frame);
  }

  function frame(now) {
    if (!state.playing) return;
    goTo(state.time + Math.max(0, now - state.lastFrame) / 1000 * Number(speed.value));
    state.lastFrame = now;
    if (state.time >= end) setPlaying(false); else requestAnimationFrame(frame);
  }

  // To the next (or, with −1, the previous) measurement cycle that did not correct the filter.
  function goToTrouble(direction) {
    const times = data.fixes.time.filter((_, index) => data.fixes.outcome[index] !== 0);
    const time = direction > 0
      ? times.find((other) => other > state.time)
      : times.findLast((other) => other < state.time);
    if (time !== undefined) goTo(time);
  }

  const KEYS = {
    " ": () => setPlaying(!state.playing),
    ArrowLeft: (event) => goTo(state.time - (event.shiftKey ? 10 : 1)),
    ArrowRight: (event) => goTo(state.time + (event.shiftKey ? 10 : 1)),
    ArrowUp: () => goToTrouble(-1),
    ArrowDown: () => goToTrouble(1),
    Home: () => goTo(start),
    End: () => goTo(end),
    "+": () => { picture.zoomBy(Drawing.ZOOM_STEP); draw(); },
    "-": () => { picture.zoomBy(1 / Drawing.ZOOM_STEP); draw(); },
    0: () => { picture.resetView(); draw(); },
    f: () => { view.value = view.value === "map" ? FOLLOW : "map"; draw(); },
  };

  function onKey(event) {
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    // Buttons and menus use these keys themselves; the slider acts like the picture.
    if (!KEYS[key] || ["BUTTON", "SELECT"].includes(event.target.tagName) || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    KEYS[key](event);
  }

  function onStrip(event) {
    goTo(start + event.offsetX / strip.clientWidth * (end - start));
  }

  function readAddress() {
    const wanted = new URLSearchParams(location.hash.slice(1));
    for (const menu of [view, exaggeration, speed]) {
      const value = wanted.get(menu.id);
      if ([...menu.options].some((option) => option.value === value)) menu.value = value;
    }
    const time = Number.parseFloat(wanted.get("time"));
    goTo(Number.isFinite(time) ? time : state.time);
  }

  section.hidden = false;
  Object.assign(scrub, { min: start, max: end });
  picture.refresh();
  readAddress();
  section.addEventListener("keydown", onKey);
  strip.addEventListener("click", onStrip);
  scrub.addEventListener("input", () => goTo(Number(scrub.value)));
  play.addEventListener("click", () => setPlaying(!state.playing));
  for (const menu of [view, exaggeration]) menu.addEventListener("change", draw);
  picture.navigate(draw, isBusy);
  window.addEventListener("hashchange", readAddress);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { picture.refresh(); draw(); });
  new ResizeObserver(draw).observe(stage);
  root.dataset.ready = "true";
  return { data, draw, goTo, picture, replace, setPlaying, state };
};
