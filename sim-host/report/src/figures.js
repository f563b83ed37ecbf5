"use strict";
// Values, zoom and pan of the figures. An SVG has its plot and axes as data attributes (`chart.rs`); the points of its curves are moved, so that
// lines and letters keep their size.

// Opens the figures; `goTo(time)` is called by a double click in a figure over time.
const openFigures = (goTo) => {
  const STEP = 1.5;
  const MOST = 1e4;            // the largest magnification
  const DOT = 16;              // drawn pixels from the pointer at which a dot has a value
  const SVG = "http://www.w3.org/2000/svg";

  const axisOf = (text) => {
    const [start, end, kind, ...label] = text.split(" ");
    const [name, names] = kind.split(":");
    return { start: Number(start), end: Number(end), kind: name, names: names?.split(","), label: label.join(" ") };
  };

  const valueOf = (axis, place) => (axis.kind === "logarithmic" ? 10 ** place : place);

  function textOf(axis, place) {
    if (axis.kind === "named") return axis.names[Math.round(place)] ?? "";
    const value = valueOf(axis, place);
    return String(Number(value.toPrecision(4))).replace("-", "−");
  }

  // 1, 2 and 5 times the powers of ten between two logarithms; of many decades the powers alone.
  function decadesOf(from, to) {
    const steps = to - from > 2.5 ? [1] : [1, 2, 5];
    const decades = Array.from({ length: Math.ceil(to) - Math.floor(from) + 1 }, (_, n) => Math.floor(from) + n);
    return decades.flatMap((decade) => steps.map((step) => decade + Math.log10(step))).filter((tick) => tick >= from && tick <= to);
  }

  // Round places on a part of an axis.
  function ticksOf(axis, [from, to], most) {
    if (axis.kind === "named") return axis.names.map((_, n) => n).filter((n) => n >= from && n <= to);
    if (axis.kind === "logarithmic") return decadesOf(from, to);
    const rough = (to - from) / most, decade = 10 ** Math.floor(Math.log10(rough));
    const step = decade * ([1, 2, 5].find((n) => n * decade >= rough) ?? 10);
    const ticks = [];
    for (let n = Math.ceil(from / step); n * step <= to && ticks.length < 50; n++) ticks.push(n * step);
    return ticks;
  }

  const pointsOf = (of) => of.getAttribute("points").trim().split(/\s+/).map((pair) => pair.split(",").map(Number));

  function open(svg, output) {
    const [left, top, width, height] = svg.dataset.plot.split(" ").map(Number);
    const axes = [axisOf(svg.dataset.x), axisOf(svg.dataset.y)];
    const isOverTime = axes[0].label.startsWith("time");
    const curves = svg.querySelector(".curves"), frame = svg.querySelector(".axes");
    const lines = [...curves.querySelectorAll("polyline, polygon")].map((of) => ({ of, points: pointsOf(of), drawn: of.getAttribute("points") }));
    const dots = [...curves.querySelectorAll("circle")].map((of) => ({ of, at: [Number(of.getAttribute("cx")), Number(of.getAttribute("cy"))] }));
    const legend = svg.dataset.legend.split("\t").map((entry) => [entry.slice(0, 7), entry.slice(8)]);
    const full = axes.map(({ start, end }) => [start, end]);
    let view = full;
    let ticks = null, cursor = null, dragged = null;

    // Places on the axes to pixels of the view, and back.
    const toPixel = ([x, y], [across, up] = view) => [
      left + (x - across[0]) / (across[1] - across[0]) * width,
      top + (up[1] - y) / (up[1] - up[0]) * height,
    ];
    const toPlace = ([x, y], [across, up] = view) => [
      across[0] + (x - left) / width * (across[1] - across[0]),
      up[1] - (y - top) / height * (up[1] - up[0]),
    ];

    function make(name, attributes, parent) {
      const made = document.createElementNS(SVG, name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
      parent.append(made);
      return made;
    }

    const clip = make("clipPath", { id: `plot-${Math.random().toString(36).slice(2)}` }, svg);
    make("rect", { x: left, y: top, width, height }, clip);

    const isZoomed = () => view !== full;

    function show() {
      const moved = (point) => toPixel(toPlace(point, full));
      for (const { of, points, drawn } of lines) {
        of.setAttribute("points", isZoomed() ? points.map((point) => moved(point).join()).join(" ") : drawn);
      }
      for (const { of, at } of dots) {
        const [x, y] = moved(at);
        of.setAttribute("cx", x), of.setAttribute("cy", y);
      }
      curves.setAttribute("clip-path", `url(#${clip.id})`);
      showTicks();
    }

    // The axes as they were drawn, or for the part in view.
    function showTicks() {
      ticks?.remove();
      const labels = axes.map(({ label }) => label);
      for (const child of frame.children) {
        child.style.visibility = isZoomed() && !labels.includes(child.textContent.trim()) ? "hidden" : "";
      }
      if (!isZoomed()) return;
      ticks = make("g", { "font-family": "sans-serif", "font-size": frame.querySelector("text").getAttribute("font-size") }, svg);
      svg.insertBefore(ticks, curves);
      make("rect", { x: left, y: top, width, height, class: "frame" }, ticks);
      const narrow = Number(svg.getAttribute("width")) < 500;
      for (const place of ticksOf(axes[0], view[0], narrow ? 4 : 8)) {
        const [x] = toPixel([place, 0]);
        make("line", { x1: x, x2: x, y1: top, y2: top + height, class: "tick" }, ticks);
        make("text", { x, y: top + height + 60, "text-anchor": "middle" }, ticks).textContent = textOf(axes[0], place);
      }
      for (const place of ticksOf(axes[1], view[1], 6)) {
        const [, y] = toPixel([0, place]);
        make("line", { x1: left, x2: left + width, y1: y, y2: y, class: "tick" }, ticks);
        make("text", { x: left - 28, y: y + 18, "text-anchor": "end" }, ticks).textContent = textOf(axes[1], place);
      }
    }

    // Magnifies about a pixel; over time the vertical axis stays as it is.
    function zoom(factor, pixel = [left + width / 2, top + height / 2]) {
      const at = toPlace(pixel);
      view = view.map(([from, to], axis) => {
        if (isOverTime && axis === 1) return [from, to];
        const [least, most] = full[axis];
        const length = Math.min(most - least, Math.max((to - from) / factor, (most - least) / MOST));
        const start = at[axis] - (at[axis] - from) * length / (to - from);
        const kept = Math.min(most - length, Math.max(least, start));
        return [kept, kept + length];
      });
      if (view.every(([from, to], axis) => to - from >= (full[axis][1] - full[axis][0]) * 0.999)) view = full;
      show();
    }

    function pan(pixels) {
      view = view.map(([from, to], axis) => {
        const by = axis === 0 ? -pixels[0] / width * (to - from) : pixels[1] / height * (to - from);
        const [least, most] = full[axis];
        const kept = Math.min(most - (to - from), Math.max(least, from + by));
        return [kept, kept + to - from];
      });
      show();
    }

    function reset() {
      view = full;
      show();
    }

    // The pixel of the figure under the pointer.
    function pixelOf(event) {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [point.x, point.y];
    }

    // The point of a curve at a pixel across: the last of its lines that is not to the right of it, or a dot nearby.
    function pointAt(colour, x) {
      let best = null;
      for (const { of, points } of lines) {
        if (of.tagName !== "polyline" || of.getAttribute("stroke") !== colour) continue;
        const isDot = points.length === 2 && points[0].join() === points[1].join();
        if (isDot && Math.abs(points[0][0] - x) > DOT) continue;
        const index = isDot ? 0 : points.findLastIndex((point) => point[0] <= x);
        if (index >= 0 && (best === null || points[index][0] >= best[0])) best = points[index];
      }
      return best;
    }

    // The values at a place, as text, and a line there.
    function showValues(pixel) {
      const inside = pixel[0] >= left && pixel[0] <= left + width && pixel[1] >= top && pixel[1] <= top + height;
      cursor?.remove();
      cursor = null;
      output.textContent = "";
      if (!inside) return;
      const place = toPlace(pixel);
      const texts = [`${axes[0].label}: ${textOf(axes[0], place[0])}`];
      if (isOverTime) {
        cursor = make("line", { x1: pixel[0], x2: pixel[0], y1: top, y2: top + height, class: "cursor" }, svg);
        const [x] = toPixel([place[0], 0], full);
        for (const [colour, label] of legend) {
          const found = pointAt(colour, x);
          if (found) texts.push(`${label}: ${textOf(axes[1], toPlace(found, full)[1])}`);
        }
      } else {
        texts.push(`${axes[1].label}: ${textOf(axes[1], place[1])}`);
      }
      output.textContent = texts.join(" · ");
    }

    svg.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== svg) return;
      event.preventDefault();
      zoom(event.deltaY < 0 ? STEP : 1 / STEP, pixelOf(event));
    }, { passive: false });
    svg.addEventListener("pointerdown", (event) => {
      dragged = isZoomed() ? pixelOf(event) : null;
      showValues(pixelOf(event));
    });
    svg.addEventListener("pointermove", (event) => {
      const pixel = pixelOf(event);
      if (dragged && event.buttons) {
        pan([pixel[0] - dragged[0], pixel[1] - dragged[1]]);
        dragged = pixel;
      }
      showValues(pixel);
    });
    svg.addEventListener("pointerup", () => { dragged = null; });
    svg.addEventListener("pointerleave", () => { dragged = null; showValues([-1, -1]); });
    svg.addEventListener("dblclick", (event) => { if (isOverTime) goTo(toPlace(pixelOf(event))[0]); });
    const KEYS = {
      "+": () => zoom(STEP), "-": () => zoom(1 / STEP), 0: reset,
      ArrowLeft: () => pan([width / 8, 0]), ArrowRight: () => pan([-width / 8, 0]),
      ArrowUp: () => pan([0, height / 8]), ArrowDown: () => pan([0, -height / 8]),
    };
    svg.tabIndex = 0;
    svg.addEventListener("keydown", (event) => {
      const isArrow = event.key.startsWith("Arrow");
      if (!KEYS[event.key] || event.ctrlKey || event.metaKey || (isArrow && !isZoomed())) return;
      event.preventDefault();
      KEYS[event.key]();
    });
    return { zoom, reset };
  }

  // Buttons for both widths of a figure; the one that is not visible follows.
  for (const figure of document.querySelectorAll("figure")) {
    const output = figure.querySelector("output");
    const opened = [...figure.querySelectorAll("svg[data-plot]")].map((svg) => open(svg, output));
    const buttons = document.createElement("div");
    buttons.className = "zoom";
    const acts = [
      ["+", "Magnify", (of) => of.zoom(STEP)], ["−", "Reduce", (of) => of.zoom(1 / STEP)], ["All", "Show all", (of) => of.reset()],
    ];
    for (const [text, name, act] of acts) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: text, title: name });
      button.setAttribute("aria-label", `${name}: ${figure.querySelector("svg").getAttribute("aria-label")}`);
      button.addEventListener("click", () => opened.forEach(act));
      buttons.append(button);
    }
    output.after(buttons);
  }
};
