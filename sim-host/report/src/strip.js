"use strict";
// Every measurement cycle of a run in a bar over time.

const Strip = (() => {
  const { OUTCOMES } = Moment;

  // A bar on a canvas with the colours of the run's picture; a click calls `goTo(time)`. The run may be replaced.
  function open(canvas, data, picture, goTo) {
    // The cycles do not change: they are painted once for a width, a span and a scheme, and the time over them.
    const cycles = { canvas: document.createElement("canvas"), key: null };
    let shown = [0, 0];        // first and last time

    const across = (time, width) => (shown[1] > shown[0] ? (time - shown[0]) / (shown[1] - shown[0]) * width : 0);

    function draw(time, span) {
      shown = span;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      const { ink } = picture.colours();
      const key = [width, height, ...span, window.devicePixelRatio, ink].join();
      if (cycles.key !== key) paint(width, height);
      cycles.key = key;
      const { g } = Drawing.prepare(canvas);
      g.clearRect(0, 0, width, height);
      if (width > 0 && height > 0) g.drawImage(cycles.canvas, 0, 0, width, height);
      g.fillStyle = ink;
      g.fillRect(across(time, width) - 1, 0, 2, height);
    }

    // Those that did not correct the filter are few: they are drawn last and taller, so that none is hidden.
    function paint(width, height) {
      const { g } = Drawing.prepare(cycles.canvas, width, height);
      const colours = picture.colours();
      g.fillStyle = colours.paper;
      g.fillRect(0, 0, width, height);
      OUTCOMES.forEach((name, outcome) => {
        g.fillStyle = colours[name];
        const top = outcome === 0 ? height / 2 : 0;
        data.fixes.time.forEach((time, index) => {
          if (data.fixes.outcome[index] === outcome) g.fillRect(across(time, width) - 0.75, top, 1.5, height - top);
        });
      });
      // When the robot has no pose, and the moments of decision.
      g.fillStyle = colours.estimate;
      data.searches.forEach((search, index) => {
        const isDecision = search.provisional && !(data.searches[index - 1]?.provisional);
        if (!search.provisional) g.fillRect(across(search.time, width) - 0.75, 0, 1.5, 4);
        if (isDecision) g.fillRect(across(search.time, width) - 1.5, 0, 3, height);
      });
    }

    canvas.addEventListener("click", (event) => goTo(shown[0] + event.offsetX / canvas.clientWidth * (shown[1] - shown[0])));
    return { draw, refresh: () => { cycles.key = null; } };
  }

  return { open };
})();
