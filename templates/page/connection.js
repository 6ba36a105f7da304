"use strict";
// The connection to the server: what comes over it, and what the buttons send.

const TAKE = { status: takeStatus, telemetry: takeTelemetry, result: takeResult };
let connected = false;
let connection = null;

function takeResult(message) {
  document.getElementById("stops").hidden = false;
  document.getElementById("results").prepend(element("li", {}, message.text));
}

/** Asks the server to do `action`, "stop" or "start", with robots: with all of them if the list is empty. */
function ask(action, names) {
  if (connected) connection.send(JSON.stringify({ action, robots: names }));
  else takeResult({ text: `not sent: no connection to swarmctl. Run \`swarmctl ${action}\` in a terminal.` });
}

function connect(wait) {
  const address = new URL("live", location.href);
  address.protocol = "ws:";
  address.search = location.search;
  connection = new WebSocket(address);
  connection.addEventListener("open", () => (connected = true));
  connection.addEventListener("message", (event) => {
    const message = JSON.parse(event.data);
    TAKE[message.kind](message);
  });
  connection.addEventListener("close", () => {
    const again = connected ? 500 : Math.min(2 * wait, 5000);
    connected = false;
    setTimeout(connect, again, again);
  });
}

for (const button of document.querySelectorAll("[data-action]")) {
  button.addEventListener("click", () => {
    ask(button.dataset.action, button.dataset.of === "all" ? [] : [selected.replace("robot:", "")]);
  });
}
connect(500);
