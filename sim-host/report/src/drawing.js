"use strict";
// Draws a run on a canvas: the robot on its map, its sonar, the estimate, the search. The report's player and the live page use it.
//
// A run is a set of columns (of the package `sonarfix-player`), to which the live page appends. `Drawing.picture` draws one moment of it (`moment.js`); what does not
// depend on the time (grid, walls) and what only grows (paths) are layers, which are painted when their view changes.

const Drawing = (() => {
  const { OUTCOMES, SIGMAS, isJump, isUnusual, searchAt } = Moment;
  const LEAST_ROBOT = 7;       // pixels: the least radius at which a heading can be seen
  const TRACK = 0.35;          // metres, where the run does not know
  const SILENT_BEAM = 1.5;     // metres: how far a beam is drawn that heard nothing
  const FADE = 1.5;            // seconds after which a beam has faded to its least
  const COLOURS = ["paper", "ink", "grid", "wall", "obstacle", "truth", "estimate", "encoders", "error", ...OUTCOMES];
  const PATHS = [["encoders", 1.25, 0.7], ["truth", 3, 0.3], ["estimate", 1.5, 0.7]]; // role, width, opacity
  const ZOOM_STEP = 1.25;
  const ZOOMS = [0.2, 200];    // the least and the largest factor

  // ---- The visible part of the floor ----

  // The extent of the whole map: the walls, and the estimate as far as it is not farther from them than they are wide; without
  // walls, the path.
  function bounds({ walls, ticks }) {
    const ends = walls.map((wall) => wall.ends), path = ticks.estimate;
    let [left, right] = extent(ends.length ? ends.flatMap((end) => [end[0], end[2]]) : path.x);
    let [bottom, top] = extent(ends.length ? ends.flatMap((end) => [end[1], end[3]]) : path.y);
    if (ends.length) {
      const room = Math.max(right - left, top - bottom);
      const isNear = (value, low, high) => value !== null && value >= low - room && value <= high + room;
      const near = path.x.map((x, i) => [x, path.y[i]]).filter(([x, y]) => isNear(x, left, right) && isNear(y, bottom, top));
      [left, right] = widened([left, right], near.map(([x]) => x));
      [bottom, top] = widened([bottom, top], near.map(([, y]) => y));
    }
    return { x: (left + right) / 2, y: (bottom + top) / 2, width: right - left, height: top - bottom };
  }

  // A range that also holds some values, with a margin.
  function widened([low, high], values) {
    const [least, most] = values.length ? extent(values) : [low, high];
    return [Math.min(low, least), Math.max(high, most)];
  }

  function extent(values) {
    const known = values.filter((value) => value !== null);
    if (known.length === 0) return [-1, 1];
    // Not Math.min(...known): a long path has more values than a call has arguments.
    const low = known.reduce((a, b) => Math.min(a, b)), high = known.reduce((a, b) => Math.max(a, b));
    const blank = Math.max(0.05 * (high - low), 0.25);
    return [low - blank, high + blank];
  }

  // The median, over the run, of the larger deviation.
  function usualSigma({ ticks }) {
    const larger = ticks.sigma_x.map((sigma, index) => Math.max(sigma, ticks.sigma_y[index]));
    return larger.sort((a, b) => a - b)[larger.length >> 1];
  }

  // ---- Canvas ----

  // Sets a canvas to the pixels it covers and returns its context, with one unit per CSS pixel.
  function prepare(canvas, width = canvas.clientWidth, height = canvas.clientHeight) {
    const ratio = window.devicePixelRatio || 1;
    const wide = Math.round(width * ratio), high = Math.round(height * ratio);
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    const g = canvas.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.globalAlpha = 1;
    g.setLineDash([]);
    return { g, width, height };
  }

  function readColours() {
    const style = getComputedStyle(document.documentElement);
    return Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  const onScreen = (cam, x, y) => [cam.width / 2 + (x - cam.x) * cam.scale, cam.height / 2 - (y - cam.y) * cam.scale];
  const onFloor = (cam, left, top) => [cam.x + (left - cam.width / 2) / cam.scale, cam.y - (top - cam.height / 2) / cam.scale];

  // 1, 2 or 5 times a power of ten metres: the largest that fits into a length.
  function roundLength(metres) {
    const decade = 10 ** Math.floor(Math.log10(metres));
    return decade * ([5, 2].find((step) => step * decade <= metres) ?? 1);
  }

  // The picture of a run on a canvas. `settings` has the values of the menus `view` ("map", or the metres across when it
  // follows the robot) and `exaggeration` ("auto" or a factor of the ellipse); `usualSigma`, if there is one, gives the deviation that "auto" suits.
  function picture(canvas, data, settings) {
    const state = { colours: {}, wholeMap: null, usualSigma: NaN, zoom: 1, panX: 0, panY: 0, cam: null };
    const layers = new Map();
    let robotRadius = TRACK / 2;

    // Reads colours and extents again, after a change of the scheme, of the map or of many ticks.
    function refresh() {
      state.colours = readColours();
      state.wholeMap = bounds(data);
      state.usualSigma = usualSigma(data);
      robotRadius = (data.track > 0 ? data.track : TRACK) / 2;
      layers.clear();
    }

    // Pixels per metre and the point in the middle of the picture.
    function camera(moment, width, height) {
      const { wholeMap, zoom, panX, panY } = state;
      const body = moment.truth ?? moment.estimate;
      const isMap = settings.view() === "map" || !body;
      const usual = isMap
        ? Math.min(width / wholeMap.width, height / wholeMap.height)
        : Math.min(width, height) / Number(settings.view());
      const middle = isMap ? wholeMap : body;
      return { scale: usual * zoom, x: middle.x + panX, y: middle.y + panY, width, height };
    }

    // A power of ten that makes the median ellipse of this run at least a fiftieth of the view.
    function exaggerationFor(cam) {
      if (settings.exaggeration() !== "auto") return Number(settings.exaggeration());
      const across = Math.min(cam.width, cam.height) / cam.scale;
      const wanted = across / 50 / (SIGMAS * (settings.usualSigma?.() ?? state.usualSigma));
      return wanted > 1 && Number.isFinite(wanted) ? 10 ** Math.ceil(Math.log10(wanted)) : 1;
    }

    // A canvas beneath the picture that is painted again only when its key changes.
    function layer(name, key, cam, paint) {
      const found = layers.get(name) ?? { canvas: document.createElement("canvas"), key: null };
      if (found.key !== key) {
        Object.assign(found, { key, length: 0 });
        const { g } = prepare(found.canvas, cam.width, cam.height);
        g.clearRect(0, 0, cam.width, cam.height);
      }
      paint(found.canvas.getContext("2d"), found);
      layers.set(name, found);
      return found.canvas;
    }

    function draw(moment) {
      const { g, width, height } = prepare(canvas);
      if (!state.wholeMap || width === 0 || height === 0) return;
      const cam = state.cam = camera(moment, width, height);
      const key = [cam.scale, cam.x, cam.y, width, height, window.devicePixelRatio].join();
      const put = (image) => g.drawImage(image, 0, 0, width, height);
      put(layer("floor", key, cam, (over, found) => { if (found.length++ === 0) drawFloor(over, cam); }));
      drawAimedWall(g, cam, moment.fix);
      (data.obstacles ?? []).forEach((obstacle) => drawObstacle(g, cam, obstacle, moment.time));
      for (const [role, thick, opacity] of PATHS) {
        g.globalAlpha = opacity;
        put(layer(role, key, cam, (over, found) => extendPath(over, cam, role, thick, moment, found)));
        drawEndOfPath(g, cam, role, thick, moment);
      }
      g.globalAlpha = 1;
      drawFront(g, cam, moment);
    }

    function drawFront(g, cam, moment) {
      const magnified = exaggerationFor(cam);
      if (moment.fix) drawBeam(g, cam, moment.fix, moment.time);
      const search = searchAt(data.searches, moment.time);
      if (search) drawSearch(g, cam, search);
      if (moment.encoders) drawRobot(g, cam, moment.encoders, "encoders", false);
      if (moment.truth) drawRobot(g, cam, moment.truth, "truth", true);
      if (moment.estimate && (!search || search.provisional)) drawEstimate(g, cam, moment, magnified);
      if (moment.absolute) drawAbsolute(g, cam, moment);
      drawNotes(g, cam, magnified, moment.estimate);
      if (search) drawSearchNote(g, search);
    }

    function drawFloor(g, cam) {
      g.fillStyle = state.colours.paper;
      g.fillRect(0, 0, cam.width, cam.height);
      drawGrid(g, cam);
      g.lineCap = "round";
      data.walls.forEach((wall) => drawWall(g, cam, wall, state.colours.wall, 3));
    }

    function drawWall(g, cam, { ends: [x0, y0, x1, y1] }, colour, width) {
      g.strokeStyle = colour;
      g.lineWidth = width;
      g.beginPath();
      g.moveTo(...onScreen(cam, x0, y0));
      g.lineTo(...onScreen(cam, x1, y1));
      g.stroke();
    }

    // The wall last aimed at, in the colour of the outcome.
    function drawAimedWall(g, cam, fix) {
      const wall = fix === null ? undefined : data.walls[fix.wall];
      g.lineCap = "round";
      if (wall) drawWall(g, cam, wall, state.colours[OUTCOMES[fix.outcome]], 5);
    }

    // An obstacle that is not in the map, where its walk has taken it.
    function drawObstacle(g, cam, { circle, face, walk }, time) {
      const [dx, dy] = Moment.walkedBy(walk, time);
      g.strokeStyle = g.fillStyle = state.colours.obstacle;
      g.lineWidth = 3;
      g.lineCap = "butt";
      g.beginPath();
      if (circle) g.arc(...onScreen(cam, circle[0] + dx, circle[1] + dy), Math.max(2, circle[2] * cam.scale), 0, 2 * Math.PI);
      else g.moveTo(...onScreen(cam, face[0] + dx, face[1] + dy)), g.lineTo(...onScreen(cam, face[2] + dx, face[3] + dy));
      g.globalAlpha = 0.35;
      if (circle) g.fill();
      g.globalAlpha = 1;
      g.stroke();
    }

    // Draws the part of a path that its layer lacks; all of it when the time went back. It is interrupted where it is unknown
    // and where it jumps.
    function extendPath(g, cam, role, width, moment, found) {
      const poses = data.ticks[role];
      const dropped = data.dropped ?? 0; // ticks that a live page has dropped at the front: the layer keeps them
      const end = moment.index + 1 + dropped;
      if (end < found.length) {
        g.clearRect(0, 0, cam.width, cam.height);
        found.length = 0;
      }
      g.strokeStyle = state.colours[role];
      g.lineWidth = width;
      g.lineJoin = g.lineCap = "round";
      g.beginPath();
      let pen = g.moveTo;
      for (let i = Math.max(0, found.length - 1 - dropped); i <= moment.index; i++) {
        const x = poses.x[i], y = poses.y[i];
        if (x === null || y === null) { pen = g.moveTo; continue; }
        if (isJump(data.ticks, role, i)) pen = g.moveTo;
        pen.call(g, ...onScreen(cam, x, y));
        pen = g.lineTo;
      }
      g.stroke();
      found.length = end;
    }

    // From the last tick to the moment.
    function drawEndOfPath(g, cam, role, width, moment) {
      const x = data.ticks[role].x[moment.index], y = data.ticks[role].y[moment.index], now = moment[role];
      if (!now || x === null || y === null) return;
      g.strokeStyle = state.colours[role];
      g.lineWidth = width;
      g.beginPath();
      g.moveTo(...onScreen(cam, x, y)), g.lineTo(...onScreen(cam, now.x, now.y));
      g.stroke();
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
      const decided = data.searches.find((other) => other.provisional && other.time <= search.time);
      const count = search.hypotheses.length;
      // A robot does not send its window of pings.
      const window = search.pings.length ? `, ${search.pings.length} pings, ${search.lines.length} lines` : "";
      const text = search.provisional
        ? `provisional pose${decided ? `, decided at ${decided.time.toFixed(1)} s` : ""}`
        : `searching: ${count} ${count === 1 ? "hypothesis" : "hypotheses"}${window}`;
      drawNote(g, [text]);
    }

    // Lines of text in the upper left corner.
    function drawNote(g, lines) {
      g.font = "14px system-ui, sans-serif";
      g.textBaseline = "middle";
      g.globalAlpha = 0.85;
      g.fillStyle = state.colours.paper;
      g.fillRect(4, 6, Math.max(...lines.map((line) => g.measureText(line).width)) + 16, 8 + 18 * lines.length);
      g.globalAlpha = 1;
      g.fillStyle = state.colours.ink;
      lines.forEach((line, index) => g.fillText(line, 12, 19 + 18 * index));
    }

    // The floor before the first moment, and why there is none yet.
    function drawWaiting(text) {
      const { g, width, height } = prepare(canvas);
      if (width === 0 || height === 0) return;
      const cam = state.cam = camera({ truth: null, estimate: null }, width, height);
      drawFloor(g, cam);
      g.font = "14px system-ui, sans-serif";
      const lines = [""];
      for (const word of text.split(" ")) {
        const longer = `${lines.at(-1)} ${word}`.trim();
        if (lines.at(-1) && g.measureText(longer).width > width - 32) lines.push(word); else lines[lines.length - 1] = longer;
      }
      drawNote(g, lines);
    }

    // Whether a pose is outside of the picture.
    function isOutside({ x, y }) {
      if (!state.cam) return false;
      const [left, top] = onScreen(state.cam, x, y);
      return left < 0 || top < 0 || left > state.cam.width || top > state.cam.height;
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

    // A heading, position or pose from outside: a square, and a line in the direction of the heading.
    function drawAbsolute(g, cam, { absolute, estimate, time }) {
      const age = time - absolute.time;
      const at = absolute.x === null ? estimate : absolute;
      if (age > 2 * FADE || !at) return;
      const [x, y] = onScreen(cam, at.x, at.y);
      g.strokeStyle = state.colours[OUTCOMES[absolute.outcome]];
      g.lineWidth = 2;
      g.globalAlpha = Math.max(0.25, 1 - age / (2 * FADE));
      g.beginPath();
      if (absolute.x !== null) g.rect(x - 5, y - 5, 10, 10);
      if (absolute.heading !== null) {
        const length = 3 * radiusOnScreen(cam);
        g.moveTo(x, y), g.lineTo(x + length * Math.cos(absolute.heading), y - length * Math.sin(absolute.heading));
      }
      g.stroke();
      g.globalAlpha = 1;
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

    // The magnification and the scale bar, and where an estimate is that the picture does not hold.
    function drawNotes(g, cam, magnified, estimate) {
      const bar = roundLength(Math.min(160, cam.width / 4) / cam.scale);
      const label = bar >= 1 ? `${bar} m` : bar >= 0.01 ? `${Math.round(bar * 100)} cm` : `${Math.round(bar * 1000)} mm`;
      const notes = [`3σ ellipse ×${magnified}`];
      const enlarged = radiusOnScreen(cam) / cam.scale / robotRadius;
      if (enlarged > 1.05) notes.push(`robot ×${enlarged.toFixed(1)}`);
      if (estimate && isOutside(estimate)) {
        notes.push(`estimate outside of the picture, at ${estimate.x.toFixed(1)} m, ${estimate.y.toFixed(1)} m`);
      }
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

    // ---- Zoom and pan ----

    // Changes the magnification and keeps the point of the floor at a place of the canvas.
    function zoomBy(factor, left = canvas.clientWidth / 2, top = canvas.clientHeight / 2) {
      const { cam } = state;
      if (!cam) return;
      const zoom = Math.min(ZOOMS[1], Math.max(ZOOMS[0], state.zoom * factor));
      const [x, y] = onFloor(cam, left, top);
      const kept = state.zoom / zoom;
      state.panX += (x - cam.x) * (1 - kept);
      state.panY += (y - cam.y) * (1 - kept);
      state.zoom = zoom;
    }

    function panBy(right, down) {
      if (!state.cam) return;
      state.panX -= right / state.cam.scale;
      state.panY += down / state.cam.scale;
    }

    const setZoom = ({ zoom, panX, panY }) => Object.assign(state, { zoom, panX, panY });
    const resetView = () => setZoom({ zoom: 1, panX: 0, panY: 0 });

    // Saves the picture as a PNG file.
    function save(download) {
      canvas.toBlob((image) => {
        const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(image), download });
        link.click();
        URL.revokeObjectURL(link.href);
      });
    }

    // The wheel zooms, dragging pans, a double click shows the usual view again. `changed` draws; where `isBusy` the pointer has another use.
    function navigate(changed, isBusy = () => false) {
      let last = null;
      canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        zoomBy(event.deltaY < 0 ? ZOOM_STEP : 1 / ZOOM_STEP, event.offsetX, event.offsetY);
        changed();
      }, { passive: false });
      canvas.addEventListener("pointerdown", (event) => {
        if (isBusy() || event.button !== 0) return;
        last = event;
        canvas.setPointerCapture(event.pointerId);
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!last) return;
        panBy(event.clientX - last.clientX, event.clientY - last.clientY);
        last = event;
        changed();
      });
      for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { last = null; });
      canvas.addEventListener("dblclick", () => { resetView(); changed(); });
    }

    refresh();
    return {
      canvas, draw, drawWaiting, isOutside, refresh, navigate, save, zoomBy, resetView, setZoom,
      usualSigma: () => state.usualSigma,
      zoom: () => state,
      colours: () => state.colours,
      floorAt: (left, top) => onFloor(state.cam, left, top),
      screenAt: (x, y) => onScreen(state.cam, x, y),
      drawRobot: (g, pose, role) => drawRobot(g, state.cam, pose, role, false),
    };
  }

  return { ZOOM_STEP, prepare, readColours, picture, roundLength, usualSigma };
})();
