"use strict";
// The replay of a recorded run: the slider is the clock of the page, and robots have reported what was recorded.

const run = new Map(); // by robot, its reports in the order of time
const slider = document.getElementById("slider");
const button = document.getElementById("play");
let shownTime = 0; // ms since 1970
let playedAt = null; // when the last frame was drawn, ms; null if it does not play

for (const [name, rows] of Object.entries(JSON.parse(document.getElementById("run").textContent))) {
  run.set(name, rows.map(([seconds, pose, driven, commanded, battery]) => (
    { at: Math.round(1000 * seconds), pose, driven, commanded, battery, commander: null })));
}
const first = Math.min(...[...run.values()].map((reports) => reports[0].at));
const last = Math.max(...[...run.values()].map((reports) => reports[reports.length - 1].at));

/** How many reports are not after `time`. */
function countUntil(reports, time) {
  let [low, high] = [0, reports.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (reports[middle].at <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Shows the page as it was at `time`. */
function showTime(time) {
  shownTime = time;
  for (const [name, reports] of run) {
    const end = countUntil(reports, time);
    const begin = Math.min(countUntil(reports, time - 1000 * KEPT), end - 1); // the last pose stays
    if (end) robots.set(name, { ...UNKNOWN, ...reports[end - 1], history: reports.slice(begin, end) });
    else robots.delete(name);
  }
  const words = `${new Date(time).toLocaleTimeString("en-GB")}.${Math.floor((time % 1000) / 100)}`;
  slider.value = time;
  slider.setAttribute("aria-valuetext", words);
  document.getElementById("time").textContent = words;
}

function play(now) {
  if (playedAt === null) return;
  showTime(Math.min(shownTime + now - playedAt, last));
  playedAt = now;
  if (shownTime === last) setPlaying(false);
  else requestAnimationFrame(play);
}

function setPlaying(on) {
  playedAt = on ? performance.now() : null;
  button.textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(play);
}

clock = () => shownTime;
slider.min = first;
slider.max = first + slider.step * Math.ceil((last - first) / slider.step);
slider.addEventListener("input", () => showTime(Number(slider.value)));
button.addEventListener("click", () => {
  if (shownTime >= last) showTime(first);
  setPlaying(playedAt === null);
});
showTime(first);
