"use strict";
// Selects a host, robot, program or network: lights its lines and what is at their other ends, and shows its details.

const diagram = JSON.parse(document.getElementById("diagram").textContent);
const picture = document.querySelector("svg.swarm");
const shapes = new Map([...picture.querySelectorAll("[data-id]")].map((shape) => [shape.dataset.id, shape]));
const lines = [...picture.querySelectorAll("[data-from]")];
const nodes = new Map(diagram.nodes.map((node) => [node.id, node]));
const ADD_DETAILS = []; // functions of a node that return elements for its details
const ON_SELECT = []; // functions of the selected id, or null
let selected = null;

/** An element with attributes and children; texts become text nodes, so that no name is HTML. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "onclick") made.addEventListener("click", value);
    else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

function select(id) {
  selected = id;
  const lit = new Set([id]);
  for (const line of lines) {
    const touches = line.dataset.from === id || line.dataset.to === id;
    line.classList.toggle("lit", touches);
    const tip = line.nextElementSibling;
    if (tip?.classList.contains("tip")) tip.classList.toggle("lit", touches);
    if (touches) lit.add(line.dataset.from).add(line.dataset.to);
  }
  for (const [name, shape] of shapes) {
    shape.classList.toggle("lit", lit.has(name));
    shape.setAttribute("aria-pressed", String(name === id));
  }
  picture.classList.toggle("chosen", id !== null);
  showDetails();
  for (const follow of ON_SELECT) follow(id);
}

/** What `edge` is to the node `id`: words before the name of its other end, and behind it. */
function edgeInWords(edge, id, other) {
  const label = edge.label ? ` (${edge.label})` : "";
  const outward = edge.start === id;
  if (edge.kind === "commands") return [outward ? "commands" : "commanded by", label];
  if (edge.kind === "data") return [outward ? "sends data to" : "gets data from", label];
  if (edge.kind === "network") return [outward ? "on network" : "hosts", ""];
  if (edge.kind === "runs") return [outward ? other.kind : "on host", ""];
  return [outward ? other.kind : "driven by host", `, ${edge.kind}${label}`];
}

/** The edges of a node in words, a line for all that differ only in the names of their other ends. */
function connections(id) {
  const names = new Map();
  for (const edge of diagram.edges) {
    if (edge.start !== id && edge.end !== id) continue;
    const other = nodes.get(edge.start === id ? edge.end : edge.start);
    const words = JSON.stringify(edgeInWords(edge, id, other));
    names.set(words, [...(names.get(words) ?? []), other.name]);
  }
  return [...names].map(([words, ends]) => JSON.parse(words).join(` ${ends.join(", ")}`));
}

function showDetails() {
  const node = nodes.get(selected);
  const details = document.getElementById("details");
  if (!node) {
    details.replaceChildren(element("p", { class: "soft" }, "Select a host, robot, program or network."));
    return;
  }
  const shown = element(
    "div",
    {},
    element("h2", {}, node.name, " ", element("small", {}, `${node.kind}, ${node.detail}`)),
    ...ADD_DETAILS.flatMap((add) => add(node)),
    element("ul", {}, ...connections(selected).map((words) => element("li", { class: "soft" }, words))),
  );
  if (details.firstChild?.outerHTML !== shown.outerHTML) details.replaceChildren(shown); // keeps a selected text
}

/** The node nearest to `id` in the direction of an arrow key. */
function neighbour(id, key) {
  const middle = (shape) => {
    const box = shape.querySelector(".shape").getBoundingClientRect();
    return [box.x + box.width / 2, box.y + Math.min(box.height, 46) / 2];
  };
  const [x, y] = middle(shapes.get(id));
  const [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
  let best = null;
  let least = Infinity;
  for (const [name, shape] of shapes) {
    const [left, top] = middle(shape);
    const along = (left - x) * dx + (top - y) * dy;
    const aside = Math.abs((left - x) * dy) + Math.abs((top - y) * dx);
    if (along > 1 && along + 3 * aside < least) [best, least] = [name, along + 3 * aside];
  }
  return best;
}

picture.style.minWidth = `${picture.viewBox.baseVal.width / 2}px`; // a name of a large swarm can be read
for (const [id, shape] of shapes) {
  const node = nodes.get(id);
  shape.setAttribute("tabindex", "0");
  shape.setAttribute("role", "button");
  shape.setAttribute("aria-label", `${node.kind} ${node.name}, ${node.detail}`);
  shape.addEventListener("click", () => select(id === selected ? null : id));
  shape.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") select(id === selected ? null : id);
    else if (event.key.startsWith("Arrow")) shapes.get(neighbour(id, event.key))?.focus();
    else return;
    event.preventDefault();
  });
}
document.addEventListener("keydown", (event) => event.key === "Escape" && select(null));
select(null);
