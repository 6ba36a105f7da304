"use strict";
// How robots move, several times a second: what each reports, and a plot of the selected one's speed.

const FRESH = 2000; // ms after which a report is old
const KEPT = 60; // s of the plot
const UNKNOWN = { pose: null, driven: null, commanded: null, commander: "", trouble: "", held: false, battery: null, missing: false, since: 0 };
const robots = new Map(); // by name: as UNKNOWN, with when it was reported and its history; times in ms
let plot = null;
let trial = null; // the one that goes on: its name, when it ends, and when a host last sent that, ms

/** Takes a message of one host: {robots, missing, trial, left}. */
function takeTelemetry(message) {
  const at = clock();
  for (const name of new Set([...Object.keys(message.robots), ...message.missing])) {
    const before = robots.get(name) ?? { ...UNKNOWN, history: [] };
    const report = message.robots[name];
    const now = { ...before, ...report, at, missing: message.missing.includes(name) };
    const changed = now.trouble !== before.trouble || now.missing !== before.missing;
    if (report) now.history.push({ at, ...report });
    while (now.history[0]?.at < at - 1000 * KEPT) now.history.shift();
    robots.set(name, { ...now, since: changed ? at : before.since });
  }
  if (message.trial) trial = { name: message.trial, end: at + 1000 * message.left, at };
  if (!look) return;
  showStates();
  showState();
}

/** The trial that goes on, and the time that is left. */
function showTrial() {
  const place = document.getElementById("trial");
  place.hidden = !trial || clock() - trial.at > FRESH;
  if (!place.hidden) place.textContent = `${trial.name}: ${Math.max(0, Math.ceil((trial.end - clock()) / 1000))} s left`;
}

setInterval(showTrial, 250);

/** The last report of a robot; null if it is old. */
function reportOf(name) {
  const robot = robots.get(name);
  return robot && clock() - robot.at <= FRESH ? robot : null;
}

/** What a robot reports now that is wrong, as text; empty if it is fine, or has not reported lately. */
function troubleOf(id) {
  const robot = id.startsWith("robot:") ? reportOf(id.replace("robot:", "")) : null;
  return robot?.trouble || (robot?.missing ? "its device is missing" : "");
}

/** True if what is wrong with a robot came after the last look, which has `state`: else the look decides. */
function isNewTrouble(id, state) {
  if (!troubleOf(id)) return false;
  const looked = look.came - 1000 * look.age;
  return ["ok", "warning"].includes(state) && robots.get(id.replace("robot:", "")).since > looked;
}

/** The troubles that no look has shown yet. */
function troubles() {
  const rows = rowsOf(look.status);
  return [...robots.keys()]
    .filter((name) => isNewTrouble(`robot:${name}`, rows.get(`robot:${name}`)?.state))
    .map((name) => `${name}: ${troubleOf(`robot:${name}`)}`);
}

ADD_DETAILS.push((node) => {
  const robot = node.kind === "robot" ? reportOf(node.name) : null;
  if (!robot) return [];
  const trouble = troubleOf(node.id);
  const isNew = trouble && look && isNewTrouble(node.id, rowsOf(look.status).get(node.id)?.state);
  return [
    ...(isNew ? [element("p", {}, mark("unknown"), ` ${trouble}`)] : []),
    ...(robot.held ? [element("p", {}, "stopped by swarmctl stop")] : []),
    ...(robot.battery === null ? [] : [element("p", {}, `battery ${Math.round(100 * robot.battery)} %`)]),
  ];
});

/** The series of the plot: s before now, then m/s commanded and driven, then rad/s. */
function series(history) {
  const now = clock();
  const line = (of) => history.map((one) => of(one) ?? null);
  return [
    line((one) => (one.at - now) / 1000),
    line((one) => one.commanded?.[0]),
    line((one) => one.driven?.[0]),
    line((one) => one.commanded?.[1]),
    line((one) => one.driven?.[1]),
  ];
}

function newPlot(place) {
  const colour = (name) => getComputedStyle(document.body).getPropertyValue(name);
  const [ink, grid] = [colour("--soft"), { stroke: colour("--line"), width: 1 }];
  const speed = (label, scale, stroke, dash) => ({ label, scale, stroke: colour(stroke), dash, width: 2 });
  const around = (least) => ({ range: (_, low, high) => [Math.min(low ?? 0, -least), Math.max(high ?? 0, least)] });
  const axis = (more) => ({ stroke: ink, grid, size: 40, ...more });
  return new uPlot(
    {
      width: place.clientWidth,
      height: 190,
      legend: { live: false },
      scales: { x: { time: false, range: [-KEPT, 0] }, linear: around(0.1), angular: around(0.5) },
      series: [
        { label: "s" },
        speed("m/s commanded", "linear", "--commands", [6, 4]),
        speed("m/s driven", "linear", "--network"),
        speed("rad/s commanded", "angular", "--warning", [6, 4]),
        speed("rad/s driven", "angular", "--data"),
      ],
      axes: [axis({ size: 30 }), axis({ size: 50, scale: "linear" }), axis({ size: 50, scale: "angular", side: 1, grid: { show: false } })],
    },
    series([]),
    place,
  );
}

function showPlot(id) {
  const place = document.getElementById("plot");
  const shown = id?.startsWith("robot:") ?? false;
  document.getElementById("motion").hidden = !shown;
  if (!shown) return;
  plot ??= newPlot(place);
  plot.setData(series(robots.get(id.replace("robot:", ""))?.history ?? []));
}

ON_SELECT.push(showPlot);
setInterval(() => {
  showPlot(selected);
  showDetails();
}, 200);
