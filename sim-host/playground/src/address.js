"use strict";
// The scene and every change of it in the address of the page: #scene=drift&scenario.robot.sonar.max_range=3.5+m&seed=2

const Address = (() => {
  // The values of nested tables by their paths; an array is one value.
  function leaves(value, path = "", found = new Map()) {
    const isTable = value !== null && typeof value === "object" && !Array.isArray(value);
    if (!isTable) return found.set(path, value);
    for (const [key, part] of Object.entries(value)) leaves(part, path ? `${path}.${key}` : key, found);
    return found;
  }

  const text = (value) => (typeof value === "string" ? value : JSON.stringify(value));

  function parsed(written, usual) {
    if (typeof usual === "string") return written;
    try { return JSON.parse(written); } catch { return written; }
  }

  function put(request, path, value) {
    const names = path.split("."), last = names.pop();
    const table = names.reduce((of, name) => {
      if (!Object.hasOwn(of, name) || Object(of[name]) !== of[name]) of[name] = {};
      return of[name];
    }, request);
    table[last] = value;
  }

  // The address of a request: its scene, and what differs from it.
  function write(scene, request) {
    const usual = leaves(scene.request);
    const changes = [...leaves(request)].filter(([path, value]) => text(value) !== text(usual.get(path)));
    return `#${new URLSearchParams([["scene", scene.name], ...changes.map(([path, value]) => [path, text(value)])])}`;
  }

  // The scene and the request of an address; the first scene without one. Other parts of the address, as those of the player, are ignored.
  function read(address, scenes) {
    const wanted = new URLSearchParams(address.slice(1));
    const scene = scenes.find(({ name }) => name === wanted.get("scene")) ?? scenes[0];
    const request = structuredClone(scene.request), usual = leaves(scene.request);
    for (const [path, written] of wanted) {
      if (usual.has(path) || path.startsWith("scenario.")) put(request, path, parsed(written, usual.get(path)));
    }
    return { scene, request };
  }

  return { read, write };
})();
