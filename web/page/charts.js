// The charts. The session writes lines and legends; this puts into them what moves:
//   data-sg-chart      the head of a chart, right above its lines
//   data-sg-value      in a head: what a line shows at the play head
//   data-sg-readings   hidden: these values, by chart, and when parameters change [s]
// A drag over a chart shows that stretch of time in all charts, a click puts the play head
// there, a double click shows the whole run.
import { hold, onFrame, shareOf, state } from "./session_state.js";
import { post } from "./post.js";

const LEAST_DRAG = 4;
const readings = new WeakMap();
let drag = null;

/** Begins to fill in, and to listen. */
export function startCharts() {
  onFrame(fillIn);
  document.addEventListener("pointerdown", onPress);
  document.addEventListener("dblclick", onDoubleClick);
  // viser has a short cut on Escape; while something is dragged it only ends that.
  document.addEventListener("keydown", onKey, { capture: true });
}

function fillIn() {
  const values = {};
  let changes = [];
  for (const element of document.querySelectorAll("[data-sg-readings]")) {
    const read = readingsOf(element);
    Object.assign(values, read.values);
    changes = read.changes;
  }
  for (const head of document.querySelectorAll("[data-sg-chart]")) {
    writeValues(head, values[head.dataset.sgChart] ?? []);
    const area = areaOf(head);
    if (area) mark(area, changes);
  }
}

function readingsOf(element) {
  const text = element.dataset.sgReadings;
  if (readings.get(element)?.text !== text) {
    readings.set(element, { text, ...JSON.parse(text) });
  }
  return readings.get(element);
}

function writeValues(head, values) {
  head.querySelectorAll("[data-sg-value]").forEach((cell, i) => {
    const value = values[i] ?? "";
    if (cell.textContent !== value) cell.textContent = value;
  });
}

/** The area of the lines that belong to a head; null while they are not drawn. */
function areaOf(head) {
  let element = head;
  while (element && !element.nextElementSibling) element = element.parentElement;
  return element?.nextElementSibling.querySelector(".u-over") ?? null;
}

/** Puts the play head, the changes and what is dragged over into an area. */
function mark(area, changes) {
  let marks = area.querySelector(":scope > .sg-marks");
  if (!marks) {
    marks = document.createElement("div");
    marks.className = "sg-marks";
    marks.innerHTML =
      '<i class="sg-dragged" hidden></i><i class="sg-chart-head" data-sg-head></i>';
    area.append(marks);
  }
  const wanted = `${state.start} ${state.end} ${changes}`;
  if (marks.dataset.changes === wanted) return;
  marks.dataset.changes = wanted;
  marks.querySelectorAll(".sg-change").forEach((line) => line.remove());
  for (const change of changes) {
    if (change < state.start || change > state.end) continue;
    const line = document.createElement("i");
    line.className = "sg-change";
    line.style.left = `${100 * shareOf(change)}%`;
    marks.prepend(line);
  }
}

function areas() {
  const heads = [...document.querySelectorAll("[data-sg-chart]")];
  return heads.map(areaOf).filter((area) => area !== null);
}

function areaUnder(event) {
  const area = event.target.closest?.(".u-over");
  return area && areas().includes(area) ? area : null;
}

function onPress(event) {
  const area = areaUnder(event);
  if (!area || event.button !== 0) return;
  const { left, width } = area.getBoundingClientRect();
  drag = { left, width: Math.max(width, 1), from: event.clientX, to: event.clientX };
  window.addEventListener("pointermove", onMove);
  window.addEventListener("pointerup", onRelease);
  window.addEventListener("pointercancel", endDrag);
}

function onMove(event) {
  drag.to = event.clientX;
  showDragged();
}

function onRelease(event) {
  drag.to = event.clientX;
  const [start, end] = [drag.from, drag.to].map(timeAt).sort((a, b) => a - b);
  if (isDragged()) {
    post({ kind: "show-window", start, end });
  } else {
    hold(start);
    post({ kind: "seek", time: start });
  }
  endDrag();
}

function onDoubleClick(event) {
  if (areaUnder(event)) post({ kind: "choose-window", choice: "whole run" });
}

function onKey(event) {
  if (event.key !== "Escape" || drag === null) return;
  event.stopPropagation();
  endDrag();
}

function endDrag() {
  drag = null;
  showDragged();
  window.removeEventListener("pointermove", onMove);
  window.removeEventListener("pointerup", onRelease);
  window.removeEventListener("pointercancel", endDrag);
}

function isDragged() {
  return drag !== null && Math.abs(drag.to - drag.from) >= LEAST_DRAG;
}

function timeAt(x) {
  const share = Math.min(Math.max((x - drag.left) / drag.width, 0), 1);
  return state.start + share * (state.end - state.start);
}

/** Shades the stretch of time that is dragged over, in every chart. */
function showDragged() {
  const shares = isDragged() ? [drag.from, drag.to].map((x) => shareOf(timeAt(x))) : null;
  for (const element of document.querySelectorAll(".sg-dragged")) {
    element.hidden = shares === null;
    if (shares === null) continue;
    element.style.left = `${100 * Math.min(...shares)}%`;
    element.style.width = `${100 * Math.abs(shares[1] - shares[0])}%`;
  }
}
