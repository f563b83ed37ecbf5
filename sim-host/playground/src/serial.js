"use strict";
// The connection of the page to a robot on a serial port: the browser passes bytes, and WebAssembly has the state of the robot.

const Connection = (() => {
  const PERIOD = 20;                // ms between two looks at what is to be sent
  const NO_ROBOT = "no robot is connected: press Connect";

  const element = (id) => document.getElementById(id);
  const [connectButton, disconnectButton, baud, mapFile, robotFile, besideFile, wrong] =
    ["connect", "disconnect", "baud", "map-file", "robot-file", "beside-file", "wrong"].map(element);
  const files = [mapFile, robotFile, besideFile];
  const { serial: robot } = openSimulator(element("wasm").textContent);
  const serial = navigator.serial;  // none in a browser without Web Serial

  let chosen = null;                // the port that is to be open
  let reader = null, writer = null; // of the port, while it is open
  let take, say;                    // of the page
  const answers = new Map();        // what waits for the answer to an order, by its number
  let orders = 0;

  // ---- The state of the robot ----

  async function text(input) {
    const [file] = input.files;
    return file ? { name: file.name, text: await file.text() } : null;
  }

  // Begins with a robot of which nothing was received; whether its files are right.
  async function begin() {
    const [map, robotText, beside] = await Promise.all(files.map(text));
    const [first_sequence] = crypto.getRandomValues(new Uint16Array(1));
    const mistake = robot.connect({ commands: Boolean(serial), first_sequence: first_sequence >> 1, map, robot: robotText, beside });
    if (!beside) take({ kind: "beside", run: null });
    wrong.textContent = mistake;
    wrong.hidden = !mistake;
    pass();
    return !mistake;
  }

  // Passes the events since the last call on.
  function pass() {
    for (const event of robot.events()) {
      switch (event.kind) {
        case "reply": answers.get(event.number)?.(event.reply); answers.delete(event.number); break;
        case "log": save(event); break;
        default: take(event);
      }
    }
  }

  function save({ name, text: log }) {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([log])), download: name });
    link.click();
    URL.revokeObjectURL(link.href);
  }

  // Sends what is due.
  function send() {
    const bytes = robot.due(performance.now());
    // A port that is gone is noticed by its reader.
    if (bytes.length > 0) writer?.write(bytes).catch(() => {});
    pass();
  }

  async function order(body) {
    if (!writer && body.order !== "record") return { done: false, text: NO_ROBOT };
    const number = ++orders;
    const answer = new Promise((resolve) => { answers.set(number, resolve); });
    robot.order(number, body, performance.now());
    send();
    return answer;
  }

  // ---- The port ----

  function show(isOpen) {
    disconnectButton.disabled = !isOpen;
    for (const it of [connectButton, baud, ...files]) it.disabled = isOpen;
  }

  async function connect() {
    let port;
    try {
      port = await serial.requestPort();
    } catch (error) {
      return say(error.name === "NotFoundError" ? "no port was chosen" : error.message);
    }
    robot.order(0, { order: "record", on: false }, performance.now()); // nobody waits for this answer
    pass();
    if (await begin()) await open(port);
  }

  // Reads a port until it is unplugged or disconnected.
  async function open(port) {
    if (writer) return;
    try {
      await port.open({ baudRate: Number(baud.value) });
    } catch (error) {
      return say(`the port cannot be opened; is another program using it? ${error.message}`);
    }
    chosen = port;
    writer = port.writable.getWriter();
    show(true);
    say("connected");
    await read(port);
    writer.releaseLock();
    writer = null;
    await port.close().catch(() => {}); // an unplugged one is closed
    show(false);
    say(chosen ? "unplugged: plug the robot in again, or press Connect" : "disconnected");
  }

  // After an error of the line the port has another stream, and none after it was unplugged.
  async function read(port) {
    while (chosen && port.readable) {
      reader = port.readable.getReader();
      try {
        for (;;) {
          const { done, value } = await reader.read();
          if (done) return;
          robot.receive(value);
          send();
        }
      } catch {
        // As above.
      } finally {
        reader.releaseLock();
      }
    }
  }

  function disconnect() {
    chosen = null;
    reader.cancel();
  }

  // Opens the port again that was unplugged: the same device, which may be another object.
  function reopen({ target }) {
    const [old, plugged] = [chosen, target].map((port) => JSON.stringify(port?.getInfo?.()));
    if (chosen && old === plugged) open(target);
  }

  async function listen(takeEvent, sayState) {
    [take, say] = [takeEvent, sayState];
    element("unsupported").hidden = Boolean(serial);
    element("ports").hidden = !serial;
    say(serial ? "not connected" : "no serial ports");
    await begin();
    setInterval(send, PERIOD); // also without a port: a command that is not answered ends
    if (!serial) return;
    connectButton.addEventListener("click", connect);
    disconnectButton.addEventListener("click", disconnect);
    for (const input of files) input.addEventListener("change", begin);
    serial.addEventListener("connect", reopen);
  }

  return { listen, order };
})();
