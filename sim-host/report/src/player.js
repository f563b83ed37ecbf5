"use strict";
// Plays a run on a canvas: the robot, its sonar, the estimate and dead reckoning.
// The address may have a time and a view: report.html#time=612.5&view=8&exaggeration=100

(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const { ticks, fixes, walls } = data;
  const searches = data.searches ?? [];
  const root = document.documentElement;
  if (ticks.time.length === 0) { // the page has a placeholder
    root.dataset.ready = "true";
    return;
  }

  const OUTCOMES = ["accepted", "gated", "refused"];
  const SIGMAS = 3;            // the ellipse holds 98.9 % of a normal distribution in the plane
  const LEAST_ROBOT = 7;       // pixels: the least radius at which a heading can be seen
  const TRACK = 0.35;          // metres, where the run does not know
  const SILENT_BEAM = 1.5;     // metres: how far a beam is drawn that heard nothing
  const FADE = 1.5;            // seconds after which a beam has faded to its least
  const SEARCH_LASTS = 1.5;    // seconds after which a record of the search no longer holds
  const FOLLOW = "8";          // the view that F follows with, metres across

  const element = (id) => document.getElementById(id);
  const [section, stage, strip, scrub, play, speed, view, exaggeration] =
    ["player", "stage", "strip", "scrub", "play", "speed", "view", "exaggeration"].map(element);
  const readout = Object.fromEntries(
    [...document.querySelectorAll("#readout [data-value]")].map((dd) => [dd.dataset.value, dd]));
  const start = ticks.time[0], end = ticks.time[ticks.time.length - 1];
  const robotRadius = (data.track > 0 ? data.track : TRACK) / 2;
  const state = { time: start, playing: false, lastFrame: 0, colours: {}, wholeMap: bounds(), usualSigma: usualSigma() };

  // ---- The run at one time ----

  // Index of the last of some ascending times that is not later than a given one; −1 if none.
  function lastBefore(times, time) {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle + 1; else high = middle;
    }
    return low - 1;
  }

  const wrap = (angle) => Math.atan2(Math.sin(angle), Math.cos(angle));

  // A column between two ticks; null where either is unknown.
  function between(column, { index, part }) {
    const a = column[index], b = column[Math.min(index + 1, column.length - 1)];
    return a === null || b === null ? null : a + part * (b - a);
  }

  function poseAt(poses, at) {
    const x = between(poses.x, at), y = between(poses.y, at);
    const a = poses.heading[at.index], b = poses.heading[Math.min(at.index + 1, poses.heading.length - 1)];
    if (x === null || y === null || a === null || b === null) return null;
    return { x, y, heading: a + at.part * wrap(b - a) };
  }

  function momentAt(time) {
    const index = Math.max(0, lastBefore(ticks.time, time));
    const next = ticks.time[Math.min(index + 1, ticks.time.length - 1)];
    const length = next - ticks.time[index];
    const at = { index, part: length > 0 ? Math.min(1, (time - ticks.time[index]) / length) : 0 };
    return {
      time, index,
      truth: poseAt(ticks.truth, at),
      estimate: poseAt(ticks.estimate, at),
      encoders: poseAt(ticks.encoders, at),
      ellipse: ellipse(between(ticks.sigma_x, at), between(ticks.sigma_y, at), between(ticks.correlation, at)),
      sigmaHeading: between(ticks.sigma_heading, at),
      fix: fixAt(lastBefore(fixes.time, time)),
    };
  }

  function fixAt(index) {
    if (index < 0) return null;
    return Object.fromEntries(Object.entries(fixes).map(([name, column]) => [name, column[index]]));
  }

  // Half axes and direction of the 1σ ellipse: the eigenvalues and -vectors of the covariance.
  function ellipse(sigmaX, sigmaY, correlation) {
    if (sigmaX === null || sigmaY === null) return null;
    const xx = sigmaX * sigmaX, yy = sigmaY * sigmaY, xy = (correlation ?? 0) * sigmaX * sigmaY;
    const mean = (xx + yy) / 2, swing = Math.hypot((xx - yy) / 2, xy);
    return {
      major: Math.sqrt(mean + swing),
      minor: Math.sqrt(Math.max(0, mean - swing)),
      angle: Math.atan2(2 * xy, xx - yy) / 2,
    };
  }

  // ---- The visible part of the floor ----

  // The extent of the whole map: the walls; without any, the path.
  function bounds() {
    const ends = walls.map((wall) => wall.ends);
    const path = ends.length ? null : ticks.estimate;
    const xs = path ? path.x : ends.flatMap((end) => [end[0], end[2]]);
    const ys = path ? path.y : ends.flatMap((end) => [end[1], end[3]]);
    const [left, right] = extent(xs), [bottom, top] = extent(ys);
    return { x: (left + right) / 2, y: (bottom + top) / 2, width: right - left, height: top - bottom };
  }

  function extent(values) {
    const known = values.filter((value) => value !== null);
    if (known.length === 0) return [-1, 1];
    // Not Math.min(...known): a long path has more values than a call has arguments.
    const low = known.reduce((a, b) => Math.min(a, b)), high = known.reduce((a, b) => Math.max(a, b));
    const blank = Math.max(0.05 * (high - low), 0.25);
    return [low - blank, high + blank];
  }

  // Pixels per metre and the point in the middle of the picture.
  function camera(moment, width, height) {
    const { wholeMap } = state;
    const body = moment.truth ?? moment.estimate;
    if (view.value === "map" || !body) {
      const scale = Math.min(width / wholeMap.width, height / wholeMap.height);
      return { scale, x: wholeMap.x, y: wholeMap.y, width, height };
    }
    return { scale: Math.min(width, height) / Number(view.value), x: body.x, y: body.y, width, height };
  }

  // A power of ten that makes the median ellipse of this run at least a fiftieth of the view.
  function exaggerationFor(cam) {
    if (exaggeration.value !== "auto") return Number(exaggeration.value);
    const across = Math.min(cam.width, cam.height) / cam.scale;
    const wanted = across / 50 / (SIGMAS * state.usualSigma);
    return wanted > 1 && Number.isFinite(wanted) ? 10 ** Math.ceil(Math.log10(wanted)) : 1;
  }

  // The median, over the run, of the larger deviation.
  function usualSigma() {
    const larger = ticks.sigma_x.map((sigma, index) => Math.max(sigma, ticks.sigma_y[index]));
    return larger.sort((a, b) => a - b)[larger.length >> 1];
  }

  // ---- Drawing ----

  // Sets a canvas to the pixels it covers and returns its context, with one unit per CSS pixel.
  function prepare(canvas) {
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    const wide = Math.round(width * ratio), high = Math.round(height * ratio);
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.globalAlpha = 1;
    g.setLineDash([]);
    g.fillStyle = state.colours.paper;
    g.fillRect(0, 0, width, height);
    return { g, width, height };
  }

  const onScreen = (cam, x, y) => [cam.width / 2 + (x - cam.x) * cam.scale, cam.height / 2 - (y - cam.y) * cam.scale];

  function draw() {
    const moment = momentAt(state.time);
    const { g, width, height } = prepare(stage);
    const cam = camera(moment, width, height);
    const magnified = exaggerationFor(cam);
    drawGrid(g, cam);
    drawWalls(g, cam, moment.fix);
    drawTrail(g, cam, ticks.encoders, moment, "encoders", 1.25);
    drawTrail(g, cam, ticks.truth, moment, "truth", 3);
    drawTrail(g, cam, ticks.estimate, moment, "estimate", 1.5);
    if (moment.fix) drawBeam(g, cam, moment.fix, moment.time);
    const search = searchAt(moment.time);
    if (search) drawSearch(g, cam, search);
    if (moment.encoders) drawRobot(g, cam, moment.encoders, "encoders", false);
    if (moment.truth) drawRobot(g, cam, moment.truth, "truth", true);
    if (moment.estimate && (!search || search.provisional)) drawEstimate(g, cam, moment, magnified);
    drawNotes(g, cam, magnified);
    if (search) drawSearchNote(g, search);
    drawStrip();
    showNumbers(moment);
    scrub.value = state.time;
    scrub.setAttribute("aria-valuetext", `${state.time.toFixed(1)} seconds`);
  }

  // The search at a time; none if the robot has a confirmed pose.
  function searchAt(time) {
    const index = lastBefore(searches.map((search) => search.time), time);
    return index >= 0 && time - searches[index].time < SEARCH_LASTS ? searches[index] : null;
  }

  // The window of pings and its lines, as the best hypothesis places them, and the hypotheses, fainter with less weight.
  function drawSearch(g, cam, { hypotheses, pings, lines }) {
    g.strokeStyle = g.fillStyle = state.colours.ink;
    g.lineWidth = 1;
    pings.forEach(([x, y, echoX, echoY]) => {
      if (echoX === null) return;
      g.globalAlpha = 0.12;
      g.beginPath();
      g.moveTo(...onScreen(cam, x, y)), g.lineTo(...onScreen(cam, echoX, echoY));
      g.stroke();
      g.globalAlpha = 0.6;
      g.beginPath();
      g.arc(...onScreen(cam, echoX, echoY), 2.5, 0, 2 * Math.PI);
      g.fill();
    });
    g.strokeStyle = state.colours.accepted;
    g.lineWidth = 4;
    g.globalAlpha = 0.6;
    lines.forEach(([x0, y0, x1, y1]) => {
      g.beginPath();
      g.moveTo(...onScreen(cam, x0, y0)), g.lineTo(...onScreen(cam, x1, y1));
      g.stroke();
    });
    g.globalAlpha = 1;
    g.font = "13px system-ui, sans-serif";
    [...hypotheses].reverse().forEach(([x, y, heading, weight]) => {
      g.globalAlpha = Math.max(0.25, Math.sqrt(weight));
      drawRobot(g, cam, { x, y, heading }, "estimate", false);
      const [left, top] = onScreen(cam, x, y);
      g.fillText(weight >= 0.01 ? weight.toFixed(2) : "<0.01", left + radiusOnScreen(cam) + 8, top);
      g.globalAlpha = 1;
    });
  }

  // The state of the search, and when it decided.
  function drawSearchNote(g, search) {
    const decided = searches.find((other) => other.provisional && other.time <= search.time);
    const count = search.hypotheses.length;
    const text = search.provisional
      ? `provisional pose${decided ? `, decided at ${decided.time.toFixed(1)} s` : ""}`
      : `searching: ${count} ${count === 1 ? "hypothesis" : "hypotheses"}, ${search.pings.length} pings, ${search.lines.length} lines`;
    g.font = "14px system-ui, sans-serif";
    g.textBaseline = "middle";
    g.globalAlpha = 0.85;
    g.fillStyle = state.colours.paper;
    g.fillRect(4, 6, g.measureText(text).width + 16, 26);
    g.globalAlpha = 1;
    g.fillStyle = state.colours.ink;
    g.fillText(text, 12, 19);
  }

  // 1, 2 or 5 times a power of ten metres: the largest that fits into a length.
  function roundLength(metres) {
    const decade = 10 ** Math.floor(Math.log10(metres));
    return decade * ([5, 2].find((step) => step * decade <= metres) ?? 1);
  }

  function drawGrid(g, cam) {
    const step = roundLength(Math.max(cam.width, cam.height) / cam.scale / 6);
    const halfWidth = cam.width / 2 / cam.scale, halfHeight = cam.height / 2 / cam.scale;
    g.strokeStyle = state.colours.grid;
    g.lineWidth = 1;
    g.beginPath();
    for (let n = Math.ceil((cam.x - halfWidth) / step); n * step <= cam.x + halfWidth; n++) {
      const [x] = onScreen(cam, n * step, 0);
      g.moveTo(x, 0), g.lineTo(x, cam.height);
    }
    for (let n = Math.ceil((cam.y - halfHeight) / step); n * step <= cam.y + halfHeight; n++) {
      const [, y] = onScreen(cam, 0, n * step);
      g.moveTo(0, y), g.lineTo(cam.width, y);
    }
    g.stroke();
  }

  // The walls; the one last aimed at in the colour of the outcome.
  function drawWalls(g, cam, fix) {
    g.lineCap = "round";
    walls.forEach(({ ends: [x0, y0, x1, y1] }, index) => {
      const aimedAt = fix !== null && fix.wall === index;
      g.strokeStyle = aimedAt ? state.colours[OUTCOMES[fix.outcome]] : state.colours.wall;
      g.lineWidth = aimedAt ? 5 : 3;
      g.beginPath();
      g.moveTo(...onScreen(cam, x0, y0));
      g.lineTo(...onScreen(cam, x1, y1));
      g.stroke();
    });
  }

  // The path up to now. It is interrupted where it is unknown.
  function drawTrail(g, cam, poses, moment, role, width) {
    g.strokeStyle = state.colours[role];
    g.globalAlpha = role === "truth" ? 0.3 : 0.7;
    g.lineWidth = width;
    g.lineJoin = "round";
    g.beginPath();
    let pen = g.moveTo;
    for (let i = 0; i <= moment.index; i++) {
      const x = poses.x[i], y = poses.y[i];
      if (x === null || y === null) { pen = g.moveTo; continue; }
      pen.call(g, ...onScreen(cam, x, y));
      pen = g.lineTo;
    }
    const now = moment[role];
    if (now) pen.call(g, ...onScreen(cam, now.x, now.y));
    g.stroke();
    g.globalAlpha = 1;
  }

  const radiusOnScreen = (cam) => Math.max(robotRadius * cam.scale, LEAST_ROBOT);

  // A circle with a nose ahead.
  function drawRobot(g, cam, pose, role, filled) {
    const [x, y] = onScreen(cam, pose.x, pose.y);
    const radius = radiusOnScreen(cam);
    const at = (distance, angle) =>
      [x + distance * radius * Math.cos(pose.heading + angle), y - distance * radius * Math.sin(pose.heading + angle)];
    g.strokeStyle = g.fillStyle = state.colours[role];
    g.lineWidth = 2;
    g.beginPath();
    g.arc(x, y, radius, 0, 2 * Math.PI);
    if (filled) {
      g.globalAlpha = 0.15;
      g.fill();
      g.globalAlpha = 1;
    }
    g.stroke();
    g.beginPath();
    g.moveTo(...at(1.5, 0)), g.lineTo(...at(1, 0.4)), g.lineTo(...at(1, -0.4));
    g.closePath();
    g.fill();
  }

  // Whether the echo came from something other than a wall.
  const isUnusual = (fix) => fix.source !== null && fix.source !== "wall";

  // The sonar's cone, and a dot at the measured range, with the source of the echo.
  function drawBeam(g, cam, fix, time) {
    if (fix.x === null || fix.y === null || fix.direction === null) return;
    const colour = state.colours[OUTCOMES[fix.outcome]];
    const [x, y] = onScreen(cam, fix.x, fix.y);
    const length = (fix.range ?? SILENT_BEAM) * cam.scale;
    const cone = data.cone ?? 0;
    g.fillStyle = g.strokeStyle = colour;
    g.globalAlpha = Math.max(0.12, 0.4 * (1 - (time - fix.time) / FADE));
    g.beginPath();
    g.moveTo(x, y);
    g.arc(x, y, length, -fix.direction - cone, -fix.direction + cone);
    g.closePath();
    g.fill();
    g.globalAlpha = 1;
    if (fix.range === null) return;
    g.beginPath();
    const [dotX, dotY] = [x + length * Math.cos(fix.direction), y - length * Math.sin(fix.direction)];
    g.arc(dotX, dotY, 4.5, 0, 2 * Math.PI);
    g.fill();
    if (isUnusual(fix)) g.fillText(fix.source, dotX + 8, dotY - 8);
  }

  // The estimated robot and its ellipse, magnified; where the truth is known, a cross at its
  // position relative to the estimate, magnified as much.
  function drawEstimate(g, cam, { estimate, truth, ellipse: shape }, magnified) {
    drawRobot(g, cam, estimate, "estimate", false);
    if (!shape) return;
    const [x, y] = onScreen(cam, estimate.x, estimate.y);
    const factor = SIGMAS * magnified * cam.scale;
    g.beginPath();
    g.ellipse(x, y, factor * shape.major, factor * shape.minor, -shape.angle, 0, 2 * Math.PI);
    g.globalAlpha = 0.2;
    g.fill();
    g.globalAlpha = 1;
    g.lineWidth = 1.5;
    g.stroke();
    if (!truth) return;
    const dx = (truth.x - estimate.x) * magnified * cam.scale, dy = (estimate.y - truth.y) * magnified * cam.scale;
    g.strokeStyle = state.colours.truth;
    g.beginPath();
    g.moveTo(x + dx - 5, y + dy), g.lineTo(x + dx + 5, y + dy);
    g.moveTo(x + dx, y + dy - 5), g.lineTo(x + dx, y + dy + 5);
    g.stroke();
  }

  // The magnification and the scale bar.
  function drawNotes(g, cam, magnified) {
    const bar = roundLength(160 / cam.scale);
    const label = bar >= 1 ? `${bar} m` : bar >= 0.01 ? `${Math.round(bar * 100)} cm` : `${Math.round(bar * 1000)} mm`;
    const notes = [`3σ ellipse ×${magnified}`];
    const enlarged = radiusOnScreen(cam) / cam.scale / robotRadius;
    if (enlarged > 1.05) notes.push(`robot ×${enlarged.toFixed(1)}`);
    g.font = "13px system-ui, sans-serif";
    g.textBaseline = "middle";
    g.lineWidth = 2;
    const left = 12, bottom = cam.height - 14;
    const text = notes.join("  ·  ");
    // A background, so that walls and trails do not run through the text.
    const width = bar * cam.scale + 34 + g.measureText(label).width + g.measureText(text).width;
    g.globalAlpha = 0.85;
    g.fillStyle = state.colours.paper;
    g.fillRect(left - 8, bottom - 12, width + 20, 24);
    g.globalAlpha = 1;
    g.fillStyle = g.strokeStyle = state.colours.ink;
    g.beginPath();
    g.moveTo(left, bottom - 4), g.lineTo(left, bottom + 4);
    g.moveTo(left, bottom), g.lineTo(left + bar * cam.scale, bottom);
    g.moveTo(left + bar * cam.scale, bottom - 4), g.lineTo(left + bar * cam.scale, bottom + 4);
    g.stroke();
    g.fillText(label, left + bar * cam.scale + 8, bottom);
    g.fillText(text, left + bar * cam.scale + 34 + g.measureText(label).width, bottom);
  }

  // Every measurement cycle over time. Those that did not correct the filter are few: they are
  // drawn last and taller, so that none is hidden.
  function drawStrip() {
    const { g, width, height } = prepare(strip);
    const x = (time) => (end > start ? (time - start) / (end - start) * width : 0);
    OUTCOMES.forEach((name, outcome) => {
      g.fillStyle = state.colours[name];
      const top = outcome === 0 ? height / 2 : 0;
      fixes.time.forEach((time, index) => {
        if (fixes.outcome[index] === outcome) g.fillRect(x(time) - 0.75, top, 1.5, height - top);
      });
    });
    // When the robot has no pose, and the moments of decision.
    g.fillStyle = state.colours.estimate;
    searches.forEach((search, index) => {
      const isDecision = search.provisional && !(searches[index - 1]?.provisional);
      if (!search.provisional) g.fillRect(x(search.time) - 0.75, 0, 1.5, 4);
      if (isDecision) g.fillRect(x(search.time) - 1.5, 0, 3, height);
    });
    g.fillStyle = state.colours.ink;
    g.fillRect(x(state.time) - 1, 0, 2, height);
  }

  // ---- Numbers ----

  const unknown = "—";
  const millimetres = (metres) => (metres === null ? unknown : `${(metres * 1000).toFixed(1)} mm`);
  const degrees = (radians) => (radians === null ? unknown : `${(radians * 180 / Math.PI).toFixed(2)}°`);
  // A length that may be millimetres or many metres.
  const length = (metres) => (metres === null || metres < 1 ? millimetres(metres) : `${metres.toFixed(2)} m`);

  const distance = (a, b) => (a && b ? Math.hypot(a.x - b.x, a.y - b.y) : null);

  function showNumbers(moment) {
    const { truth, estimate, encoders, ellipse: shape, fix } = moment;
    const values = {
      time: `${moment.time.toFixed(1)} s of ${end.toFixed(1)} s`,
      error: length(distance(truth, estimate)),
      axes: shape ? `${length(SIGMAS * shape.major)} × ${length(SIGMAS * shape.minor)}` : unknown,
      heading: degrees(truth && estimate ? wrap(estimate.heading - truth.heading) : null),
      sigma: degrees(moment.sigmaHeading === null ? null : SIGMAS * moment.sigmaHeading),
      encoders: length(distance(truth ?? estimate, encoders)),
      ...fixNumbers(fix, moment.time),
    };
    for (const [name, text] of Object.entries(values)) readout[name].textContent = text.replace(/^-/, "−");
    readout.outcome.style.setProperty("--of", fix ? `var(--${OUTCOMES[fix.outcome]})` : "transparent");
  }

  function fixNumbers(fix, time) {
    if (!fix) return { fix: "none yet", wall: unknown, outcome: unknown, range: unknown, innovation: unknown };
    const sigmas = fix.spread > 0 ? ` (${(Math.abs(fix.innovation) / fix.spread).toFixed(1)} σ)` : "";
    return {
      fix: `${(time - fix.time).toFixed(1)} s ago`,
      wall: fix.wall === null ? "none" : walls[fix.wall]?.name ?? `number ${fix.wall}`,
      outcome: OUTCOMES[fix.outcome] + (fix.reason ? `: ${fix.reason}` : ""),
      range: fix.range === null ? "no echo" : `${fix.range.toFixed(3)} m${isUnusual(fix) ? ` (${fix.source})` : ""}`,
      innovation: millimetres(fix.innovation) + (fix.innovation === null ? "" : sigmas),
    };
  }

  // ---- Control ----

  function goTo(time) {
    state.time = Math.min(end, Math.max(start, time));
    draw();
  }

  function setPlaying(playing) {
    state.playing = playing;
    play.textContent = playing ? "Pause" : "Play";
    if (!playing) return;
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
    const times = fixes.time.filter((_, index) => fixes.outcome[index] !== 0);
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

  function readColours() {
    const style = getComputedStyle(root);
    for (const name of ["paper", "ink", "grid", "wall", "truth", "estimate", "encoders", ...OUTCOMES]) {
      state.colours[name] = style.getPropertyValue(`--${name}`).trim();
    }
  }

  section.hidden = false;
  Object.assign(scrub, { min: start, max: end });
  readColours();
  readAddress();
  section.addEventListener("keydown", onKey);
  strip.addEventListener("click", onStrip);
  scrub.addEventListener("input", () => goTo(Number(scrub.value)));
  play.addEventListener("click", () => setPlaying(!state.playing));
  for (const menu of [view, exaggeration]) menu.addEventListener("change", draw);
  window.addEventListener("hashchange", readAddress);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColours(); draw(); });
  new ResizeObserver(draw).observe(stage);
  root.dataset.ready = "true";
})();
