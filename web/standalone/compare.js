// Compares a recording with the run that this page simulates of the same scenario, bit by bit.

/** Values of the sliders with which the page simulates the scenario of a recording. */
export function valuesFor({ documents }, { recording, controls, run }) {
  const start = documents[recording.documents.start];
  if (start?.format !== recording.format) throw new Error(`it has format ${start?.format ?? "of another program"}, this page reads ${recording.format}`);
  const own = flat(recording.scenario);
  const other = flat(JSON.parse(documents[recording.documents.scenario]));
  const values = new Map();
  for (const { key, low, high } of controls) {
    const places = [...own.keys()].filter((each) => run.fingers.some((_, finger) => isWithin(each, key.replace("*", finger))));
    if (places.every((place) => own.get(place) === other.get(place))) continue;
    const found = new Set(places.map((place) => other.get(place)));
    const [value] = found;
    if (found.size > 1 || !(value >= low && value <= high)) continue;
    values.set(key, value);
    for (const place of places) own.set(place, value);
  }
  for (const key of new Set([...own.keys(), ...other.keys()])) {
    if (own.get(key) !== other.get(key)) throw new Error(`its scenario is another one: ${key} is ${other.get(key)}, here ${own.get(key)}; 'slipgrasp page' writes a page of any recording`);
  }
  return values;
}

/** The first difference between a recording and a run, in words; empty if there is none. */
export function firstDifference(read, own, { recording, run }) {
  const start = read.documents[recording.documents.start];
  const { names, changeNames } = recording;
  const sample = firstIn(read.rows, own.rows, names.length);
  if (read.twice.row < (sample?.row ?? Infinity)) {
    return wordsOf(names[read.twice.column], own.times[read.twice.row], read.twice.value, own.times[read.twice.row]);
  }
  const told = (table, names, { row, column }, mine) =>
    wordsOf(names[column], mine[row * names.length], table[row * names.length + column], mine[row * names.length + column]);
  const change = firstIn(read.changes, own.rawChanges, changeNames.length);
  const outcome = read.documents[recording.documents.stop]?.outcome;
  const mine = run.ends[own.status].outcome;
  let found = "";
  if (sample) found = told(read.rows, names, sample, own.rows);
  else if (read.rows.length !== own.rows.length) found = wordsOf("the number of samples", own.end, read.rows.length / names.length, own.count);
  else if (change) found = `phase change ${change.row + 1}: ${told(read.changes, changeNames, change, own.rawChanges)}`;
  else if (read.changes.length !== own.rawChanges.length) found = wordsOf("the number of phase changes", own.end, read.changes.length / changeNames.length, own.changes.length);
  else if (outcome !== mine) found = wordsOf("the outcome", own.end, outcome, mine);
  const isOther = found && start.kernel !== recording.kernel;
  return isOther ? `${found} (it was computed by other numerics: ${start.kernel}, here ${recording.kernel})` : found;
}

function wordsOf(name, time, recorded, computed) {
  return `${name} at ${time} s: recorded ${recorded}, computed ${computed}`;
}

/** Row and column of the first number with other bits, null if there is none. */
function firstIn(recorded, computed, width) {
  const [a, b] = [recorded, computed].map(({ buffer, length }) => new BigUint64Array(buffer, 0, length));
  const count = Math.min(a.length, b.length);
  for (let k = 0; k < count; k++) if (a[k] !== b[k]) return { row: Math.floor(k / width), column: k % width };
  return null;
}

/** Plain values by dotted keys. */
function flat(value, key = "", found = new Map()) {
  if (value === null || typeof value !== "object") return found.set(key, value);
  for (const [name, inner] of Object.entries(value)) flat(inner, key ? `${key}.${name}` : name, found);
  return found;
}

function isWithin(key, wanted) {
  return key === wanted || key.startsWith(`${wanted}.`);
}
