"use strict";
// Plays two runs side by side, each on its map, at one time.

const openComparison = (runs) => {
  const NAMES = ["first", "second"];
  const COLOURS = ["estimate", "error"];
  const section = document.getElementById("comparison");

  // The ellipses of both are magnified as much.
  const usualSigma = Math.max(...runs.map(Drawing.usualSigma));
  const settings = { ...Playback.settings, usualSigma: () => usualSigma };
  const sides = runs.map((run, n) => {
    const data = Moment.complete(run), side = section.querySelectorAll(".side")[n];
    const picture = Drawing.picture(side.querySelector(".map"), data, settings);
    const strip = Strip.open(side.querySelector(".cycles"), data, picture, (time) => playback.goTo(time));
    return { data, picture, strip, readout: Moment.readout(side), end: data.ticks.time.at(-1) };
  });
  const times = [Math.min(...runs.map(({ ticks }) => ticks.time[0])), Math.max(...sides.map(({ end }) => end))];
  const span = () => times;

  // ---- Curves of both runs ----

  const both = (series) => sides.map(({ data }, n) => ({ name: NAMES[n], colour: COLOURS[n], ...series(data) }));
  const isSameMap = JSON.stringify(runs[0].walls) === JSON.stringify(runs[1].walls);

  // How far the second estimate is from the first, at the ticks of the first that the second run has; only on one map.
  function apart() {
    const [first, second] = runs, [, { end }] = sides;
    const time = isSameMap ? first.ticks.time.filter((at) => at <= end) : [];
    const far = time.map((at) => Moment.distance(Moment.momentAt(first, at).estimate, Moment.momentAt(second, at).estimate));
    return [{ name: "distance", colour: "ink", time: () => time, value: (i) => 1e3 * (far[i] ?? NaN) }];
  }

  const innovations = (n) => [{ name: "innovation", colour: COLOURS[n], ...Curves.innovation(runs[n]) }];
  const curves = [
    ["Position error", "mm", both(Curves.positionError)],
    ["Heading error", "°", both(Curves.headingError)],
    ["Verdict: 0 tracking, 1 degraded, 2 lost", "", both(Curves.verdict)],
    ["Distance between the estimates", "mm", apart()],
    ["Deviation of x", "mm", both((run) => Curves.deviation(run, "sigma_x", 1e3))],
    ["Deviation of y", "mm", both((run) => Curves.deviation(run, "sigma_y", 1e3))],
    ["Deviation of the heading", "°", both((run) => Curves.deviation(run, "sigma_heading", 180 / Math.PI))],
    ["First: innovation in its 3σ band; rejected ones at the edge", "mm", innovations(0)],
    ["Second: innovation in its 3σ band; rejected ones at the edge", "mm", innovations(1)],
  ].map(([title, unit, series]) =>
    Curves.curve(document.getElementById("curves"), title, series, unit, (time) => playback.goTo(time)));

  // ---- Drawing ----

  // A run that has ended stays as it was.
  function draw(time) {
    sides.forEach(({ data, picture, strip, readout, end }) => {
      const moment = Moment.momentAt(data, Math.min(time, end));
      picture.draw(moment);
      strip.draw(time, span());
      const at = time > end ? `ended at ${end.toFixed(1)} s` : `${time.toFixed(1)} s of ${end.toFixed(1)} s`;
      Moment.show(readout, { time: at, ...Moment.numbers(moment, data) }, moment.fix);
    });
    const colours = sides[0].picture.colours();
    curves.forEach((curve) => curve.draw(...span(), colours, time));
  }

  const playback = Playback.open(section, { span, draw, pictures: sides.map(({ picture }) => picture) });
  document.getElementById("curves").addEventListener("pointermove", playback.show);
  document.getElementById("curves").addEventListener("pointerout", playback.show);
  return playback;
};

openComparison(JSON.parse(document.getElementById("data").textContent));
