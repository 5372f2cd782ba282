// The contacts of a run as typed arrays, and what they hold at one instant. SI units throughout.

const TYPES = { f8: Float64Array, f4: Float32Array, i1: Int8Array };
const ALIGNED = 8; // bytes
const STICK = 0;
const POINTS_ACROSS = 100; // of a slip path, per reach of a close-up

/** A run of contacts, from the facts and arrays that slipgrasp.web.scene.close_ups lists. */
export class ContactRun {
  constructor(facts, arrays) {
    this.facts = facts;
    this.arrays = arrays;
    this.rows = arrays.times.length;
    this.count = facts.contacts.length;
    this.tangents = arrays.slip.length / (this.rows * this.count);
    this.trails = facts.contacts.map((_, i) => (this.tangents === 1 ? extremes : stations)(this, i));
  }

  /** Reads the bytes of slipgrasp.web.scene.close_ups.packed. */
  static unpack(bytes) {
    const { buffer } = bytes.slice(); // The arrays in it begin at multiples of their sizes.
    const length = Number(new DataView(buffer).getBigUint64(0, true));
    const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, ALIGNED, length)));
    let offset = ALIGNED + aligned(length);
    const arrays = {};
    for (const [name, type, shape] of facts.arrays) {
      const size = shape.reduce((product, each) => product * each, 1);
      arrays[name] = new TYPES[type](buffer, offset, size);
      offset += aligned(arrays[name].byteLength);
    }
    return new ContactRun(facts, arrays);
  }

  /** Contact i at a time: on straight lines between two samples, except for the slip. */
  at(i, time) {
    const spot = locate(this.arrays.times, time);
    const phase = this.arrays.phase[spot.row * this.count + i];
    const slip = this.slipAt(i, spot);
    return {
      phase,
      slips: phase !== STICK,
      slip,
      trail: this.tangents === 1 ? reached(this, i, spot.row, slip) : passed(this, i, spot.row, slip),
      velocity: this.read("velocity", i, spot),
      tangential: this.read("tangential", i, spot),
      normal: Math.max(this.read("normal", i, spot)[0], 0),
      friction: this.arrays.friction[spot.row * this.count + i],
      estimate: this.estimate(i, spot),
      spin: this.read("spin", i, spot)[0],
      moment: this.read("moment", i, spot)[0],
      link: this.read("link", i, spot)[0],
      ghost: this.ghost(i, time),
    };
  }

  /** Numbers of a contact between two samples; 0 where a hand has no such array. */
  read(name, i, spot) {
    const values = this.arrays[name];
    if (values === undefined) return [0];
    return between(values, values.length / this.rows / this.count, this.count, i, spot);
  }

  /** The slip on the cubic with the slip velocities of both samples; straight over a phase change. */
  slipAt(i, spot) {
    const { times, phase } = this.arrays;
    const slip = this.read("slip", i, spot);
    const isSamePhase = phase[spot.row * this.count + i] === phase[spot.next * this.count + i];
    if (this.facts.skipsChanges || !isSamePhase) return slip;
    const [from, to] = [0, 1].map((weight) => ({ ...spot, weight }));
    const [[start, end], [before, after]] = ["slip", "velocity"].map((name) =>
      [from, to].map((side) => this.read(name, i, side)),
    );
    return slip.map((straight, k) => {
      const [way, span, w] = [end[k] - start[k], times[spot.next] - times[spot.row], spot.weight];
      const bend = (1 - w) * (span * before[k] - way) - w * (span * after[k] - way);
      return straight + w * (1 - w) * bend;
    });
  }

  /** The friction coefficient that the controller estimates; null where it is known. */
  estimate(i, spot) {
    const [value] = this.read("estimate", i, spot);
    return Number.isNaN(value) ? null : Math.max(value, 0);
  }

  /** The slip of the ghost; null where it has no such contact. */
  ghost(i, time) {
    const { ghostTimes, ghostSlip } = this.arrays;
    if (ghostTimes === undefined || !this.facts.contacts[i].ghost) return null;
    const count = ghostSlip.length / this.tangents / ghostTimes.length;
    return between(ghostSlip, this.tangents, count, i, locate(ghostTimes, time));
  }
}

/** Where a time stands between samples; at that of an event, on its later side. */
export function locate(times, time) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  const row = Math.max(low - 1, 0);
  const next = Math.min(row + 1, times.length - 1);
  const span = times[next] - times[row];
  const weight = span > 0 ? Math.min(Math.max((time - times[row]) / span, 0), 1) : 0;
  return { row, next, weight };
}

function aligned(size) {
  return Math.ceil(size / ALIGNED) * ALIGNED;
}

function between(values, width, count, i, { row, next, weight }) {
  const [from, to] = [row, next].map((each) => (each * count + i) * width);
  return Array.from({ length: width }, (_, k) => {
    const start = values[from + k];
    return start + weight * (values[to + k] - start);
  });
}

/** Least and largest slip up to every sample, of a planar contact. */
function extremes({ arrays: { slip }, rows, count }, i) {
  const least = new Float32Array(rows);
  const largest = new Float32Array(rows);
  for (let row = 0; row < rows; row += 1) {
    const value = slip[row * count + i];
    least[row] = row > 0 ? Math.min(least[row - 1], value) : value;
    largest[row] = row > 0 ? Math.max(largest[row - 1], value) : value;
  }
  return { least, largest };
}

function reached(run, i, row, [slip]) {
  const { least, largest } = run.trails[i];
  return [Math.min(least[row], slip, 0), Math.max(largest[row], slip, 0)];
}

/** Samples at which a spatial fingertip has gone far enough on to be drawn. */
function stations({ arrays: { slip }, rows, count, facts }, i) {
  const step = facts.reach / POINTS_ACROSS;
  const found = [0];
  let last = [slip[2 * i], slip[2 * i + 1]];
  for (let row = 1; row < rows; row += 1) {
    const now = 2 * (row * count + i);
    const [x, y] = [slip[now] - last[0], slip[now + 1] - last[1]];
    if (x * x + y * y <= step * step) continue;
    found.push(row);
    last = [slip[now], slip[now + 1]];
  }
  return found;
}

function passed({ trails, arrays: { slip }, count }, i, row, tip) {
  const points = [];
  for (const station of trails[i]) {
    if (station > row) break;
    const at = 2 * (station * count + i);
    points.push([slip[at], slip[at + 1]]);
  }
  return [...points, tip];
}
