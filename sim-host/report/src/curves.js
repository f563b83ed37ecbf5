"use strict";
// Curves over time on canvases. A curve has series of columns, of which it draws a span of time; the pointer reads a value.

const Curves = (() => {
  const LEFT = 46, BOTTOM = 16, TOP = 4;   // pixels beside the plot

  // By how much a series is drawn later than its column of times says.
  const shiftOf = (series) => series.shift?.() ?? 0;

  // Indices of the points of a series in a time span.
  function span(series, from, to) {
    const time = series.time(), shift = shiftOf(series);
    return [Math.max(0, Moment.lastBefore(time, from - shift)), Moment.lastBefore(time, to - shift)];
  }

  // A curve in a container. `series` are { name, colour, time: () => column, value: (index) => number, dots, band, text, shift }; what the
  // pointer reads is `text(index)`, or else the value. A series with an empty column is not shown. A click calls `goTo(time)`.
  function curve(container, title, series, unit, goTo = () => {}) {
    const figure = document.createElement("figure");
    figure.className = "curve panel";
    const caption = document.createElement("figcaption");
    caption.append(Object.assign(document.createElement("b"), { textContent: title }));
    const items = series.map(({ name, colour }) => {
      const item = document.createElement("span");
      item.style.setProperty("--of", `var(--${colour})`);
      const value = document.createElement("span");
      item.append(document.createElement("i"), `${name} `, value);
      caption.append(item);
      return { item, value };
    });
    const canvas = Object.assign(document.createElement("canvas"), { tabIndex: 0 });
    canvas.setAttribute("role", "img");
    figure.append(caption, canvas);
    container.append(figure);
    let pointer = null;
    let shown = [0, 0];        // first and last time
    const timeAt = (left) => shown[0] + (left - LEFT) / (canvas.clientWidth - LEFT - 4) * (shown[1] - shown[0]);
    canvas.addEventListener("click", (event) => goTo(timeAt(event.offsetX)));
    canvas.addEventListener("pointermove", (event) => { pointer = event.offsetX; });
    canvas.addEventListener("pointerleave", () => { pointer = null; });

    // A span of time; `now` is the time of the pictures, if it is not the end.
    function draw(from, to, colours, now = null) {
      shown = [from, to];
      figure.hidden = series.every((of) => of.time().length === 0);
      if (figure.hidden) return;
      const { g, width, height } = Drawing.prepare(canvas);
      if (width === 0 || !(to > from)) return;
      g.clearRect(0, 0, width, height);
      const limits = extent(from, to);
      const x = (time) => LEFT + (time - from) / (to - from) * (width - LEFT - 4);
      const y = (value) => TOP + (limits.high - value) / (limits.high - limits.low) * (height - TOP - BOTTOM);
      drawAxes(g, width, height, limits, x, y, from, to, colours);
      g.save();
      g.beginPath();
      g.rect(LEFT, 0, width - LEFT, height - BOTTOM + 2);
      g.clip();
      series.forEach((of) => drawSeries(g, of, from, to, x, y, colours));
      g.restore();
      g.fillStyle = colours.ink;
      if (now !== null) g.fillRect(x(now) - 1, TOP, 2, height - TOP - BOTTOM);
      if (pointer !== null) g.fillRect(x(timeAt(pointer)), TOP, 1, height - TOP - BOTTOM);
      showValues(pointer === null ? now ?? to : timeAt(pointer));
    }

    function showValues(at) {
      const texts = series.map((of, index) => {
        const found = Moment.lastBefore(of.time(), at - shiftOf(of));
        const value = found < 0 ? null : of.value(found);
        const number = Number.isFinite(value) ? `${value.toPrecision(3)} ${unit}` : Moment.unknown;
        const text = (found >= 0 && of.text ? of.text(found) : number).replace(/^-/, "−");
        const { item, value: place } = items[index];
        item.hidden = of.time().length === 0;
        place.textContent = text;
        return `${of.name} ${text}`;
      });
      canvas.setAttribute("aria-label", `${title}: ${texts.join(", ")}`);
    }

    function extent(from, to) {
      let low = Infinity, high = -Infinity;
      for (const of of series) {
        const [first, last] = span(of, from, to);
        for (let i = first; i <= last; i++) {
          // Rejected values are drawn at the edge, so that the others can be seen.
          const isInside = !of.dots || of.dots(i) === "accepted";
          for (const value of of.band ? [isInside ? of.value(i) : NaN, of.band(i), -of.band(i)] : [of.value(i)]) {
            if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
          }
        }
      }
      if (low > high) return { low: 0, high: 1 };
      const blank = Math.max(0.08 * (high - low), Math.abs(high) * 1e-3, high === low ? 0.01 : 0);
      return { low: low - blank, high: high + blank };
    }

    return { draw };
  }

  function drawAxes(g, width, height, { low, high }, x, y, from, to, colours) {
    const step = Drawing.roundLength((high - low) / 2.5);
    g.font = "11px system-ui, sans-serif";
    g.textBaseline = "middle";
    g.strokeStyle = colours.grid;
    g.fillStyle = colours.ink;
    g.lineWidth = 1;
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    for (let n = Math.ceil(low / step); n * step <= high; n++) {
      g.beginPath();
      g.moveTo(LEFT, y(n * step)), g.lineTo(width, y(n * step));
      g.stroke();
      g.textAlign = "right";
      g.fillText((n * step).toFixed(Math.min(digits, 6)), LEFT - 5, y(n * step));
    }
    const every = Drawing.roundLength((to - from) / 2.5);
    for (let n = Math.ceil(from / every); n * every <= to; n++) {
      g.textAlign = "center";
      g.fillText(`${Number((n * every).toFixed(3))} s`, Math.min(x(n * every), width - 16), height - 7);
    }
  }

  // A line with the least and the largest value of each pixel, so that no peak is lost; or dots.
  function drawSeries(g, of, from, to, x, y, colours) {
    const shift = shiftOf(of), [first, last] = span(of, from, to);
    const time = of.time(), left = (i) => x(time[i] + shift);
    if (of.band) drawBand(g, of, left, first, last, y, colours);
    g.strokeStyle = colours[of.colour];
    g.lineWidth = 1.5;
    g.beginPath();
    let column = null, low = 0, high = 0, pen = g.moveTo;
    const flush = () => {
      if (column === null) return;
      pen.call(g, column, y(low));
      pen = g.lineTo;
      if (high > low) g.lineTo(column, y(high));
    };
    for (let i = first; i <= last; i++) {
      const value = of.value(i);
      if (of.dots) {
        if (!Number.isFinite(value)) continue;
        g.fillStyle = colours[of.dots(i)];
        g.fillRect(left(i) - 1.5, Math.min(Math.max(y(value), TOP + 2), g.canvas.clientHeight - BOTTOM - 1) - 1.5, 3, 3);
        continue;
      }
      if (!Number.isFinite(value)) { flush(); column = null; pen = g.moveTo; continue; }
      const pixel = Math.round(left(i));
      if (pixel !== column) { flush(); column = pixel; low = high = value; }
      low = Math.min(low, value), high = Math.max(high, value);
    }
    flush();
    g.stroke();
  }

  function drawBand(g, of, left, first, last, y, colours) {
    g.fillStyle = colours.estimate;
    g.globalAlpha = 0.18;
    for (let i = first; i <= last; i++) {
      const half = of.band(i);
      if (!Number.isFinite(half)) continue;
      const right = i < last ? left(i + 1) : left(i) + 3;
      g.fillRect(left(i), y(half), Math.max(1, right - left(i)), y(-half) - y(half));
    }
    g.globalAlpha = 1;
  }

  // ---- Series of a run ----

  const DEGREES = 180 / Math.PI;
  const number = (value) => value ?? NaN;

  // Of what is known in each tick; `value(index)`.
  const ofTicks = (run, value) => ({ time: () => run.ticks.time, value });

  const verdict = (run) => ({
    ...ofTicks(run, (i) => number(run.ticks.verdict[i])),
    text: (i) => Moment.VERDICTS[run.ticks.verdict[i]] ?? Moment.unknown,
  });

  // The deviation of a column of the ticks, times a factor.
  const deviation = (run, column, factor) => ofTicks(run, (i) => factor * number(run.ticks[column][i]));

  // Empty where the last true pose is unknown.
  const ofTruth = (run, value) => ({
    time: () => ((run.ticks.truth.x.at(-1) ?? null) === null ? [] : run.ticks.time),
    value: (i) => ((run.ticks.truth.x[i] ?? null) === null ? NaN : value(run.ticks.truth, run.ticks.estimate, i)),
  });

  // Distance between the estimated and the true position, millimetres.
  const positionError = (run) => ofTruth(run, (truth, { x, y }, i) => 1e3 * Math.hypot(x[i] - truth.x[i], y[i] - truth.y[i]));

  // Estimated minus true heading, degrees.
  const headingError = (run) => ofTruth(run, (truth, { heading }, i) => DEGREES * Moment.wrap(heading[i] - truth.heading[i]));

  // Innovations in their 3σ band, millimetres.
  const innovation = (run) => ({
    time: () => run.fixes.time,
    value: (i) => 1e3 * number(run.fixes.innovation[i]),
    band: (i) => 3e3 * number(run.fixes.spread[i]),
    dots: (i) => Moment.OUTCOMES[run.fixes.outcome[i]],
    text: (i) => {
      const { innovation: length, wall, outcome } = Moment.fixNumbers(Moment.recordAt(run.fixes, i), 0, run.walls);
      return `${length}, ${wall}, ${outcome}`;
    },
  });

  return { curve, deviation, headingError, innovation, ofTicks, positionError, verdict };
})();
