// Runs scenarios with slipgrasp.wasm, in a page, a worker or Node: docs/webassembly.md.

const LINE = 64; // bytes; every record begins on a cache line
const PAGE = 65536; // bytes of WebAssembly's memory

// From the bytes of the file to a kernel with memory for one run.
export async function loadKernel(bytes) {
  const module = await WebAssembly.compile(bytes);
  const [section] = WebAssembly.Module.customSections(module, "slipgrasp");
  const layout = JSON.parse(new TextDecoder().decode(section));
  const { exports } = await WebAssembly.instantiate(module);
  const at = {};
  let end = exports.__heap_base.value;
  for (const [name, { size }] of Object.entries(layout.records)) {
    at[name] = Math.ceil(end / LINE) * LINE;
    end = at[name] + size;
  }
  const missing = end - exports.memory.buffer.byteLength;
  if (missing > 0) exports.memory.grow(Math.ceil(missing / PAGE));
  return { exports, layout, at };
}

// Views of a field of a record: Float64Array, or BigInt64Array for whole numbers.
export function field(kernel, record, name) {
  const [offset, type, shape] = kernel.layout.records[record].fields[name];
  const length = shape.reduce((product, count) => product * count, 1);
  const Numbers = type === "<f8" ? Float64Array : BigInt64Array;
  return new Numbers(kernel.exports.memory.buffer, kernel.at[record] + offset, length);
}

// A run without patches, segment by segment; a segment lasts until its `end` [s].
class AnyRun {
  constructor(kernel, segments, columns) {
    Object.assign(this, { kernel, segments, segment: -1, blocks: [], changes: [], columns });
    this.status = kernel.layout.statuses.reached;
  }

  // Takes at most so many steps; whether the run has ended, with `status`.
  advance(steps) {
    const { kernel, segments } = this;
    const { exports, layout, at } = kernel;
    if (this.status === layout.statuses.reached) this.begin();
    const { end } = segments[this.segment];
    const [first, same] = [BigInt(this.segment === 0), BigInt(this.hasSameTicks)];
    const status = exports[layout.advance](at.model, at.run, at.outlet, end, first, same, BigInt(steps));
    this.status = Number(status);
    const { running, reached } = layout.statuses;
    const isLast = this.segment === segments.length - 1;
    const hasEnded = this.status !== running && (this.status !== reached || isLast);
    this.blocks.push(takeRows(kernel, this.columns ?? countColumns(kernel), hasEnded));
    this.changes.push(takeChanges(kernel));
    field(kernel, "outlet", "num_ticks")[0] = 0n; // commands lie in outlet.ticks
    return hasEnded;
  }

  // Begins the next segment.
  begin() {
    const before = this.period;
    this.period = this.pack(this.segments[++this.segment]);
    this.hasSameTicks = this.segment > 0 && this.period === before;
    field(this.kernel, "run", "begun")[0] = 0n;
  }

  // The largest normal force of each contact so far, at any time [N].
  get peakForces() {
    const [within, rows] = ["peak_normal_force", "row_peak"].map((name) => field(this.kernel, "run", `tally.${name}`));
    return within.map((force, contact) => Math.max(force, rows[contact]));
  }

  // The contact or finger that the last event concerns, -1 if none.
  get contact() {
    return Number(field(this.kernel, "run", "concerned")[0]);
  }
}

// A run from the table of its scenario. The pulses of a segment push with its `load`, and its timed
// changes have set the numbers of the table that its `changes` have, by their places.
export class Run extends AnyRun {
  constructor(kernel, table, segments = [wholeRun(kernel, table)]) {
    super(kernel, segments);
    this.table = table;
    new Uint8Array(kernel.exports.memory.buffer, kernel.at.run, kernel.layout.records.run.size).fill(0);
    write(kernel, "table", table);
    kernel.exports.slipgrasp_begin_run(kernel.at.table, kernel.at.run, kernel.at.outlet, 1n);
  }

  pack({ load, changes }) {
    const { kernel, table } = this;
    const present = Float64Array.from(table);
    for (const [place, value] of Object.entries(changes)) present[place] = value;
    write(kernel, "table", present);
    field(kernel, "stretch", "load").set(load);
    field(kernel, "stretch", "slip_minimum").fill(NaN); // the whole face
    field(kernel, "stretch", "slip_maximum").fill(NaN);
    field(kernel, "stretch", "friction_factor").fill(1);
    kernel.exports.slipgrasp_pack(kernel.at.table, kernel.at.stretch, kernel.at.model);
    return present[kernel.layout.places["controller.control_period"][0]];
  }
}

// A run from packed records, as bytes: the run before it begins, and the model of each segment, of
// which `values` are set by their places among its numbers unless a timed change has set them.
export class PackedRun extends AnyRun {
  constructor(kernel, { run, columns, segments, values }) {
    super(kernel, segments, columns);
    const length = segments[0].model.length / 8;
    this.values = values.filter(([place]) => place < length);
    const start = new Float64Array(run.slice().buffer);
    for (const [place, value] of values) if (place >= length) start[place - length] = value;
    write(kernel, "run", start);
    field(kernel, "outlet", "keeps_rows")[0] = 1n;
    for (const name of ["num_rows", "num_ticks"]) field(kernel, "outlet", name)[0] = 0n;
    field(kernel, "outlet", "history").fill(-Infinity);
  }

  pack({ model, period }) {
    const present = model.slice();
    const [numbers, first] = [present, this.segments[0].model].map((each) => new Float64Array(each.buffer));
    for (const [place, value] of this.values) {
      if (numbers[place] === first[place]) numbers[place] = value;
    }
    writeBytes(this.kernel, "model", present);
    return period;
  }
}

// A run from start to end, at once.
export function run(kernel, table) {
  const whole = new Run(kernel, table);
  while (!whole.advance(1000));
  const { status, blocks } = whole;
  const completed = status === kernel.layout.statuses.reached;
  return { completed, status, columns: countColumns(kernel), blocks };
}

function wholeRun(kernel, table) {
  const end = table[kernel.layout.places["simulation.duration"][0]];
  return { end, load: [0, 0, 0], changes: {} };
}

function write(kernel, record, numbers) {
  new Float64Array(kernel.exports.memory.buffer, kernel.at[record], numbers.length).set(numbers);
}

function writeBytes(kernel, record, bytes) {
  new Uint8Array(kernel.exports.memory.buffer, kernel.at[record], bytes.length).set(bytes);
}

// The rows that the kernel has written, one after another. While a slip is young, others may still
// come between its rows, which stay in the buffer until then, or until the run has ended.
function takeRows(kernel, columns, hasEnded) {
  const [count, rows] = ["num_rows", "rows"].map((name) => field(kernel, "outlet", name));
  const since = field(kernel, "run", "slip.since");
  const isYoung = !hasEnded && field(kernel, "run", "slip.level")[0] > 0n;
  const settled = isYoung ? since[0] : count[0];
  const taken = rows.slice(0, Number(settled) * columns);
  rows.copyWithin(0, taken.length, Number(count[0]) * columns);
  count[0] -= settled;
  since[0] -= settled;
  return taken;
}

// The phase changes since the last call: time, contact, phase before and phase after of each.
function takeChanges(kernel) {
  const count = field(kernel, "run", "num_changes");
  const length = Number(count[0]) * 4;
  count[0] = 0n;
  return field(kernel, "outlet", "changes").slice(0, length);
}

// Columns of a row, from the signals that it holds in their order.
function countColumns(kernel) {
  const fingers = Number(field(kernel, "model", "num_fingers")[0]);
  const unknowns = Number(field(kernel, "model", "num_unknowns")[0]);
  const diagnostics = Number(field(kernel, "model", "num_diagnostics")[0]);
  const width = { "": 1, pose: 3, coordinate: 3, contact: fingers, joint: 2 * fingers };
  Object.assign(width, { tangent: fingers, path: 0, pad: 0 }); // one slip, no path, no soft tip
  Object.assign(width, { unknown: unknowns, diagnostic: diagnostics });
  return kernel.layout.row.reduce((sum, [, per]) => sum + width[per], 0);
}
