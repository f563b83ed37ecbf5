"use strict";
// Plays a run: its picture, its bar of measurement cycles and its numbers.

// Opens the player on a run. `overlay(g)` draws over the picture; while `isBusy()`, dragging the picture does not move it.
const openPlayer = (data, { overlay = () => {}, isBusy = () => false } = {}) => {
  Moment.complete(data);
  const [section, stage, bar] = ["player", "stage", "strip"].map((id) => document.getElementById(id));
  const readout = Moment.readout(document.getElementById("readout"));
  const picture = Drawing.picture(stage, data, Playback.settings);
  const strip = Strip.open(bar, data, picture, (time) => playback.goTo(time));
  const span = () => [data.ticks.time[0], data.ticks.time.at(-1)];

  // Plays another run from the same time on.
  function replace(run) {
    Object.assign(data, Moment.complete(run));
    strip.refresh();
    playback.refresh();
  }

  function draw(time) {
    const moment = Moment.momentAt(data, time);
    picture.draw(moment);
    overlay(stage.getContext("2d"), moment);
    strip.draw(time, span());
    const times = `${time.toFixed(1)} s of ${span()[1].toFixed(1)} s`;
    Moment.show(readout, { time: times, ...Moment.numbers(moment, data) }, moment.fix);
  }

  // To the next (or, with −1, the previous) measurement cycle that did not correct the filter.
  function goToTrouble(direction) {
    const times = data.fixes.time.filter((_, index) => data.fixes.outcome[index] !== 0);
    const time = direction > 0
      ? times.find((other) => other > playback.state.time)
      : times.findLast((other) => other < playback.state.time);
    if (time !== undefined) playback.goTo(time);
  }

  const keys = { ArrowUp: () => goToTrouble(-1), ArrowDown: () => goToTrouble(1) };
  const playback = Playback.open(section, { span, draw, pictures: [picture], isBusy, keys });
  const { goTo, setPlaying, show, state } = playback;
  return { data, draw: show, goTo, picture, replace, setPlaying, state };
};
