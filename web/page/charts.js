// The charts. The session writes lines and legends; this puts into them what moves:
//   data-sg-chart      the head of a chart, right above its lines
//   data-sg-value      in a head: what a line shows at the play head
//   data-sg-readings   hidden: these values, by chart, and their time [s], when parameters change and
//                      where the second cursor stands [s], and where the spots of XY charts are
//   data-sg-xy         an XY chart, with a spot for each curve at either cursor
// A drag over a chart shows that time range in all charts, a click puts the play head
// there, one with Shift the second cursor, a double click shows the whole run.
import { hold, onFrame, shareOf, state } from "./session_state.js";
import { zoom } from "./gestures.js";
import { post } from "./post.js";

const LEAST_DRAG = 4;
const MOST_DECIMALS = 12;
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

function fillIn(time) {
  const values = {};
  const [spots, marked] = [{}, {}];
  const charts = Object.values(window.__viserTestpoints?.uplots ?? {}).map(({ chart }) => chart);
  let [changes, second] = [[], null];
  for (const element of document.querySelectorAll("[data-sg-readings]")) {
    const read = readingsOf(element);
    // Until the session has read this time, the drawn lines are read.
    const isRead = read.mark !== null || read.time === time;
    for (const [key, texts] of Object.entries(read.values)) values[key] = { texts, isRead };
    Object.assign(spots, read.spots);
    Object.assign(marked, read.marked);
    if (read.changes.length > 0) changes = read.changes;
    second = read.mark;
  }
  for (const head of document.querySelectorAll("[data-sg-chart]")) {
    const area = areaOf(head);
    const chart = charts.find(({ over }) => over === area);
    const { texts, isRead } = values[head.dataset.sgChart] ?? { texts: [], isRead: true };
    writeValues(head, isRead || !chart ? texts : readLines(head, chart, texts, time));
    if (!area) continue;
    if (chart) labelTicks(chart);
    if (chart) placeRange(chart);
    mark(area, changes, second);
  }
  for (const picture of document.querySelectorAll("[data-sg-xy]")) {
    putSpots(picture.querySelectorAll("[data-sg-spot]"), spots[picture.dataset.sgXy] ?? []);
    putSpots(picture.querySelectorAll("[data-sg-marked]"), marked[picture.dataset.sgXy] ?? []);
  }
}

/** Moves the spots of an XY chart; one without a place is not seen. */
function putSpots(circles, places) {
  circles.forEach((circle, i) => {
    const place = places[i];
    const isSeen = place !== undefined && place.every(Number.isFinite);
    const wanted = isSeen ? { cx: place[0], cy: place[1], r: 4.5 } : { r: 0 };
    for (const [name, value] of Object.entries(wanted)) {
      if (circle.getAttribute(name) !== String(value)) circle.setAttribute(name, value);
    }
  });
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

/** The values of the drawn lines at a time, in the format of these texts for another time. */
function readLines(head, { data: [times, , ...lines] }, texts, time) {
  const example = texts.find((text) => /\d/.test(text)) ?? "0.000";
  const isDrawn = [...head.querySelectorAll("[aria-pressed]")].map(({ ariaPressed }) => ariaPressed === "true");
  const columns = lines.values();
  return texts.map((_, i) => {
    if (!isDrawn[i]) return "";
    const value = interpolate(times, columns.next().value ?? [], time);
    return Number.isFinite(value) ? inFormatOf(example, value) : "–";
  });
}

function inFormatOf(example, value) {
  if (example.includes("e")) return value.toExponential(3);
  const decimals = example.split(".")[1]?.length ?? 0;
  // Not "-0.000".
  return (Number(value.toFixed(decimals)) + 0).toFixed(decimals);
}

/** A value between samples; of two samples at one time, the later one counts. */
function interpolate(times, values, time) {
  const after = times.findIndex((each) => each > time);
  if (after < 1) return after < 0 ? values[times.length - 1] : NaN;
  const share = (time - times[after - 1]) / (times[after] - times[after - 1]);
  return values[after - 1] + share * (values[after] - values[after - 1]);
}

/** The area of the lines that belong to a head; null while they are not drawn. */
function areaOf(head) {
  let element = head;
  while (element && !element.nextElementSibling) element = element.parentElement;
  return element?.nextElementSibling.querySelector(".u-over") ?? null;
}

/** Draws the time range of the state, as soon as the chart has another one. */
function placeRange(chart) {
  const { start: min, end: max } = state;
  const shown = chart.scales.x;
  if (shown && (shown.min !== min || shown.max !== max)) chart.setScale("x", { min, max });
}

/** Writes ticks with as many decimals as distinguish them; uPlot itself stops at three. */
function labelTicks(chart) {
  for (const axis of chart.axes) {
    if (axis.values !== writeTicks) axis.values = writeTicks;
  }
}

function writeTicks(_chart, ticks, _axis, _space, step) {
  const decimals = [...Array(MOST_DECIMALS).keys()].find((count) => isWhole(step * 10 ** count));
  return ticks.map((tick) => (tick === null ? null : String(Number(tick.toFixed(decimals ?? MOST_DECIMALS)))));
}

function isWhole(value) {
  return value >= 0.5 && Math.abs(value - Math.round(value)) < 1e-6 * value;
}

/** Puts the play head, the changes and what is dragged over into an area. */
function mark(area, changes, second) {
  let marks = area.querySelector(":scope > .sg-marks");
  if (!marks) {
    marks = document.createElement("div");
    marks.className = "sg-marks";
    marks.innerHTML =
      '<i class="sg-dragged" hidden></i><i class="sg-chart-head" data-sg-head></i>';
    area.append(marks);
  }
  const wanted = `${state.start} ${state.end} ${changes} ${second}`;
  if (marks.dataset.changes === wanted) return;
  marks.dataset.changes = wanted;
  marks.querySelectorAll(".sg-change, .sg-second").forEach((line) => line.remove());
  for (const change of changes) addLine(marks, change, "sg-change");
  if (second !== null) addLine(marks, second, "sg-second");
}

function addLine(marks, time, kind) {
  if (time < state.start || time > state.end) return;
  const line = document.createElement("i");
  line.className = kind;
  line.style.left = `${100 * shareOf(time)}%`;
  marks.prepend(line);
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
    zoom(start, end);
  } else if (event.shiftKey) {
    post({ kind: "place-mark", time: start });
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

/** Shades the time range that is dragged over, in every chart. */
function showDragged() {
  const shares = isDragged() ? [drag.from, drag.to].map((x) => shareOf(timeAt(x))) : null;
  for (const element of document.querySelectorAll(".sg-dragged")) {
    element.hidden = shares === null;
    if (shares === null) continue;
    element.style.left = `${100 * Math.min(...shares)}%`;
    element.style.width = `${100 * Math.abs(shares[1] - shares[0])}%`;
  }
}
