"use strict";
// The connection to the server: what comes over it, and what the buttons send.

const TAKE = { status: takeStatus, telemetry: takeTelemetry, result: takeResult, log: takeLog };
let connected = false;
let connection = null;

function takeResult(message) {
  document.getElementById("stops").hidden = false;
  document.getElementById("results").prepend(element("li", {}, message.text));
}

/** Takes the log of a node: {node, lines, trouble}. */
function takeLog(message) {
  if (message.node !== selected) return;
  const place = document.getElementById("log");
  const lines = message.lines.map((line) => element("div", { class: `level-${line.level}` }, line.text));
  place.replaceChildren(...lines, message.trouble || (lines.length ? "" : "nothing was logged"));
  place.scrollTop = place.scrollHeight;
}

/** Asks for the log of a node. */
function askForLog(id) {
  document.getElementById("logs").hidden = id === null || id.startsWith("network:");
  document.getElementById("log").replaceChildren("reading ...");
  if (connected && id !== null) connection.send(JSON.stringify({ action: "log", names: [id] }));
}

/** Asks the server to do `action`, "stop" or "start", with robots: with all of them if the list is empty. */
function ask(action, names) {
  if (connected) connection.send(JSON.stringify({ action, names }));
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
document.getElementById("reload").addEventListener("click", () => askForLog(selected));
ON_SELECT.push(askForLog);
connect(500);
