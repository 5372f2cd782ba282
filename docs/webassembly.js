// Runs scenarios with slipgrasp.wasm, in a page, a worker or Node: docs/webassembly.md.

const LINE = 64; // bytes; every record begins on a cache line
const PAGE = 65536; // bytes of WebAssembly's memory

// From the bytes of the file to a kernel with room for one run.
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

// A run without pulses, patches and timed changes, from the table of its scenario.
export function run(kernel, table) {
  const { exports, layout, at } = kernel;
  const { running, reached } = layout.statuses;
  const buffer = exports.memory.buffer;
  new Float64Array(buffer, at.table, table.length).set(table);
  new Uint8Array(buffer, at.run, layout.records.run.size).fill(0);
  field(kernel, "stretch", "load").fill(0);
  field(kernel, "stretch", "slip_minimum").fill(NaN); // the whole face
  field(kernel, "stretch", "slip_maximum").fill(NaN);
  field(kernel, "stretch", "friction_factor").fill(1);
  exports.slipgrasp_pack(at.table, at.stretch, at.model);
  exports.slipgrasp_begin_run(at.table, at.run, at.outlet, 1n);

  const end = table[layout.places["simulation.duration"][0]];
  const blocks = [];
  let status = running;
  while (status === running) {
    status = Number(exports.slipgrasp_advance(at.model, at.run, at.outlet, end, 1n, 0n, 1000n));
    blocks.push(takeRows(kernel));
    field(kernel, "run", "num_changes")[0] = 0n; // phase changes lie in outlet.changes
    field(kernel, "outlet", "num_ticks")[0] = 0n; // commands lie in outlet.ticks
  }
  return { completed: status === reached, status, columns: countColumns(kernel), blocks };
}

// The rows that the kernel has written since the last call, one after another.
function takeRows(kernel) {
  const count = field(kernel, "outlet", "num_rows");
  const length = Number(count[0]) * countColumns(kernel);
  count[0] = 0n;
  return field(kernel, "outlet", "rows").slice(0, length);
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
