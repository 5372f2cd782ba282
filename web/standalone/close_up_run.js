// A run as the close-ups of the dashboard read it: arrays by the formulas of the program.
import { ContactRun } from "./contact_run.js";
import { closeUps } from "./formulas.js";

/** The contacts of a run, and the slip of its ghost or null. */
export function contactRun({ facts, held, scales, arrays }, own, ghost) {
  const largest = largestSlip(own);
  const [, reach, tick] = scales.find(([slip]) => slip >= largest) ?? scales.at(-1);
  const found = { times: own.times, held: Float32Array.from(held), phase: Int8Array.from(columns(own, "phase")) };
  for (const [name, length] of arrays) found[name] = new Float32Array(length * own.count);
  const values = new Float64Array(arrays.reduce((sum, [, length]) => sum + length, 0));
  for (let row = 0; row < own.count; row++) {
    closeUps(own.row(row), values);
    let at = 0;
    for (const [name, length] of arrays) {
      found[name].set(values.subarray(at, at + length), row * length);
      at += length;
    }
  }
  if (ghost !== null) Object.assign(found, { ghostTimes: ghost.times, ghostSlip: columns(ghost, "slip") });
  return new ContactRun({ ...facts, reach, tick }, found);
}

/** The numbers of a signal, row after row. */
function columns(run, name) {
  const [first, width] = run.columns[name];
  const values = new Float64Array(run.count * width);
  for (let row = 0; row < run.count; row++) {
    values.set(run.row(row).subarray(first, first + width), row * width);
  }
  return values;
}

function largestSlip(own) {
  let most = 0;
  for (let row = 0; row < own.count; row++) {
    for (let k = 0; k < own.columns.phase[1]; k++) most = Math.max(most, Math.hypot(...own.slipOf(row, k)));
  }
  return most;
}
