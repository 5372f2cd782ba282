// What the file holds beside scripts and the kernel: messages to the viewer, and the scenario.
import { camera, lines } from "./formulas.js";
import { locate } from "./rows.js";

const ARRAYS = { "<f4": Float32Array, "<f8": Float64Array, "|u1": Uint8Array, "<u4": Uint32Array, "<i4": Int32Array, "<i8": BigInt64Array };
const ROUNDING = 1e-9; // in the unit of any chart

/** Data, and first messages in the colours of the theme. */
export function load(dark) {
  const data = JSON.parse(window.slipgrasp.readText("sg-data"));
  const messages = dark ? replaced(data.messages, data.dark) : data.messages;
  const charts = data.charts.map((chart) => ({
    ...chart,
    columns: columnsOf(chart),
    read: readerOf(chart),
  }));
  const scenario = revive(data.run.scenario);
  const revived = { ...data, charts, run: { ...data.run, scenario }, scene: revive(data.scene) };
  return { data: revived, messages: revive(messages) };
}

/** Messages that put the camera in front of the hand, for a picture [px] of width, height, and height that a panel covers. */
export function cameraMessages({ camera: messages }, picture) {
  const values = new Float64Array(6);
  camera(picture, values);
  const [position, lookAt] = [[...values.subarray(0, 3)], [...values.subarray(3)]];
  return messages.map((message) => {
    const now = { ...message, initial: false };
    if (message.type === "SetCameraPositionMessage") return { ...now, position };
    return message.type === "SetCameraLookAtMessage" ? { ...now, look_at: lookAt } : now;
  });
}

/** Plain values with other parts, by key or place; a whole value stands under an empty key. */
function replaced(value, parts) {
  if (parts === null || parts === undefined) return value;
  if ("" in parts) return parts[""];
  if (Array.isArray(value)) return value.map((inner, k) => replaced(inner, parts[k]));
  return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, replaced(inner, parts[key])]));
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

/** Arrays as the viewer wants them, from {"$": type, "b": base64}. */
function revive(value) {
  if (Array.isArray(value)) return value.map(revive);
  if (value === null || typeof value !== "object") return value;
  if (value.$) return new ARRAYS[value.$](bytesOf(value.b).buffer);
  return Object.fromEntries(Object.entries(value).map(([key, inner]) => [key, revive(inner)]));
}

/** The columns of a chart: time, whether anything slips, the lines, and those of the ghost. */
function columnsOf({ key, count }) {
  const none = new Float64Array(0);
  return (own, ghost, hidden) => {
    const solid = linesOf(key, count, own);
    const pale = ghost ? readAt(linesOf(key, count, ghost), ghost, own.times) : [];
    const lines = [...solid, ...pale].map((line, k) => (hidden.has(k % count) ? none : line));
    const missing = Array(count - pale.length).fill(none);
    return [own.times, own.slipping, ...lines, ...missing];
  };
}

/** Lines of a chart for the rows of a run, computed once. */
function linesOf(key, count, run) {
  if (run.lines.has(key)) return run.lines.get(key);
  const [columns, values] = [Array.from({ length: count }, () => new Float64Array(run.count)), new Float64Array(count)];
  for (let k = 0; k < run.count; k++) {
    lines[key](run.row(k), values);
    columns.forEach((column, line) => (column[k] = values[line]));
  }
  run.lines.set(key, columns);
  return columns;
}

/** Lines of a run at the times of another one; not a number after its end. */
function readAt(columns, run, times) {
  const spots = Array.from(times, (time) => (time > run.end ? null : locate(run.times, time)));
  return columns.map((column) =>
    Float64Array.from(spots, (spot) => {
      if (spot === null) return NaN;
      return column[spot.row] + spot.weight * (column[spot.following] - column[spot.row]);
    }),
  );
}

/** What the lines of a chart show at a time, in words; rounding errors are 0. */
function readerOf({ key, count }) {
  const values = new Float64Array(count);
  return (own, time) => {
    lines[key](own.between(locate(own.times, time)), values);
    const shown = [...values].map((value) => (Math.abs(value) < ROUNDING ? 0 : value));
    return shown.map((value) => String(Number(value.toPrecision(3))).replace("-", "−"));
  };
}
