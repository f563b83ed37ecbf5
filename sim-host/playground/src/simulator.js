"use strict";
// The simulator in WebAssembly: plain functions, texts in UTF-8 in its memory.

const openSimulator = (base64) => {
  const module = new WebAssembly.Module(Uint8Array.from(atob(base64.trim()), (letter) => letter.charCodeAt(0)));
  const start = () => new WebAssembly.Instance(module, {}).exports;
  let wasm = start();

  const answer = (length) => new TextDecoder().decode(new Uint8Array(wasm.memory.buffer, wasm.answer(), length));

  function write(request) {
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    const address = wasm.request(bytes.length); // may move the memory
    new Uint8Array(wasm.memory.buffer, address, bytes.length).set(bytes);
  }

  // The scenes of the tour.
  const scenes = () => JSON.parse(answer(wasm.scenes()));

  // The run of a request, or an error.
  function run(request) {
    try {
      write(request);
      return JSON.parse(answer(wasm.run()));
    } catch (failure) {
      wasm = start(); // its memory may be inconsistent
      return { error: `the simulator stopped: ${failure.message}` };
    }
  }

  // The scenario of a request as a scenario file, TOML.
  function file(request) {
    write(request);
    return answer(wasm.file());
  }

  return { scenes, run, file };
};
