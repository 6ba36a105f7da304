"use strict";
// The health of the swarm, as the server sends it: states in the picture, findings, and details of what is selected.

const SVG = "http://www.w3.org/2000/svg";
const MARKS = { // a shape for each state, for those who do not see its colour
  ok: "M7 1a6 6 0 1 0 .01 0z",
  warning: "M7 1 13.5 13H.5z",
  bad: "M7 0 14 7 7 14 0 7z",
  unknown: "M7 1a6 6 0 1 0 .01 0zM7 4a3 3 0 1 1-.01 0z",
  skipped: "M1 6h12v2H1z",
};
const RANK = ["ok", "skipped", "warning", "unknown", "bad"];
const LATE = 40; // s after which a look at the hosts is old
let clock = () => performance.now(); // ms; a replay has its own
let look = null; // the last one: {status, causes, age}, and `came`, ms

/** The mark of a state, with its name for screen readers. */
function mark(state) {
  const made = document.createElementNS(SVG, "svg");
  made.setAttribute("class", "mark");
  made.setAttribute("viewBox", "0 0 14 14");
  made.setAttribute("role", "img");
  made.setAttribute("aria-label", state);
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("class", state);
  path.setAttribute("fill-rule", "evenodd");
  path.setAttribute("d", MARKS[state]);
  made.append(path);
  return made;
}

/** An empty mark in the upper right corner of a box of the picture. */
function newBadge(box) {
  const made = document.createElementNS(SVG, "path");
  const right = box.x.baseVal.value + box.width.baseVal.value;
  made.setAttribute("class", "badge");
  made.setAttribute("fill-rule", "evenodd");
  made.setAttribute("transform", `translate(${right - 28} ${box.y.baseVal.value + 8})`);
  return made;
}

/** The rows of the status by the ids of the picture's nodes. */
function rowsOf(status) {
  const rows = new Map();
  for (const host of status.hosts) {
    rows.set(`host:${host.name}`, host);
    for (const robot of host.robots) rows.set(`robot:${robot.name}`, robot);
    for (const program of host.programs) rows.set(`program:${program.name}`, program);
  }
  return rows;
}

/** The id of the node that a finding is about. */
function ownerOf(finding) {
  if (finding.robot) return `robot:${finding.robot}`;
  return finding.program ? `program:${finding.program}` : `host:${finding.host}`;
}

/** The state of a node: that of the last look; unknown if its robot has reported a trouble since. */
function stateOf(id, rows) {
  const state = rows.get(id)?.state;
  return isNewTrouble(id, state) ? "unknown" : state;
}

function showStates() {
  const rows = rowsOf(look.status);
  for (const [id, shape] of shapes) {
    const state = stateOf(id, rows);
    if (!state || shape.dataset.state === state) continue;
    shape.dataset.state = state;
    const badge = shape.querySelector(".badge") ?? shape.appendChild(newBadge(shape.querySelector(".shape")));
    badge.setAttribute("d", MARKS[state]);
    for (const one of RANK) {
      badge.classList.toggle(one, one === state);
      shape.classList.toggle(`is-${one}`, one === state);
    }
    const node = nodes.get(id);
    shape.setAttribute("aria-label", `${node.kind} ${node.name}, ${node.detail}: ${state}`);
  }
}

function showFindings() {
  const list = look.causes.map((cause) =>
    element(
      "li",
      {},
      element(
        "button",
        { "aria-pressed": String(ownerOf(cause) === selected), onclick: () => select(ownerOf(cause)) },
        mark(cause.state), " ", element("strong", {}, cause.key), ` ${cause.message}`,
      ),
    ),
  );
  document.getElementById("findings").replaceChildren(...list);
  document.getElementById("no-findings").hidden = list.length > 0;
}

/** The state in words, and how old it is. What robots report shows at once; the next look decides its state. */
function showState() {
  if (!look) return;
  const age = Math.round(look.age + (clock() - look.came) / 1000);
  const count = look.causes.length;
  const fresh = troubles();
  let state = look.status.healthy ? (count ? "warning" : "ok") : "bad";
  let words = look.status.healthy ? (count ? `healthy, ${count} to look at` : "healthy") : `not healthy, ${count} to look at`;
  if (state !== "bad" && fresh.length) [state, words] = ["unknown", fresh.join("; ")];
  const place = document.getElementById("state");
  if (place.dataset.text !== state + words) {
    place.dataset.text = state + words;
    place.replaceChildren(mark(state), ` ${words}`);
  }
  const shown = document.getElementById("age");
  if (shown.dataset.taken) shown.textContent = `as of ${shown.dataset.taken}`;
  else shown.textContent = connected && age < LATE ? `seen ${age} s ago` : `OUT OF DATE: seen ${age} s ago`;
}

const number = (value, digits = 1) => (value === null || value === undefined ? "–" : value.toFixed(digits));

ADD_DETAILS.push((node) => {
  if (!look) return [];
  const row = rowsOf(look.status).get(node.id);
  if (!row) return [];
  const shown = [element("p", { class: "state" }, mark(row.state), ` ${row.state}`)];
  for (const cause of look.causes) {
    const about = [cause, ...cause.symptoms].filter((one) => ownerOf(one) === node.id);
    if (!about.length) continue;
    shown.push(element("p", {}, mark(cause.state), " ", element("strong", {}, cause.key), `: ${cause.message}`));
    if (cause.hint) shown.push(element("p", {}, element("strong", {}, "Remedy: "), cause.hint));
    if (cause.symptoms.length) {
      shown.push(
        element("p", { class: "soft" }, `Symptoms: ${cause.symptoms.map((one) => `${one.key}: ${one.message}`).join("; ")}`),
      );
    }
  }
  const facts = [];
  if (row.address) facts.push(["address", row.address], ["release", row.release ?? "none"]);
  if (row.driver ?? row.unit) facts.push(["unit", `${(row.driver ?? row.unit).active} (${(row.driver ?? row.unit).sub})`]);
  if (row.device) facts.push(["device", `${row.device}${row.device_exists === false ? ", missing" : ""}`]);
  const now = node.kind === "robot" ? reportOf(node.name) : null; // newer than the look
  if (now?.driven && !now.trouble) facts.push(["drives", `${number(now.driven[0], 2)} m/s, ${number(now.driven[1], 2)} rad/s`]);
  else if (row.report) facts.push(["driver", row.report]);
  if (row.commanders !== undefined) facts.push(["obeys", (now?.commander ?? row.commander) || "nobody"]);
  shown.push(
    element("table", { class: "facts" }, ...facts.map(([name, text]) => element("tr", {}, element("th", {}, name), element("td", {}, text)))),
  );
  if (row.topics?.length) {
    shown.push(
      element(
        "table",
        {},
        element("tr", {}, element("th", {}, "topic"), element("th", {}, "Hz"), element("th", {}, "expected")),
        ...row.topics.map((topic) =>
          element(
            "tr",
            {},
            element("td", {}, topic.name),
            element("td", { class: "number" }, number(topic.rate)),
            element("td", { class: "number" }, number(topic.expected)),
          ),
        ),
      ),
    );
  }
  return shown;
});

/** Takes a status: {status, causes, age}. */
function takeStatus(message) {
  look = { ...message, came: clock() };
  showStates();
  showState();
  showDetails();
  showFindings();
}

document.addEventListener("click", () => look && showFindings());
setInterval(showState, 500);
