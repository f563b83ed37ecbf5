"use strict";
// What can be dragged in a scenario: handles with a place on the floor, and a function that moves the thing there.

const Handles = (() => {
  const TOUCH = 1e-6; // metres: corners that are the same point move together

  const isSame = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]) < TOUCH;
  const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  const plus = (a, by) => [a[0] + by[0], a[1] + by[1]];
  // Whole millimetres: a file with these numbers is the same scenario.
  const rounded = (point) => point.map((metres) => Math.round(metres * 1000) / 1000);

  // Puts every place of a list that is a point elsewhere. A place is an object and its key.
  const shift = (places, from, to) => places.filter(([of, key]) => isSame(of[key], from)).forEach(([of, key]) => { of[key] = rounded(to); });

  const wallEnds = (scenario) => scenario.map.wall.flatMap((wall) => [[wall, "from"], [wall, "to"]]);
  const pathPoints = ({ path }) => [[path, "start"], ...path.corners.map((_, index) => [path.corners, index])];

  function distinct(places) {
    const seen = [];
    return places.filter(([of, key]) => {
      if (seen.some((point) => isSame(point, of[key]))) return false;
      seen.push(of[key]);
      return true;
    });
  }

  // The points of a list of places that are one point, as one handle each.
  function corners(places, kind, name) {
    return distinct(places).map(([of, key], index) => {
      const from = of[key];
      return { kind, name: `${name} ${index + 1}`, at: from, move: (to) => shift(places, from, to) };
    });
  }

  function walls(scenario) {
    return scenario.map.wall.map((wall) => {
      const { from, to } = wall, at = middle(from, to);
      const move = (place) => {
        const by = [place[0] - at[0], place[1] - at[1]];
        shift(wallEnds(scenario), from, plus(from, by));
        shift(wallEnds(scenario), to, plus(to, by));
      };
      const list = scenario.map.wall;
      const remove = list.length > 1 ? () => list.splice(list.indexOf(wall), 1) : undefined;
      return { kind: "wall", name: `wall ${wall.name}`, at, move, remove };
    });
  }

  function obstacles(scenario) {
    const list = scenario.world.obstacle ?? [];
    return list.flatMap((obstacle, index) => {
      const remove = () => list.splice(index, 1);
      const name = `object ${index + 1}`;
      if (obstacle.centre) {
        return [{ kind: "object", name, at: obstacle.centre, move: (to) => { obstacle.centre = rounded(to); }, remove }];
      }
      const { from, to } = obstacle, at = middle(from, to);
      const whole = (place) => {
        const by = [place[0] - at[0], place[1] - at[1]];
        Object.assign(obstacle, { from: rounded(plus(from, by)), to: rounded(plus(to, by)) });
      };
      return [
        { kind: "object", name, at, move: whole, remove },
        { kind: "end", name: `${name}, one end`, at: from, move: (place) => { obstacle.from = rounded(place); }, remove },
        { kind: "end", name: `${name}, other end`, at: to, move: (place) => { obstacle.to = rounded(place); }, remove },
      ];
    });
  }

  // All handles of a scenario, without the robot.
  function of(scenario) {
    return [
      ...corners(pathPoints(scenario), "path", "corner of the path"),
      ...obstacles(scenario),
      ...corners(wallEnds(scenario), "corner", "corner of walls"),
      ...walls(scenario),
    ];
  }

  return { of, rounded };
})();
