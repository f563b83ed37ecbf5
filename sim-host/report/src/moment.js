"use strict";
// A run at one time, and its numbers as text. The report's player and the live page use it.

const Moment = (() => {
  const OUTCOMES = ["accepted", "gated", "refused"];
  const SIGMAS = 3;            // the ellipse holds 98.9 % of a normal distribution in the plane
  const JUMP = 0.25;           // metres: how much farther than the wheels a pose moves in a jump
  const FASTEST = 2;           // metres a second, where the wheels are not known
  const SEARCH_LASTS = 1.5;    // seconds after which a record of the search no longer holds

  const VERDICTS = ["tracking", "degraded", "lost"];

  // ---- The run at one time ----

  // A run with the columns that it lacks, empty.
  const complete = (run) => Object.assign(run, {
    searches: run.searches ?? [], gyro: run.gyro ?? { time: [] }, absolutes: run.absolutes ?? { time: [] },
  });

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

  // How far a pose moved since the tick before; null where that is unknown.
  function step({ x, y }, index) {
    const known = [x[index - 1], x[index], y[index - 1], y[index]];
    return known.some((value) => (value ?? null) === null) ? null : Math.hypot(x[index] - x[index - 1], y[index] - y[index - 1]);
  }

  // Whether a pose moved farther than the wheels since the tick before: the robot was carried away, or has found another pose.
  function isJump(ticks, role, index) {
    const moved = step(ticks[role], index);
    const rolled = step(ticks.encoders, index) ?? FASTEST * (ticks.time[index] - ticks.time[index - 1]);
    return moved !== null && moved > rolled + JUMP;
  }

  // A pose between two ticks; at a jump that of the first.
  function poseAt(ticks, role, tick) {
    const poses = ticks[role], at = isJump(ticks, role, tick.index + 1) ? { ...tick, part: 0 } : tick;
    const x = between(poses.x, at), y = between(poses.y, at);
    const a = poses.heading[at.index], b = poses.heading[Math.min(at.index + 1, poses.heading.length - 1)];
    if (x === null || y === null || a === null || b === null) return null;
    return { x, y, heading: a + at.part * wrap(b - a) };
  }

  function momentAt({ ticks, fixes, gyro, absolutes }, time) {
    const index = Math.max(0, lastBefore(ticks.time, time));
    const next = ticks.time[Math.min(index + 1, ticks.time.length - 1)];
    const length = next - ticks.time[index];
    const at = { index, part: length > 0 ? Math.min(1, Math.max(0, (time - ticks.time[index]) / length)) : 0 };
    return {
      time, index,
      truth: poseAt(ticks, "truth", at),
      estimate: poseAt(ticks, "estimate", at),
      encoders: poseAt(ticks, "encoders", at),
      ellipse: ellipse(between(ticks.sigma_x, at), between(ticks.sigma_y, at), between(ticks.correlation, at)),
      sigmaHeading: between(ticks.sigma_heading, at),
      verdict: ticks.verdict?.[index] ?? null,
      fix: recordAt(fixes, lastBefore(fixes.time, time)),
      gyro: recordAt(gyro, lastBefore(gyro.time, time)),
      absolute: recordAt(absolutes, lastBefore(absolutes.time, time)),
    };
  }

  // A row of columns; null before the first.
  function recordAt(columns, index) {
    if (index < 0) return null;
    return Object.fromEntries(Object.entries(columns).map(([name, column]) => [name, column[index]]));
  }

  // The search at a time; none if the robot has a confirmed pose.
  function searchAt(searches, time) {
    const index = searches.findLastIndex((search) => search.time <= time);
    return index >= 0 && time - searches[index].time < SEARCH_LASTS ? searches[index] : null;
  }

  // How far an obstacle has moved back or forth, x and y; `walk` has the displacement to its turning point and the seconds there.
  function walkedBy(walk, time) {
    if (!walk) return [0, 0];
    const lap = (time / walk[2]) % 2;
    const share = lap <= 1 ? lap : 2 - lap;
    return [share * walk[0], share * walk[1]];
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

  // ---- Numbers ----

  const unknown = "—";
  const millimetres = (metres) => (metres === null ? unknown : `${(metres * 1000).toFixed(1)} mm`);
  const degrees = (radians) => (radians === null ? unknown : `${(radians * 180 / Math.PI).toFixed(2)}°`);
  // A length that may be millimetres or many metres.
  const length = (metres) => (metres === null || metres < 1 ? millimetres(metres) : `${metres.toFixed(2)} m`);

  const distance = (a, b) => (a && b ? Math.hypot(a.x - b.x, a.y - b.y) : null);

  const wallName = (walls, wall) => (wall === null ? "none" : walls[wall]?.name ?? `number ${wall}`);

  // Whether the echo came from something other than a wall.
  const isUnusual = (fix) => fix.source !== null && fix.source !== undefined && fix.source !== "wall";

  // The last measurement cycle as text.
  function fixNumbers(fix, time, walls) {
    if (!fix) return { fix: "none yet", wall: unknown, outcome: unknown, range: unknown, innovation: unknown };
    const sigmas = fix.spread > 0 ? ` (${(Math.abs(fix.innovation) / fix.spread).toFixed(1)} σ)` : "";
    return {
      fix: `${Math.max(0, time - fix.time).toFixed(1)} s ago`,
      wall: wallName(walls, fix.wall),
      outcome: OUTCOMES[fix.outcome] + (fix.reason ? `: ${fix.reason}` : ""),
      range: fix.range === null ? "no echo" : `${fix.range.toFixed(3)} m${isUnusual(fix) ? ` (${fix.source})` : ""}`,
      innovation: millimetres(fix.innovation) + (fix.innovation === null ? "" : sigmas),
    };
  }

  // The gyro and the last heading, position or pose from outside as text; null without one.
  function inputNumbers({ gyro, absolute, time }) {
    const perSecond = (rate) => `${(rate * 180 / Math.PI).toFixed(3)}°/s`;
    const parts = absolute ? [
      `${Math.max(0, time - absolute.time).toFixed(1)} s ago`,
      absolute.x === null ? null : `${absolute.x.toFixed(2)} m, ${absolute.y.toFixed(2)} m`,
      absolute.heading === null ? null : degrees(absolute.heading),
      OUTCOMES[absolute.outcome] + (absolute.reason ? `: ${absolute.reason}` : ""),
    ] : [];
    return {
      bias: gyro ? `${perSecond(gyro.bias)} ± ${perSecond(gyro.sigma)}` : null,
      slips: gyro ? `${gyro.slips}` : null,
      absolute: absolute ? parts.filter((part) => part !== null).join(", ") : null,
    };
  }

  // The numbers of a run whose true pose may be known, as text.
  function numbers(moment, { walls }) {
    const { truth, estimate, encoders, ellipse: shape, fix, sigmaHeading } = moment;
    return {
      error: length(distance(truth, estimate)),
      axes: shape ? `${length(SIGMAS * shape.major)} × ${length(SIGMAS * shape.minor)}` : unknown,
      heading: degrees(truth && estimate ? wrap(estimate.heading - truth.heading) : null),
      sigma: degrees(sigmaHeading === null ? null : SIGMAS * sigmaHeading),
      encoders: length(distance(truth ?? estimate, encoders)),
      verdict: VERDICTS[moment.verdict] ?? unknown,
      ...fixNumbers(fix, moment.time, walls),
      ...inputNumbers(moment),
    };
  }

  // The places of the numbers in an element, by their names.
  const readout = (of) => Object.fromEntries([...of.querySelectorAll("[data-value]")].map((place) => [place.dataset.value, place]));

  // Writes texts into the list of numbers, and shows the outcome of a measurement cycle in its colour; a row without a text is hidden.
  function show(readout, texts, fix) {
    for (const [name, text] of Object.entries(texts)) {
      const row = readout[name];
      row.hidden = row.previousElementSibling.hidden = text === null;
      row.textContent = (text ?? "").replace(/-(?=\d)/g, "−");
    }
    readout.outcome.style.setProperty("--of", fix ? `var(--${OUTCOMES[fix.outcome]})` : "transparent");
  }

  return {
    OUTCOMES, SIGMAS, VERDICTS, complete, lastBefore, momentAt, recordAt, isJump, searchAt, walkedBy, wrap, isUnusual, unknown, millimetres, degrees, length, distance, fixNumbers, inputNumbers, numbers, readout, show,
  };
})();
