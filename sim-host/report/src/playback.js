"use strict";
// The time of runs on a page: play and pause, speed, slider, keys, and the address, which may have a time and a view:
// report.html#time=612.5&view=8&exaggeration=100

const Playback = (() => {
  const FOLLOW = "8";          // the view that F follows with, metres across

  const element = (id) => document.getElementById(id);

  // What the menus of `view.html` show, for `Drawing.picture`.
  const settings = { view: () => element("view").value, exaggeration: () => element("exaggeration").value };

  // Opens the elements of `playback.html` in a section. `span()` gives the first and the last time, and `draw(time)` draws the pictures. A
  // change of the view of one picture changes the others as well; while `isBusy()`, dragging a picture does not move it. `keys` has further keys.
  function open(section, { span, draw, pictures, isBusy = () => false, keys = {} }) {
    const [scrub, play, speed, view, exaggeration] = ["scrub", "play", "speed", "view", "exaggeration"].map(element);
    const state = { time: span()[0], playing: false, lastFrame: 0 };

    function show() {
      draw(state.time);
      scrub.value = state.time;
      scrub.setAttribute("aria-valuetext", `${state.time.toFixed(1)} seconds`);
    }

    function goTo(time) {
      const [start, end] = span();
      state.time = Math.min(end, Math.max(start, time));
      show();
    }

    function setPlaying(playing) {
      const [start, end] = span();
      state.playing = playing;
      play.textContent = playing ? "Pause" : "Play";
      if (!playing) { show(); return; }
      if (state.time >= end) state.time = start;
      state.lastFrame = performance.now();
      requestAnimationFrame(frame);
    }

    function frame(now) {
      if (!state.playing) return;
      goTo(state.time + Math.max(0, now - state.lastFrame) / 1000 * Number(speed.value));
      state.lastFrame = now;
      if (state.time >= span()[1]) setPlaying(false); else requestAnimationFrame(frame);
    }

    // Shows all pictures as one of them is shown.
    function follow(picture) {
      pictures.forEach((other) => other.setZoom(picture.zoom()));
      show();
    }

    function each(change) {
      pictures.forEach(change);
      show();
    }

    const KEYS = {
      " ": () => setPlaying(!state.playing),
      ArrowLeft: (event) => goTo(state.time - (event.shiftKey ? 10 : 1)),
      ArrowRight: (event) => goTo(state.time + (event.shiftKey ? 10 : 1)),
      Home: () => goTo(span()[0]),
      End: () => goTo(span()[1]),
      "+": () => each((picture) => picture.zoomBy(Drawing.ZOOM_STEP)),
      "-": () => each((picture) => picture.zoomBy(1 / Drawing.ZOOM_STEP)),
      0: () => each((picture) => picture.resetView()),
      f: () => { view.value = view.value === "map" ? FOLLOW : "map"; show(); },
      ...keys,
    };

    function onKey(event) {
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      // Buttons and menus use these keys themselves; the slider acts like the picture.
      if (!KEYS[key] || ["BUTTON", "SELECT"].includes(event.target.tagName) || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      KEYS[key](event);
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

    // The runs have other times, or the colours have changed.
    function refresh() {
      const [min, max] = span();
      Object.assign(scrub, { min, max });
      pictures.forEach((picture) => picture.refresh());
      goTo(state.time);
    }

    function save() {
      pictures.forEach((picture, n) => picture.save(pictures.length > 1 ? `sonarfix-${n + 1}.png` : "sonarfix.png"));
    }

    section.hidden = false;
    refresh();
    readAddress();
    section.addEventListener("keydown", onKey);
    scrub.addEventListener("input", () => goTo(Number(scrub.value)));
    play.addEventListener("click", () => setPlaying(!state.playing));
    for (const menu of [view, exaggeration]) menu.addEventListener("change", show);
    element("save-picture").addEventListener("click", save);
    pictures.forEach((picture) => picture.navigate(() => follow(picture), isBusy));
    window.addEventListener("hashchange", readAddress);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
    const sizes = new ResizeObserver(show);
    pictures.forEach(({ canvas }) => sizes.observe(canvas));
    document.documentElement.dataset.ready = "true";
    return { goTo, refresh, setPlaying, show, state };
  }

  return { open, settings };
})();
