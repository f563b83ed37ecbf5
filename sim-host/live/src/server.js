"use strict";
// The connection of the page to the server that it comes from: events as lines of JSON, and orders.

const Connection = (() => {
  const RETRY = 1_000; // ms until a lost connection is tried again

  // The token is in the address at first; a reload finds it in the storage of this tab.
  const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem("token") ?? "";
  sessionStorage.setItem("token", token);
  history.replaceState(null, "", location.pathname);
  const authorization = { Authorization: `Bearer ${token}` };

  let next = 0; // the number of the next event
  let isEnded = false;

  async function listen(take, say) {
    while (!isEnded) {
      try {
        const response = await fetch(`/events?from=${next}`, { headers: authorization, cache: "no-store" });
        if (response.status === 401) return say("open the address that the program has printed");
        if (!response.ok) throw new Error(response.statusText);
        say("connected");
        await read(response.body.pipeThrough(new TextDecoderStream()).getReader(), take);
      } catch {
        // The program has ended, or the connection was lost.
      }
      say(isEnded ? "ended" : "no connection: trying again");
      if (!isEnded) await new Promise((resolve) => setTimeout(resolve, RETRY));
    }
  }

  async function read(reader, take) {
    let rest = "";
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      const lines = (rest + value).split("\n");
      rest = lines.pop();
      for (const line of lines.filter((text) => text !== "")) {
        const event = JSON.parse(line);
        if (event.kind === "missed") next += event.count; else if (event.kind === "end") isEnded = true; else next++;
        take(event);
      }
    }
  }

  async function order(body, signal) {
    const response = await fetch("/order", { method: "POST", headers: authorization, body: JSON.stringify(body), signal });
    return response.ok ? response.json() : { done: false, text: await response.text() };
  }

  return { listen, order };
})();
