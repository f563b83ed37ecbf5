// Opens every page of the site in Chromium, 400 pixels wide: in the light scheme from the disk, in the dark one from a web server.
//
// node check.mjs MODULES SITE BROWSER [FLAG…]: MODULES is a folder with node_modules; program.uf2, a program for a Pico 2; sonarfix with the
// files of a robot in live-robot; in flash what a board with an ESP32-C6 must have of them; and pages that it has written in reports, which are opened, too,
// as is the page of a run that it serves. Prints each fault, and ends with 1 if there is one.
import { spawn } from "node:child_process";
import { once } from "node:events";
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { connect } from "node:net";
import { delimiter, extname, join } from "node:path";
import { pathToFileURL } from "node:url";
import { Board } from "./esp32c6.mjs";

const [modules, site, browserName, ...flags] = process.argv.slice(2);
const require = createRequire(join(modules, "x.js"));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const WIDTH = 400; // CSS pixels: a phone
const PATIENCE = 300_000; // milliseconds: beyond these the page hangs
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };
const PLAYGROUND = "playground/index.html";
const FORM = "new-robot/index.html";
const FLASH = "flash/index.html";
const LIVE = "live/index.html";
const COMPARISON = "comparison/comparison.html";
const SERVED = ""; // the page of a run that is served

const reports = join(modules, "reports");
const pagesIn = (folder) => readdirSync(folder, { recursive: true }).filter((name) => extname(name) === ".html").sort();
let faults = 0;

function fault(where, text) {
  faults += 1;
  console.error(`${where}: ${text}`);
}

function serve(folder) {
  const server = createServer((request, response) => {
    const path = join(folder, decodeURIComponent(new URL(request.url, "http://x").pathname));
    if (request.url === "/favicon.ico") { response.writeHead(204).end(); return; } // the browser asks for it, not the page
    if (!existsSync(path)) { response.writeHead(404).end(); return; }
    response.writeHead(200, { "Content-Type": TYPES[extname(path)] ?? "application/octet-stream" }).end(readFileSync(path));
  });
  return new Promise((resolve) => { server.listen(0, "127.0.0.1", () => resolve(server)); });
}

// Checks the page as it is now.
async function check(page, where) {
  const wide = await page.evaluate(() => {
    const whole = [...document.querySelectorAll("html, body, .page, .content, main, section, form")]; // not a table or a block of code
    const names = whole.filter((it) => it.clientWidth > 0 && it.scrollWidth > it.clientWidth + 1);
    return names.map((it) => `${it.localName}#${it.id} has ${it.scrollWidth} of ${it.clientWidth} pixels`);
  });
  if (wide.length > 0) fault(where, `scrolls sideways: ${wide.join(", ")}`);
  const { violations } = await page.evaluate(() => axe.run({ preload: location.protocol !== "file:" })); // a page on a disk may not read its style sheets
  for (const { id, help, nodes } of violations) {
    const places = nodes.slice(0, 3).map(({ target, any }) => `${target.join(" ")} ${any[0]?.message ?? ""}`);
    fault(where, `${id}: ${help}: ${nodes.length} × ${places.join(" | ")}`);
  }
}

// The table of contents and the search, opened.
async function useBook(page, where) {
  await page.click("#mdbook-sidebar-toggle");
  await page.waitForSelector("#mdbook-sidebar .chapter a", { state: "visible" });
  await page.waitForTimeout(500); // it slides in
  await check(page, `${where}, contents`);
  await page.click("#mdbook-sidebar-toggle");
  await page.waitForTimeout(500);
  await page.click("#mdbook-search-toggle");
  await page.locator("#mdbook-searchbar").pressSequentially("covariance");
  await page.waitForSelector("#mdbook-searchresults li a");
  await check(page, `${where}, search`);
  const found = await page.$$eval("#mdbook-searchresults li a", (links) => links.map((link) => link.href));
  if (!found.some((link) => link.includes("docs/model.html"))) fault(where, `the search does not find the model`);
}

// The first scene moves in the first frames.
async function usePlayground(page, where) {
  const [start, later] = await page.evaluate(async () => {
    const { data, state } = playground.player();
    for (let frame = 0; frame < 3; frame += 1) await new Promise(requestAnimationFrame);
    return [data.ticks.time[0], state.time];
  });
  if (!(later > start)) fault(where, "the scene does not move");
  const paint = await page.evaluate(() => performance.getEntriesByName("first-contentful-paint")[0]?.startTime);
  console.log(`${where}: first paint after ${paint?.toFixed(0)} ms`);
}

// The form of a new robot is filled in by the keys alone; its archive becomes SCHEME.zip in the folder MODULES, with a UF2 of the program there.
async function useForm(page, where, scheme) {
  const answers = ["pico2", "lv_maxsonar", "90 deg", "mg996r", "900", "68 mm", "14 cm", "5 x 3.5"]; // in the order of the fields
  const first = page.locator("#fields select").first();
  while (!await first.evaluate((it) => it === document.activeElement)) await page.keyboard.press("Tab");
  for (const answer of answers) {
    await page.keyboard.type(answer);
    await page.keyboard.press("Tab");
  }
  const typed = await page.$$eval("#fields input, #fields select", (fields) => fields.map(({ value }) => value));
  if (typed.join() !== answers.join()) fault(where, `the fields have ${typed}`);
  await page.setInputFiles("#program", join(modules, "program.uf2"));
  await page.waitForFunction(() => document.getElementById("flash-hint").textContent.includes("robot.uf2"));
  while (!await page.evaluate(() => document.activeElement.id === "download")) await page.keyboard.press("Tab");
  const [download] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("Enter")]);
  await download.saveAs(join(modules, `${scheme}.zip`));
  await page.$$eval("#files details", (files) => files.forEach((it) => { it.open = true; }));
}

// In the pages with a serial port: one whose other end is `toPort`, `setSignals` and `fromPort`, which can be unplugged, and can be in use elsewhere. None
// behind `#without-ports`. `modules` counts the scripts that the page loads later.
function playPort() {
  if (!/(live|flash)\/index\.html$/.test(location.pathname)) return;
  const ofSerial = (value) => Object.defineProperty(navigator, "serial", { value });
  if (location.hash === "#without-ports") { ofSerial(undefined); return; }
  const serial = new EventTarget();
  const say = (name) => serial.dispatchEvent(Object.defineProperty(new Event(name), "target", { value: port }));
  let controller = null;
  const port = {
    readable: null,
    writable: null,
    getInfo: () => ({ usbVendorId: 0x2e8a, usbProductId: 10 }),
    async open({ baudRate }) {
      if (window.isPortBusy) throw new DOMException("Failed to open serial port.", "NetworkError");
      if (baudRate !== 115200) throw new Error(`opened with ${baudRate} baud`);
      this.readable = new ReadableStream({ start: (it) => { controller = it; } });
      this.writable = new WritableStream({ write: (bytes) => window.toPort([...bytes]) });
    },
    setSignals: (signals) => window.setSignals(signals),
    async close() { this.readable = this.writable = controller = null; },
  };
  serial.requestPort = async () => port;
  window.fromPort = (bytes) => controller?.enqueue(new Uint8Array(bytes));
  window.unplug = () => {
    port.readable = port.writable = null;
    controller.error(new DOMException("The device has been lost.", "NetworkError"));
    say("disconnect");
  };
  window.plug = () => say("connect");
  ofSerial(serial);
  window.modules = 0;
  const { createObjectURL } = URL;
  URL.createObjectURL = (blob) => {
    if (blob.type === "text/javascript") window.modules += 1;
    return createObjectURL.call(URL, blob);
  };
}

// The other end of the port of the page: functions that take bytes and signals.
let otherEnd = null;

// What the command `sonarfix` prints, up to the pattern.
async function printedBy(command, stream, expected) {
  let printed = "";
  const ended = once(command, "exit").then(([code]) => {
    throw new Error(`sonarfix has ended with ${code}, and has printed ${printed}`);
  });
  ended.catch(() => {}); // after the pattern, or in the race below
  while (!expected.test(printed)) printed += (await Promise.race([once(stream, "data"), ended]))[0];
  return printed.match(expected);
}

// A virtual robot that stands; it prints its socket and its pose.
async function startRobot() {
  const robot = spawn(join(modules, "sonarfix"), ["virtual-robot", join(modules, "live-robot/scenario.toml"), "--tcp", "0", "--stand"]);
  const expected = /tcp:127\.0\.0\.1:(\d+)[^]*set-pose (\S+) (\S+) (\S+)\n/;
  const [, port, x, y, heading] = await printedBy(robot, robot.stdout, expected);
  return { robot, socket: connect(Number(port), "127.0.0.1"), pose: { x, y, heading } };
}

// A virtual robot is connected, started, driven, recorded, unplugged, plugged in again and stopped.
async function useLive(page, where) {
  const { robot, socket, pose } = await startRobot();
  const read = (name) => page.locator(`[data-value="${name}"]`).textContent();
  const shows = (id, text) => page.waitForFunction(([of, part]) => document.getElementById(of).textContent.includes(part), [id, text]);
  const exceeds = (name, least) => page.waitForFunction(
    ([of, bound]) => parseFloat(document.querySelector(`[data-value="${of}"]`).textContent) > bound, [name, least]);
  otherEnd = { receive: (bytes) => socket.write(bytes) };
  socket.on("data", (data) => page.evaluate((bytes) => fromPort(bytes), [...data]).catch(() => {}));
  try {
    await page.setInputFiles("#map-file", join(modules, "live-robot/map.toml"));
    await page.setInputFiles("#robot-file", join(modules, "live-robot/robot.toml"));
    await page.focus("#connect");
    await page.keyboard.press("Enter");
    await shows("connection", "connected");
    await shows("lines", "robot");
    for (const [name, value] of Object.entries(pose)) await page.fill(`#pose [name="${name}"]`, value);
    await page.click("#pose button");
    await shows("answer", "done");
    await page.click('[data-order="start"]');
    await shows("answer", "done");
    await exceeds("time", 0);
    await page.click("#record");
    await shows("answer", "recording");
    await page.focus("#pad");
    await page.keyboard.down("ArrowUp");
    await exceeds("pose", Number(pose.x) + 0.05);
    await page.keyboard.up("ArrowUp");
    await shows("motion", "stands");
    const [download] = await Promise.all([page.waitForEvent("download"), page.click("#record")]);
    if (!readFileSync(await download.path(), "utf8").endsWith("\n# end\n")) fault(where, "the recording is not whole");
    const [picture] = await Promise.all([page.waitForEvent("download"), page.click("#save-picture")]);
    if (!readFileSync(await picture.path()).subarray(1, 4).equals(Buffer.from("PNG"))) fault(where, "the saved picture is no PNG");
    await page.evaluate(() => unplug());
    await shows("connection", "unplugged");
    const time = parseFloat(await read("time"));
    await page.evaluate(() => plug());
    await exceeds("time", time + 1);
    await page.click("#halt");
    await shows("answer", "done");
    await page.$eval("#unsupported", (text) => { text.hidden = false; }); // as in another browser
  } finally {
    socket.destroy();
    robot.kill();
  }
  console.log(`${where}: a robot at ${await read("pose")}`);
}

// A board is flashed by the keys alone, after each thing that can go wrong: its flash then has the bytes of the files in the folder MODULES/flash, and nothing
// else is changed.
async function useFlash(page, where, scheme) {
  const file = (name) => readFileSync(join(modules, "flash", name));
  const isShown = (id, text) => page.waitForFunction(([of, part]) => {
    const it = document.getElementById(of);
    return it.checkVisibility() && it.textContent.includes(part);
  }, [id, text]).catch(() => { throw new Error(`“${text}” is not shown`); });
  const reload = async (hash) => {
    await page.evaluate((it) => { location.hash = it; }, hash);
    await page.reload();
  };
  await reload("without-ports");
  await isShown("unsupported", "cannot open serial ports");
  await page.evaluate(axe);
  await check(page, `${where}, without ports`);
  await reload("");
  await page.evaluate(axe);

  const robot = scheme === "light" ? ["robot.toml", "map.toml"].map((name) => join(modules, "live-robot", name)) : join(modules, "flash/robot.zip");
  await page.setInputFiles("#robot-files", robot);
  // That of a release is written unless another one is chosen.
  const released = scheme === "dark" && await page.evaluate(() => document.getElementById("program-esp32c6")?.textContent);
  if (!released) await page.setInputFiles("#program", join(modules, "flash", scheme === "light" ? "program.bin" : "program.elf"));
  await isShown("state", "ready to be written");
  if (await page.evaluate(() => window.modules) !== 0) fault(where, "the library is loaded before somebody connects");
  while (!await page.evaluate(() => document.activeElement.id === "flash")) await page.keyboard.press("Tab");

  // Connects a board by the key; the board.
  async function connectBoard(faults) {
    const send = (bytes) => { page.evaluate((it) => fromPort(it), [...bytes]).catch(() => {}); };
    const board = new Board(send, () => page.evaluate(() => unplug()), faults);
    otherEnd = board;
    await page.waitForFunction(() => document.getElementById("flash").getAttribute("aria-disabled") !== "true");
    await page.keyboard.press("Enter");
    return board;
  }

  const untouched = new Board().flash;
  for (const [faults, text, isWritten] of [
    [{ isBusy: true }, "another program"],
    [{ deaf: true }, "Hold its button BOOT"],
    [{ chip: 5 }, "an ESP32-C3 and not an ESP32-C6"],
    [{ chip: 99 }, "a chip that is not known"],
    [{ flips: 0x110010 }, "differs from what was sent (MD5)", true],
    [{ unplugsAt: 0x10000 }, "was unplugged", true],
  ]) {
    await page.evaluate((isBusy) => { window.isPortBusy = isBusy; }, Boolean(faults.isBusy));
    const board = await connectBoard(faults);
    await isShown("error", text);
    await check(page, `${where}, ${text}`);
    if (!isWritten && !board.flash.equals(untouched)) fault(where, `${text}: something was written`);
    if (await page.locator("#next").isVisible()) fault(where, `${text}: the page says what comes next`);
    if (isWritten && !(await page.locator("#parts").textContent()).includes("not complete")) fault(where, `${text}: no part is said to be incomplete`);
  }

  const board = await connectBoard({});
  await isShown("state", "Written and verified: the ESP32-C6 (revision 1) starts");
  if (await page.locator("#error").isVisible()) fault(where, "the page shows an error of another board");
  const loader = JSON.parse(file("loader.json"));
  for (const [bytes, address] of [[loader.text, loader.text_start], [loader.data, loader.data_start]]) {
    if (!board.memory.get(address)?.equals(Buffer.from(bytes, "base64"))) fault(where, "the loader was not sent as it is");
  }
  if (board.entry !== loader.entry) fault(where, `the loader starts at ${board.entry}`);
  const expected = Buffer.from(untouched);
  const places = [["bootloader.bin", 0], ["partitions.bin", 0x8000], ["program.bin", 0x10000], ["config.bin", 0x100000], ["map.bin", 0x110000]];
  for (const [name, address] of places) {
    const bytes = released && name === "program.bin" ? Buffer.from(released, "base64") : file(name), end = address + bytes.length;
    expected.fill(0xff, address, Math.ceil(end / 4096) * 4096); // whole sectors are erased
    bytes.copy(expected, address);
    if (!board.flash.subarray(address, end).equals(bytes)) fault(where, `${name} is not at ${address.toString(16)}`);
  }
  if (!board.flash.equals(expected)) fault(where, "the flash is changed elsewhere");
  if (board.starts !== 1) fault(where, `the program was started ${board.starts} times`);
  if (await page.evaluate(() => document.activeElement.id) !== "flash") fault(where, "the focus is lost");
  const live = await page.$eval("#live", ({ href }) => href);
  if (!live.endsWith("/" + LIVE)) fault(where, `the live page is at ${live}`);
  await page.$eval("#log", (it) => { it.open = true; });
}

// The keys move both runs of a comparison.
async function useComparison(page, where) {
  await page.focus(".map");
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Shift+ArrowRight");
  const times = await page.$$eval('[data-value="time"]', (places) => places.map((place) => parseFloat(place.textContent)));
  if (times.length !== 2 || times.some((time) => Math.abs(time - 11) > 0.2)) fault(where, `the keys lead to ${times}`);
  await page.keyboard.press("Space");
  await page.waitForFunction(() => parseFloat(document.querySelector('[data-value="time"]').textContent) > 12);
  await page.keyboard.press("Space");
}

// A run that is served, with another one beside it; its address.
async function startServer() {
  const options = ["--serve", "--speed", "20", "--beside", "drive.csv"];
  const server = spawn(join(modules, "sonarfix"), ["run", "scenario.toml", ...options], { cwd: reports });
  const [, address] = await printedBy(server, server.stderr, /^open (\S+)\n/m);
  return { server, address };
}

// Both runs of a page that is served are at the same time.
async function useServed(page, where) {
  await page.waitForFunction(() => parseFloat(document.querySelector('[data-value="time"]').textContent) > 10);
  await page.click("#pause");
  await page.waitForFunction(() => document.getElementById("answer").textContent === "paused");
  await page.waitForTimeout(200); // the last events are drawn
  const [time, beside] = await page.evaluate(() => ['[data-value="time"]', "#beside-numbers"].map((of) => parseFloat(document.querySelector(of).textContent)));
  if (!(Math.abs(time - beside) < 0.2)) fault(where, `the runs are at ${time} s and ${beside} s`);
}

async function open(page, base, name, where, scheme) {
  await page.goto(base + name, { waitUntil: "load" });
  if (name === PLAYGROUND) await usePlayground(page, where);
  if (name === FORM) await useForm(page, where, scheme);
  if (name === FLASH) await useFlash(page, where, scheme);
  if (name === LIVE) await useLive(page, where);
  if (name === COMPARISON) await useComparison(page, where);
  if (name === SERVED) await useServed(page, where);
  await page.evaluate(axe);
  await check(page, where);
  if (name === "index.html") await useBook(page, where);
}

async function visit(browser, scheme, base, names) {
  const [own] = base.split("#"); // the address of a page that is served has a token
  const context = await browser.newContext({ viewport: { width: WIDTH, height: 800 }, colorScheme: scheme });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  await page.addInitScript(playPort);
  await page.exposeFunction("toPort", (bytes) => { otherEnd.receive(Buffer.from(bytes)); });
  await page.exposeFunction("setSignals", (signals) => { otherEnd.signals(signals); });
  let where = "";
  page.on("console", (message) => { if (message.type() === "error") fault(where, message.text()); });
  page.on("pageerror", (error) => fault(where, error.message));
  page.on("requestfailed", (request) => fault(where, `${request.url()} cannot be loaded`));
  page.on("request", (request) => {
    const isOwn = request.url().startsWith(own) || /^(data|blob):/.test(request.url());
    if (!isOwn) fault(where, `loads ${request.url()}`);
  });
  for (const name of names) {
    where = `${name || "served"}, ${scheme}`;
    try {
      await open(page, base, name, where, scheme);
    } catch (error) {
      fault(where, error.message);
    }
  }
  await context.close();
}

const executablePath = process.env.PATH.split(delimiter).map((folder) => join(folder, browserName)).find(existsSync);
const browser = await chromium.launch({ executablePath, args: flags });
let count = 0;
for (const folder of [site, reports]) {
  const names = pagesIn(folder), server = await serve(folder);
  await visit(browser, "light", `${pathToFileURL(folder)}/`, names);
  await visit(browser, "dark", `http://127.0.0.1:${server.address().port}/`, names);
  server.close();
  count += names.length;
}
for (const scheme of ["light", "dark"]) {
  const { server, address } = await startServer();
  await visit(browser, scheme, address, [SERVED]);
  server.kill();
}
await browser.close();
console.log(`${count + 1} pages in 2 colour schemes, ${faults} faults`);
process.exitCode = faults > 0 ? 1 : 0;
