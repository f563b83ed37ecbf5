"use strict";
// What the pages compute in WebAssembly: plain functions, texts in UTF-8 in its memory.

// The bytes of a text in base64.
const decoded = (base64) => Uint8Array.from(atob(base64.trim()), (letter) => letter.charCodeAt(0));

const openSimulator = (base64) => {
  const module = new WebAssembly.Module(decoded(base64));
  const start = () => new WebAssembly.Instance(module, {}).exports;
  let wasm = start();

  const bytesOf = (length) => new Uint8Array(wasm.memory.buffer, wasm.answer(), length).slice();
  const answer = (length) => new TextDecoder().decode(bytesOf(length));

  // Copies bytes into the room that a function makes for them.
  function put(bytes, room) {
    const address = room(bytes.length); // may move the memory
    new Uint8Array(wasm.memory.buffer, address, bytes.length).set(bytes);
  }

  const write = (request) => put(new TextEncoder().encode(JSON.stringify(request)), wasm.request);

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

  // The map in the bytes of a file, or an error.
  function ownMap(options, bytes) {
    try {
      put(bytes, wasm.drawing);
      write(options);
      return JSON.parse(answer(wasm.own_map()));
    } catch (failure) {
      wasm = start();
      return { error: `the file cannot be read: ${failure.message}` };
    }
  }

  // The map of a request as a map file, TOML, or an error.
  function mapFile(request) {
    write(request);
    return JSON.parse(answer(wasm.map_file()));
  }

  // The questions of a new robot.
  const questions = () => JSON.parse(answer(wasm.questions()));

  // The program for the UF2 of a new robot; no bytes are none.
  const setProgram = (bytes) => put(bytes, wasm.program);

  // The files of a new robot with the warnings about them, or an error.
  function robot(answers) {
    write(answers);
    return JSON.parse(answer(wasm.robot()));
  }

  // The files of a new robot as an archive; empty if there are none.
  function zip(answers) {
    write(answers);
    return bytesOf(wasm.zip());
  }

  // The parts of the flash of a robot, whose files may be in an archive, with the warnings about them, or an error.
  function flashParts(request, archive) {
    put(archive, wasm.drawing);
    write(request);
    return JSON.parse(answer(wasm.parts()));
  }

  // The bytes of such a part.
  const flashPart = (index) => bytesOf(wasm.part(index));

  // The MD5 of some bytes, in hexadecimal digits.
  function md5(bytes) {
    put(bytes, wasm.request);
    return answer(wasm.md5());
  }

  // A robot on a serial port, of which nothing was received; what is wrong with the request, or nothing.
  function connect(request) {
    write(request);
    return answer(wasm.connect());
  }

  // Bytes that it has sent.
  function receive(bytes) {
    put(bytes, wasm.request);
    wasm.receive();
  }

  // An order with a number, at a time in milliseconds.
  function order(number, body, time) {
    write(body);
    wasm.order(number, time);
  }

  // The bytes to send to it now.
  const due = (time) => bytesOf(wasm.due(time));

  // The events since the last call.
  const events = () => answer(wasm.events()).split("\n").filter((line) => line !== "").map((line) => JSON.parse(line));

  return { scenes, run, file, ownMap, mapFile, questions, setProgram, robot, zip, flashParts, flashPart, md5, serial: { connect, receive, order, due, events } };
};
