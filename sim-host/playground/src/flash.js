"use strict";
// An ESP32-C6 on a serial port of the browser: the files of a robot become parts of its flash (WebAssembly), and esptool-js writes them.

const flashing = (() => {
  const CHIP = "ESP32-C6";
  const BAUD = 115200;          // that of the boot ROM after a reset
  // Starts the program: IO9 stays high (DTR off), EN is low (RTS on) for 100 ms. `hard_reset` of esptool-js only ends such a reset.
  const START = "D0|R1|W100|R0";
  const PATIENCE = 1000;        // ms: a port that was unplugged does not close
  const WRITING = "writing …";

  const element = (id) => document.getElementById(id);
  const simulator = openSimulator(element("wasm").textContent);
  const serial = navigator.serial; // none in a browser without Web Serial
  const [robotInput, programInput, button, progress] = ["robot-files", "program", "flash", "progress"].map(element);

  // What the page has for every robot: bootloader and table of partitions, and, of a release, the program.
  const ofPage = [...document.querySelectorAll("[data-address]")].map(({ dataset, textContent }) =>
    ({ what: dataset.what, address: Number(dataset.address), bytes: decoded(textContent) }));
  const released = element("program-esp32c6")?.textContent;

  let parts = [];               // in the order in which they are written
  let isBusy = false;

  const sleep = (time) => new Promise((resolve) => { setTimeout(resolve, time); });

  // ---- The files ----

  async function read() {
    const chosen = [...robotInput.files], [program] = programInput.files;
    const archive = chosen.find(({ name }) => name.toLowerCase().endsWith(".zip"));
    const texts = chosen.filter((file) => file !== archive);
    const files = await Promise.all(texts.map(async (file) => ({ name: file.name, text: await file.text() })));
    simulator.setProgram(program ? new Uint8Array(await program.arrayBuffer()) : decoded(released ?? ""));
    const archived = new Uint8Array(archive ? await archive.arrayBuffer() : []);
    show(simulator.flashParts({ files, program: program?.name ?? "the released program" }, archived));
  }

  // The parts, or the mistake in the files.
  function show({ error, option, parts: ofRobot = [], warnings = [] }) {
    const hasRobot = robotInput.files.length > 0, hasProgram = programInput.files.length > 0 || Boolean(released);
    element("wrong").textContent = hasRobot && error ? error : "";
    element("wrong").hidden = !(hasRobot && error);
    robotInput.setAttribute("aria-invalid", hasRobot && option === "robot");
    programInput.setAttribute("aria-invalid", hasRobot && option === "program");
    element("warnings").replaceChildren(...warnings.map(({ key, message }) => paragraph(`${key}: ${message}`)));
    // As `espflash` does it, the program last: the board starts with it.
    const all = ofRobot.map((part, index) => ({ ...part, bytes: simulator.flashPart(index) }));
    parts = [...all.slice(0, 2), ...ofPage, ...all.slice(2)];
    element("written").hidden = all.length === 0;
    element("parts").replaceChildren(...parts.map(row));
    button.disabled = all.length < 3;
    element("next").hidden = true;
    if (error && hasRobot) return say("");
    if (!hasRobot) return say("Choose the files of the robot first.");
    say(hasProgram ? "Everything is ready to be written." : "Choose the program of the board, too.");
  }

  function paragraph(text) {
    const line = document.createElement("p");
    line.textContent = text;
    return line;
  }

  function row({ what, address, bytes, checksum }) {
    const line = document.createElement("tr"), name = document.createElement("th");
    name.scope = "row";
    name.textContent = what.replace(/^the /, "");
    if (checksum) name.append(Object.assign(document.createElement("small"), { textContent: `checksum ${checksum}` }));
    const cells = [`0x${address.toString(16).padStart(8, "0")}`, bytes.length.toLocaleString("en"), "–"];
    line.append(name, ...cells.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
    return line;
  }

  const stateOf = (index, text) => { element("parts").rows[index].cells[3].textContent = text; };

  // ---- The board ----

  function say(text) { element("state").textContent = text; }

  function note(text) {
    const log = element("messages");
    log.textContent += text;
    log.scrollTop = log.scrollHeight;
  }
  const terminal = { clean() {}, write: note, writeLine(line) { note(`${line}\n`); } };

  // esptool-js, a module. A page from a disk may not import a file, but a module that it has in itself.
  function library() {
    const address = URL.createObjectURL(new Blob([decoded(element("esptool").textContent)], { type: "text/javascript" }));
    return import(address).finally(() => URL.revokeObjectURL(address));
  }

  // What the page itself refuses, and a port that is gone.
  class Refusal extends Error {}
  class Lost extends Error {}

  // Connects to the boot ROM, and names the chip.
  async function connect(loader, { CustomReset }, transport) {
    say("Connecting …");
    await loader.detectChip();
    const found = loader.chip.CHIP_NAME;
    if (found !== CHIP) {
      await new CustomReset(transport, START).reset();
      throw new Refusal(`The board has an ${found} and not an ${CHIP}. Nothing was written.`);
    }
    if (loader.secureDownloadMode) {
      throw new Refusal("The chip is in secure download mode: this page cannot write to it. Nothing was written.");
    }
    const name = await loader.chip.getChipDescription(loader);
    say(`Found an ${name}. The loader is sent to it …`);
    await loader.runStub();
    return name;
  }

  // Writes and compares the parts, one after the other.
  async function write(loader, name) {
    const total = parts.reduce((sum, { bytes }) => sum + bytes.length, 0);
    let before = 0;
    progress.value = 0;
    progress.hidden = false;
    for (const [index, { what, address, bytes }] of parts.entries()) {
      say(`Found an ${name}. Writing ${what} …`);
      stateOf(index, WRITING);
      await loader.writeFlash({
        fileArray: [{ data: bytes, address }],
        flashMode: "keep", flashFreq: "keep", flashSize: "keep",
        eraseAll: false, compress: true,
        reportProgress: (_, sent, size) => { progress.value = (before + bytes.length * sent / size) / total; },
        calculateMD5Hash: simulator.md5,
      });
      before += bytes.length;
      stateOf(index, "verified");
    }
  }

  // The reason of a failure in words. `isLost`: the port is gone.
  function words(error, { ESPError, UnexpectedChipIdError, UnexpectedChipMagicError }, isLost) {
    const message = error?.message ?? String(error);
    if (error instanceof Refusal) return message;
    if (isLost) return "The board was unplugged. Plug it in and write again: what it has is not complete.";
    if (error instanceof UnexpectedChipIdError || error instanceof UnexpectedChipMagicError) {
      return `The board has a chip that is not known, and not an ${CHIP}. Nothing was written.`;
    }
    if (error instanceof DOMException) {
      return `The port cannot be opened; is another program or page using it? Close it there. (${message})`;
    }
    if (error instanceof ESPError && message.includes("Failed to connect")) {
      return "The board does not answer. Hold its button BOOT, press RESET once, release BOOT, and press “Connect and write” again. If that does not help: "
        + "another port, or a cable with data lines.";
    }
    if (error instanceof ESPError && message.includes("MD5")) {
      return "The flash differs from what was sent (MD5). Write again; if it happens again, use another cable or socket. Do not switch the motors on.";
    }
    return `The board stopped answering. Write again; a shorter cable may help. (${message})`;
  }

  async function flash() {
    if (isBusy) return;
    setBusy(true);
    try {
      const esptool = await library();
      await flashAt(await serial.requestPort(), esptool);
    } catch (error) {
      say(error.name === "NotFoundError" ? "No port was chosen." : error.message);
    }
    setBusy(false);
  }

  // Flashes the board at a port, and says how it ended.
  async function flashAt(port, esptool) {
    const transport = new esptool.Transport(port);
    const end = new AbortController();
    const lost = new Promise((_, reject) => {
      serial.addEventListener("disconnect", ({ target }) => { if (target === port) reject(new Lost()); }, { signal: end.signal });
    });
    try {
      const loader = new esptool.ESPLoader({ transport, baudrate: BAUD, romBaudrate: BAUD, terminal });
      const name = await Promise.race([work(loader, esptool, transport), lost]);
      say(`Written and verified: the ${name} starts.`);
      element("next").hidden = false;
    } catch (error) {
      say("");
      element("error").textContent = words(error, esptool, error instanceof Lost || (transport.baudrate > 0 && !port.readable));
      element("error").hidden = false;
      for (const { cells: [, , , state] } of element("parts").rows) if (state.textContent === WRITING) state.textContent = "not complete";
    }
    progress.hidden = true;
    end.abort();
    await Promise.race([transport.disconnect().catch(() => {}), sleep(PATIENCE)]);
    await port.close().catch(() => {}); // mostly it is closed
    transport.updateDevice({ getInfo: () => ({}) }); // what still waits for an answer writes nothing to the next board
  }

  async function work(loader, esptool, transport) {
    const name = await connect(loader, esptool, transport);
    await write(loader, name);
    await loader.after("custom_reset", undefined, START);
    return name;
  }

  function setBusy(is) {
    isBusy = is;
    // Disabled it would lose the focus.
    button.setAttribute("aria-disabled", is);
    for (const input of [robotInput, programInput]) input.disabled = is;
    if (!is) return;
    element("error").hidden = element("next").hidden = true;
    element("messages").textContent = "";
    element("log").hidden = false;
    element("parts").replaceChildren(...parts.map(row));
  }

  element("program-hint").textContent = released
    ? "The page has that of its release. A file of your own replaces it."
    : "sonarfix-esp32c6.bin of a release, or an ELF of your own. The site of a release has it in this page.";
  element("unsupported").hidden = Boolean(serial);
  element("ports").hidden = !serial;
  for (const input of [robotInput, programInput]) input.addEventListener("change", read);
  button.addEventListener("click", flash);
  read();
  return { simulator, read };
})();
