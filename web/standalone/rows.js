// The rows of a run, and what lies between them.

/** The last row that is not after a time, the one after it, and how far on the way the time is. */
export function locate(times, time) {
  let [low, high] = [0, times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= time) low = middle;
    else high = middle - 1;
  }
  const following = Math.min(low + 1, times.length - 1);
  const span = times[following] - times[low];
  const weight = span > 0 ? Math.min(Math.max((time - times[low]) / span, 0), 1) : 0;
  return { row: low, following, weight };
}

/** What the worker reads of the rows of a run, apart from their times. */
export function statesOf({ num_columns, columns }) {
  return { width: num_columns, phase: columns.phase };
}

export class Rows {
  constructor({ rows, changes, ...facts }, { columns, num_columns }) {
    Object.assign(this, { rows, columns, ...facts, rawChanges: changes });
    this.width = num_columns;
    this.count = rows.length / num_columns;
    this.times = this.column(columns.times[0]);
    this.end = this.times[this.count - 1];
    this.lines = new Map(); // of charts, by the chart's key
    this.changes = [];
    for (let k = 0; k < changes.length; k += 4) {
      const [time, finger, , phase] = changes.subarray(k, k + 4);
      this.changes.push({ time, finger, phase });
    }
    this.reach = reachOf(this);
    const [phase, fingers] = columns.phase;
    this.slipping = Float64Array.from({ length: this.count }, (_, k) =>
      Number(this.row(k).subarray(phase, phase + fingers).some((each) => each !== 0)),
    );
  }

  row(k) {
    return this.rows.subarray(k * this.width, (k + 1) * this.width);
  }

  /** Slip of a finger in a row, along each tangent [m]. */
  slipOf(k, finger) {
    const [first, width] = this.columns.slip;
    const tangents = width / this.columns.phase[1];
    return this.row(k).subarray(first + finger * tangents, first + (finger + 1) * tangents);
  }

  column(k) {
    return Float64Array.from({ length: this.count }, (_, row) => this.rows[row * this.width + k]);
  }

  /** What the formulas of the scene read: rows on both sides, and the extremes of slip so far. */
  at(time) {
    const { row, following, weight } = locate(this.times, time);
    const [least, largest] = [this.row(row).slice(), this.row(row).slice()];
    const [first, width] = this.columns.slip;
    for (let k = 0; k < width; k++) {
      least[first + k] = this.reach.least[row * width + k];
      largest[first + k] = this.reach.largest[row * width + k];
    }
    const [phase, fingers] = this.columns.phase;
    const phases = [...this.row(row).subarray(phase, phase + fingers)];
    return { time, rows: [least, largest, this.row(row), this.row(following)], weight, phases };
  }

  /** A row between two others. */
  between({ row, following, weight }) {
    const after = this.row(following);
    return this.row(row).map((value, k) => value + weight * (after[k] - value));
  }

  /** Spans of one phase of a finger: phase, start and end [s]. */
  *spans(finger) {
    let [phase, start] = [this.rows[this.columns.phase[0] + finger], 0];
    for (const change of this.changes) {
      if (change.finger !== finger) continue;
      yield { phase, start, end: change.time };
      [phase, start] = [change.phase, change.time];
    }
    yield { phase, start, end: this.end };
  }
}

function reachOf({ count, rows, width, columns }) {
  const [first, slips] = columns.slip;
  const least = new Float64Array(count * slips);
  const largest = new Float64Array(count * slips);
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < slips; k++) {
      const [at, before] = [row * slips + k, Math.max(row - 1, 0) * slips + k];
      const slip = rows[row * width + first + k];
      least[at] = row ? Math.min(least[before], slip) : slip;
      largest[at] = row ? Math.max(largest[before], slip) : slip;
    }
  }
  return { least, largest };
}
