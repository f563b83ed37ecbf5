"use strict";
// The form of a new robot: the questions of `sonarfix init`, its files, and what is improbable in them.

const newRobot = (() => {
  const element = (id) => document.getElementById(id);
  const simulator = openSimulator(element("wasm").textContent);
  const inputs = new Map(); // by option
  const questions = simulator.questions();

  function makeField({ option, what, known, default: usual, is_optional: isOptional }) {
    const label = document.createElement("label");
    const input = document.createElement(known.length > 0 ? "select" : "input");
    if (known.length > 0) input.append(...known.map((name) => new Option(name)));
    if (isOptional) input.placeholder = `none, or ${usual}`; else input.value = usual;
    const text = what[0].toUpperCase() + what.slice(1);
    label.append(text, input);
    input.addEventListener("input", option === "board" ? changeBoard : show);
    inputs.set(option, input);
    return label;
  }

  // A board that is sold with a robot has answers of its own; the others have the usual ones again.
  let kit = null;
  function changeBoard() {
    const board = inputs.get("board").value;
    for (const { option, default: usual, of_kits: ofKits } of questions) {
      const before = ofKits[kit] ?? usual, input = inputs.get(option);
      if (Object.keys(ofKits).length > 0 && input.value === before) input.value = ofKits[board] ?? usual;
    }
    kit = board;
    loadProgram();
  }

  const answers = () => Object.fromEntries([...inputs].map(([option, { value }]) => [option, value]));

  // The program of a release that this page has, for a board.
  const released = (board) => element(`program-${board}`)?.textContent;

  // The chosen program, or else the released one; of no bytes if there is none.
  async function loadProgram() {
    const [file] = element("program").files, text = released(inputs.get("board").value);
    const bytes = file ? new Uint8Array(await file.arrayBuffer()) : decoded(text ?? "");
    simulator.setProgram(bytes);
    show();
  }

  // The warnings and files of the answers, or the mistake in them: the last files stay then.
  function show() {
    const robot = simulator.robot(answers());
    const { error, option, warnings = [], files } = robot;
    element("error").hidden = !error;
    element("error").textContent = error ?? "";
    element("download").disabled = Boolean(error);
    for (const [name, input] of [...inputs, ["program", element("program")]]) input.setAttribute("aria-invalid", name === option);
    element("warnings").replaceChildren(...warnings.map(({ key, message }) => {
      const line = document.createElement("p");
      line.textContent = `${key}: ${message}`;
      return line;
    }));
    if (!files) return;
    showFlashing(robot);
    const wiring = new DOMParser().parseFromString(new Map(files).get("wiring.svg"), "image/svg+xml").documentElement;
    wiring.setAttribute("role", "img");
    wiring.setAttribute("aria-label", "Which part is connected to which pin; README.md has the same as a table");
    element("wiring").replaceChildren(wiring);
    showFiles(files.filter(([name]) => !name.endsWith(".svg")));
  }

  // What to do for the board: drop the UF2 on its drive, or run a command.
  function showFlashing({ package: name, drive, uf2 }) {
    const board = inputs.get("board").value;
    element("program-field").hidden = element("program-hint").hidden = !drive;
    element("program-hint").textContent = released(board)
      ? "The page has that of its release. A file of your own replaces it."
      : `With ${name}.uf2 of a release, or one of your own, the archive has the file that the board takes.`;
    const command = document.createElement("code");
    command.textContent = `sonarfix flash robot --board ${board}`;
    const page = element("flash-page"); // on the site only
    if (page) page.hidden = board !== "esp32c6";
    element("flash-hint").replaceChildren(...uf2
      ? [`Hold BOOTSEL while you plug the board in, and drop robot.uf2 on the drive ${drive}: it has program, configuration and map.`]
      : [command, " writes it to the board."]);
  }

  function showFiles(files) {
    const isOpen = [...element("files").children].map(({ open }) => open);
    element("files").replaceChildren(...files.map(([name, text], index) => {
      const details = document.createElement("details"), summary = document.createElement("summary"), pre = document.createElement("pre");
      details.open = isOpen[index] ?? false;
      summary.textContent = name;
      pre.textContent = text;
      pre.tabIndex = 0; // it scrolls
      details.append(summary, pre);
      return details;
    }));
  }

  function download(event) {
    event.preventDefault();
    const bytes = simulator.zip(answers());
    if (bytes.length === 0) return;
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(new Blob([bytes])), download: "robot.zip" });
    link.click();
    URL.revokeObjectURL(link.href);
  }

  element("fields").append(...questions.map(makeField));
  element("program").addEventListener("input", loadProgram);
  element("robot").addEventListener("submit", download);
  loadProgram();
  return { simulator, inputs, answers, loadProgram };
})();
