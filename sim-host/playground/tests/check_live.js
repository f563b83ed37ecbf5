// Uses the live page without a robot, for `cargo xtask playground`. Sets `data-checked` on the root element, or reports a failure to
// `data-error`. A robot is connected by `cargo xtask site --check`.
{
  const root = document.documentElement;
  const assert = (holds, what) => { if (!holds) throw new Error(what); };
  const element = (id) => document.getElementById(id);
  const hasPorts = "serial" in navigator;

  assert(element("unsupported").hidden === hasPorts && element("ports").hidden !== hasPorts, "the page says whether the browser has ports");
  assert(!element("robot").hidden && element("paced").hidden, "the scene of a robot has not arrived");
  assert(element("drive").hidden !== hasPorts, "a robot can be driven if there are ports");
  assert(element("wrong").hidden, `a mistake without a file: ${element("wrong").textContent}`);
  Connection.order({ order: "start" }).then(({ done, text }) => {
    assert(!done && text.includes("Connect"), `an order without a robot: ${text}`);
    root.dataset.checked = "true";
  }).catch((error) => { root.dataset.error = error.message; });
}
