"use strict";
// Curves over time on canvases. A curve has series of columns, of which it draws the last seconds; the pointer reads a value.

const Curves = (() => {
  const LEFT = 46, BOTTOM = 16, TOP = 4;   // pixels beside the plot

  // Indices of the points of a time span.
  function span(time, from, to) {
    return [Math.max(0, Moment.lastBefore(time, from)), Moment.lastBefore(time, to)];
  }

  // A curve in a container. `series` are { name, colour, time: () => column, value: (index) => number, dots, band, text }; what the
  // pointer reads is `text(index)`, or else the value.
  function curve(container, title, series, unit) {
    const figure = document.createElement("figure");
    figure.className = "curve panel";
    const caption = document.createElement("figcaption");
    caption.append(Object.assign(document.createElement("b"), { textContent: title }));
    const values = series.map(({ name, colour }) => {
      const item = document.createElement("span");
      item.style.setProperty("--of", `var(--${colour})`);
      const value = document.createElement("span");
      item.append(document.createElement("i"), `${name} `, value);
      caption.append(item);
      return value;
    });
    const canvas = Object.assign(document.createElement("canvas"), { tabIndex: 0 });
    canvas.setAttribute("role", "img");
    figure.append(caption, canvas);
    container.append(figure);
    let pointer = null;
    canvas.addEventListener("pointermove", (event) => { pointer = event.offsetX; });
    canvas.addEventListener("pointerleave", () => { pointer = null; });

    function draw(from, to, colours) {
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
      const at = pointer === null ? to : from + (pointer - LEFT) / (width - LEFT - 4) * (to - from);
      if (pointer !== null) {
        g.fillStyle = colours.ink;
        g.fillRect(x(at), TOP, 1, height - TOP - BOTTOM);
      }
      showValues(at);
    }

    function showValues(at) {
      const texts = series.map((of, index) => {
        const found = Moment.lastBefore(of.time(), at);
        const value = found < 0 ? null : of.value(found);
        const number = Number.isFinite(value) ? `${value.toPrecision(3)} ${unit}` : Moment.unknown;
        const text = (found >= 0 && of.text ? of.text(found) : number).replace(/^-/, "−");
        values[index].textContent = text;
        return `${of.name} ${text}`;
      });
      canvas.setAttribute("aria-label", `${title}: ${texts.join(", ")}`);
    }

    function extent(from, to) {
      let low = Infinity, high = -Infinity;
      for (const of of series) {
        const [first, last] = span(of.time(), from, to);
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
    const time = of.time(), [first, last] = span(time, from, to);
    if (of.band) drawBand(g, of, time, first, last, x, y, colours);
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
        g.fillRect(x(time[i]) - 1.5, Math.min(Math.max(y(value), TOP + 2), g.canvas.clientHeight - BOTTOM - 1) - 1.5, 3, 3);
        continue;
      }
      if (!Number.isFinite(value)) { flush(); column = null; pen = g.moveTo; continue; }
      const pixel = Math.round(x(time[i]));
      if (pixel !== column) { flush(); column = pixel; low = high = value; }
      low = Math.min(low, value), high = Math.max(high, value);
    }
    flush();
    g.stroke();
  }

  function drawBand(g, of, time, first, last, x, y, colours) {
    g.fillStyle = colours.estimate;
    g.globalAlpha = 0.18;
    for (let i = first; i <= last; i++) {
      const half = of.band(i);
      if (!Number.isFinite(half)) continue;
      const right = i < last ? x(time[i + 1]) : x(time[i]) + 3;
      g.fillRect(x(time[i]), y(half), Math.max(1, right - x(time[i])), y(-half) - y(half));
    }
    g.globalAlpha = 1;
  }

  return { curve };
})();
