"use strict";
// The arena: where robots are by their odometry, and their trails. Robots with a declared start share one map.

const APART = 1; // m between the origins of robots whose start is not declared
const LEAST = 2; // m that are shown at least
const PIXELS = 46; // around the picture
const starts = JSON.parse(document.getElementById("starts").textContent);
const arena = document.getElementById("arena");
const canvas = arena.querySelector("canvas");
const known = diagram.nodes.filter((node) => node.kind === "robot").map((node) => node.name);
const places = new Map(); // by robot: where its odometry begins, [x, y, yaw]
let painted = 0;

for (const name of known) {
  places.set(name, starts[name] ?? [APART * [...places.keys()].filter((one) => !starts[one]).length, 0, 0]);
}

/** A pose of odometry in the map. */
function inMap(name, [x, y, yaw]) {
  const [left, up, turn] = places.get(name);
  return [left + x * Math.cos(turn) - y * Math.sin(turn), up + x * Math.sin(turn) + y * Math.cos(turn), yaw + turn];
}

/** What is drawn: by robot, its trail with the latest pose last. */
function trails() {
  const found = new Map();
  for (const name of known) {
    const history = robots.get(name)?.history ?? [];
    const poses = history.filter((one) => one.pose).map((one) => inMap(name, one.pose));
    if (poses.length) found.set(name, poses);
  }
  return found;
}

/** How metres become pixels: [scale, x of the map's origin, y of it]. */
function fitted(found) {
  const points = [...found.values()].flat();
  const range = (axis) => [Math.min(...points.map((one) => one[axis])), Math.max(...points.map((one) => one[axis]))];
  const [[left, right], [low, high]] = [range(0), range(1)];
  const [width, height] = [Math.max(right - left, LEAST), Math.max(high - low, LEAST)];
  const [wide, tall] = [canvas.clientWidth, canvas.clientHeight];
  const scale = Math.min((wide - 2 * PIXELS) / width, (tall - 2 * PIXELS) / height);
  return [scale, wide / 2 - (scale * (left + right)) / 2, tall / 2 + (scale * (low + high)) / 2];
}

function paint() {
  requestAnimationFrame(paint);
  if (arena.hidden) return;
  const brush = canvas.getContext("2d");
  const ratio = window.devicePixelRatio || 1;
  const [wide, tall] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== wide * ratio) [canvas.width, canvas.height] = [wide * ratio, tall * ratio];
  brush.setTransform(ratio, 0, 0, ratio, 0, 0);
  brush.clearRect(0, 0, wide, tall);
  const found = trails();
  canvas.dataset.frames = String(++painted);
  if (!found.size) return;
  const style = getComputedStyle(document.body);
  const colour = (name) => style.getPropertyValue(name);
  const [scale, x0, y0] = fitted(found);
  grid(brush, scale, x0, y0, colour);
  const rows = look ? rowsOf(look.status) : new Map();
  for (const [name, trail] of found) {
    const state = (look && stateOf(`robot:${name}`, rows)) ?? "unknown";
    robot(brush, name, trail.map(([x, y, yaw]) => [x0 + scale * x, y0 - scale * y, -yaw]), colour(`--${state}`), colour);
  }
}

/** Lines of round numbers of metres, at least 60 px apart, with these numbers. */
function grid(brush, scale, x0, y0, colour) {
  let step = 0.1;
  for (const factor of [2, 2.5, 2, 2, 2.5, 2, 2, 2.5, 2]) if (scale * step < 60) step *= factor;
  brush.strokeStyle = colour("--line");
  brush.fillStyle = colour("--soft");
  brush.font = "11px system-ui, sans-serif";
  brush.textAlign = "left";
  brush.lineWidth = 1;
  const words = (value) => `${Number(value.toFixed(2))} m`;
  for (let x = Math.ceil(-x0 / scale / step) * step; x0 + scale * x < canvas.clientWidth; x += step) {
    line(brush, [[x0 + scale * x, 0], [x0 + scale * x, canvas.clientHeight]]);
    brush.fillText(words(x), x0 + scale * x + 3, canvas.clientHeight - 4);
  }
  for (let y = Math.ceil((y0 - canvas.clientHeight) / scale / step) * step; y0 - scale * y > 0; y += step) {
    line(brush, [[0, y0 - scale * y], [canvas.clientWidth, y0 - scale * y]]);
    brush.fillText(words(y), 3, y0 - scale * y - 3);
  }
}

function line(brush, points) {
  brush.beginPath();
  for (const [x, y] of points) brush.lineTo(x, y);
  brush.stroke();
}

/** An arrow head where the robot looks, its trail and its name. */
function robot(brush, name, trail, fill, colour) {
  const [x, y, yaw] = trail[trail.length - 1];
  brush.strokeStyle = fill;
  brush.globalAlpha = 0.45;
  brush.lineWidth = 2;
  line(brush, trail);
  brush.globalAlpha = 1;
  brush.save();
  brush.translate(x, y);
  brush.rotate(yaw);
  brush.fillStyle = fill;
  brush.strokeStyle = colour(selected === `robot:${name}` ? "--network" : "--ink");
  brush.lineWidth = selected === `robot:${name}` ? 3 : 1;
  brush.beginPath();
  for (const [dx, dy] of [[13, 0], [-9, 8], [-5, 0], [-9, -8]]) brush.lineTo(dx, dy);
  brush.closePath();
  brush.fill();
  brush.stroke();
  brush.restore();
  brush.fillStyle = colour("--ink");
  brush.font = "600 12px system-ui, sans-serif";
  brush.textAlign = "center";
  brush.fillText(name, x, y - 15);
}

/** The robot nearest to a place of the canvas, if one is near. */
function robotAt(x, y) {
  const found = trails();
  if (!found.size) return null;
  const [scale, x0, y0] = fitted(found);
  const near = [...found].map(([name, trail]) => {
    const [left, up] = trail[trail.length - 1];
    return [Math.hypot(x0 + scale * left - x, y0 - scale * up - y), name];
  });
  const [distance, name] = near.sort(([one], [other]) => one - other)[0];
  return distance < 30 ? name : null;
}

canvas.addEventListener("click", (event) => {
  const name = robotAt(event.offsetX, event.offsetY);
  select(name ? `robot:${name}` : null);
});

const tabs = [...document.querySelectorAll("[data-tab]")];
function choose(tab) {
  for (const one of tabs) {
    one.setAttribute("aria-pressed", String(one === tab));
    document.getElementById(one.dataset.tab).hidden = one !== tab;
  }
}
for (const tab of tabs) tab.addEventListener("click", () => choose(tab));

const placeless = known.filter((name) => !starts[name]);
if (placeless.length) {
  document.getElementById("placeless").textContent =
    `The spec has no start pose of ${placeless.join(", ")}: drawn side by side, each from its own origin.`;
}
paint();
