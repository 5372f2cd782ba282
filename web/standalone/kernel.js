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

// A run without patches, from the table of its scenario. A segment lasts until its `end` [s]; its
// pulses push with the `load`, and its timed changes have set the numbers of the table that
// `changes` has, by their places.
export class Run {
  constructor(kernel, table, segments = [wholeRun(kernel, table)]) {
    Object.assign(this, { kernel, table, segments, segment: -1, blocks: [], changes: [] });
    this.status = kernel.layout.statuses.reached;
    new Uint8Array(kernel.exports.memory.buffer, kernel.at.run, kernel.layout.records.run.size).fill(0);
    write(kernel, table);
    kernel.exports.slipgrasp_begin_run(kernel.at.table, kernel.at.run, kernel.at.outlet, 1n);
  }

  // Takes at most so many steps; whether the run has ended, with `status`.
  advance(steps) {
    const { kernel, segments } = this;
    const { exports, layout, at } = kernel;
    if (this.status === layout.statuses.reached) this.pack();
    const { end } = segments[this.segment];
    const [first, same] = [BigInt(this.segment === 0), BigInt(this.hasSameTicks)];
    const status = exports.slipgrasp_advance(at.model, at.run, at.outlet, end, first, same, BigInt(steps));
    this.status = Number(status);
    this.blocks.push(takeRows(kernel));
    this.changes.push(takeChanges(kernel));
    field(kernel, "outlet", "num_ticks")[0] = 0n; // commands lie in outlet.ticks
    const { running, reached } = layout.statuses;
    const isLast = this.segment === segments.length - 1;
    return this.status !== running && (this.status !== reached || isLast);
  }

  // Begins the next segment.
  pack() {
    const { kernel, table } = this;
    const { exports, at } = kernel;
    const { load, changes } = this.segments[++this.segment];
    const before = this.period;
    const present = Float64Array.from(table);
    for (const [place, value] of Object.entries(changes)) present[place] = value;
    this.period = present[kernel.layout.places["controller.control_period"][0]];
    this.hasSameTicks = this.segment > 0 && this.period === before;
    write(kernel, present);
    field(kernel, "stretch", "load").set(load);
    field(kernel, "stretch", "slip_minimum").fill(NaN); // the whole face
    field(kernel, "stretch", "slip_maximum").fill(NaN);
    field(kernel, "stretch", "friction_factor").fill(1);
    exports.slipgrasp_pack(at.table, at.stretch, at.model);
    field(kernel, "run", "begun")[0] = 0n;
  }

  // The contact or finger that the last event concerns, -1 if none.
  get contact() {
    return Number(field(this.kernel, "run", "concerned")[0]);
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

function write(kernel, table) {
  new Float64Array(kernel.exports.memory.buffer, kernel.at.table, table.length).set(table);
}

// The rows that the kernel has written since the last call, one after another.
function takeRows(kernel) {
  const count = field(kernel, "outlet", "num_rows");
  const length = Number(count[0]) * countColumns(kernel);
  count[0] = 0n;
  return field(kernel, "outlet", "rows").slice(0, length);
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
