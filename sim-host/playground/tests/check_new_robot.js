// Uses the form of a new robot by a script, for `cargo xtask playground`. Sets `data-checked` on the root element, or reports a failure to
// `data-error`.
{
  const root = document.documentElement;
  const { simulator, inputs, answers } = newRobot;
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const element = (id) => document.getElementById(id);
  const set = (option, value) => { inputs.get(option).value = value; inputs.get(option).dispatchEvent(new Event("input")); };
  const warned = () => element("warnings").textContent;

  assert(element("error").hidden && warned() === "", "the usual robot has a mistake or a warning");
  assert(element("wiring").querySelector("svg text") !== null, "there is no wiring");
  set("wheel-diameter", "650 mm");
  assert(warned().includes("65 mm") && !element("download").disabled, `a large wheel: ${warned()}`);
  set("wheel-diameter", "65");
  assert(element("error").textContent.includes("unit") && element("download").disabled, "a length without a unit");
  set("wheel-diameter", "65 mm");
  set("track-width", "\"");
  assert(inputs.get("track-width").getAttribute("aria-invalid") === "true", "the wrong answer is not marked");
  set("track-width", "121 mm");
  set("board", "esp32c6");
  set("sonar", "vl53l1x");
  assert(element("error").textContent.includes("ESP32-C6"), "a board without a bus");
  set("sonar", "hc_sr04");
  set("board", "xrp");
  assert(inputs.get("wheel-diameter").value === "60 mm" && warned() === "", `a kit: ${warned()}`);
  set("board", "pico");
  assert(inputs.get("wheel-diameter").value === "65 mm", "the usual wheels again");
  set("sonar", "vl53l1x");
  set("second-at", "90 deg");
  set("room", "5 x 3.5");
  assert(element("error").hidden && warned() === "", `a robot with two rangers: ${element("error").textContent}${warned()}`);
  assert(element("files").textContent.includes("to = [5.0, 3.5]"), "the room is not in the map");
  const zip = simulator.zip(answers());
  assert(zip[0] === 0x50 && zip[1] === 0x4B && zip.length > 1000, "there is no archive");
  for (const [option, value] of [["second-at", ""], ["room", ""], ["sonar", "hc_sr04"]]) set(option, value);
  assert(element("error").hidden, "the usual robot again");
  root.dataset.checked = "true";
}
