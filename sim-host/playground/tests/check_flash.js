// Uses the page that flashes a board without a board, for `cargo xtask playground`. Sets `data-checked` on the root element, or reports a failure
// to `data-error`. A board is flashed by `cargo xtask site --check`.
{
  const root = document.documentElement;
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const element = (id) => document.getElementById(id);
  const { simulator } = flashing;
  const hasPorts = "serial" in navigator;

  // The browser prints the page when it is loaded, which may be before it has read a file: here the contents are there at once.
  const contents = new Map();
  Blob.prototype.arrayBuffer = async function arrayBuffer() { return contents.get(this.name).buffer; };
  Blob.prototype.text = async function text() { return new TextDecoder().decode(contents.get(this.name)); };
  async function choose(id, files) {
    const chosen = new DataTransfer();
    for (const [name, bytes] of files) {
      contents.set(name, bytes);
      chosen.items.add(new File([bytes], name));
    }
    element(id).files = chosen.files;
    await flashing.read();
  }
  const utf8 = (text) => new TextEncoder().encode(text);

  async function check() {
    assert(element("unsupported").hidden === hasPorts && element("ports").hidden !== hasPorts, "the page says whether the browser has ports");
    assert(element("flash").disabled && element("written").hidden && element("wrong").hidden, "something is written without files");

    // The archive of the form.
    const answers = simulator.questions().filter((it) => !it.is_optional).map(({ option, default: usual }) => [option, usual]);
    const robot = { ...Object.fromEntries(answers), board: "esp32c6" };
    await choose("robot-files", [["robot.zip", simulator.zip(robot)]]);
    assert(element("wrong").hidden, `the archive of the form: ${element("wrong").textContent}`);
    const rows = [...element("parts").rows].map(({ cells }) => [cells[0].firstChild.textContent, cells[1].textContent]);
    const expected = [["configuration", "0x00100000"], ["map", "0x00110000"], ["bootloader", "0x00000000"], ["table of partitions", "0x00008000"]];
    assert(rows.join() === expected.join(), `what is written: ${rows}`);
    assert(element("flash").disabled && element("state").textContent.includes("program"), "a program is missing");
    await choose("program", [["robot.bin", utf8("UF2")]]);
    assert(element("wrong").textContent.includes("robot.bin is no program for the ESP32-C6"), `a wrong program: ${element("wrong").textContent}`);
    assert(element("program").getAttribute("aria-invalid") === "true" && element("flash").disabled, "the wrong program is not marked");

    // The files in it, one by one.
    const texts = new Map(simulator.robot(robot).files);
    const file = (name) => [name, utf8(texts.get(name))];
    await choose("program", []);
    await choose("robot-files", [file("robot.toml")]);
    assert(element("wrong").textContent.includes("there is no map"), `a robot without a map: ${element("wrong").textContent}`);
    assert(element("parts").rows.length === 2, "parts without a robot");
    await choose("robot-files", [file("map.toml"), file("robot.toml"), file("scenario.toml")]);
    assert(element("wrong").hidden && element("parts").rows.length === 4, `the files: ${element("wrong").textContent}`);
    assert(simulator.md5(utf8("abc")) === "900150983cd24fb0d6963f7d28e17f72", "the MD5 is not that of RFC 1321");
    root.dataset.checked = "true";
  }
  check().catch((error) => { root.dataset.error = error.message; });
}
