// The worker of a page: runs scenarios with the kernel, in pieces, so that a newer request stops an
// older one. What is loaded before it: unpack.js and kernel.js.

const STEPS = 200;
const PIECE_MS = 12;
const PATIENCE_MS = 1000;

let loading = null;
let latest = 0;

onmessage = async ({ data }) => {
  if (data.kernel) loading = load(data);
  else if (data.cells) await computeCells(data);
  else await compute(data);
};

async function load({ decoder, kernel }) {
  const unpack = await makeUnpack(decoder);
  return loadKernel(unpack(decode(kernel)));
}

async function compute({ id, values, scenario, columns, window, outcomes }) {
  latest = id;
  const kernel = await loading;
  if (id !== latest) return;
  const began = performance.now();
  const run = runOf(kernel, scenario, values);
  let [yielded, told] = [began, began];
  while (!run.advance(STEPS)) {
    const now = performance.now();
    if (now - yielded < PIECE_MS) continue;
    if (now - told > PATIENCE_MS) {
      told = now;
      postMessage({ id, seconds: (now - began) / 1000 });
    }
    await new Promise((resolve) => setTimeout(resolve));
    if (id !== latest) return;
    yielded = performance.now();
  }
  const milliseconds = performance.now() - began;
  const holding = outcomes[run.status] === "completed" ? holdingOf(run, columns, window) : null;
  const [rows, changes] = [run.blocks, run.changes].map((blocks) => joined(Float64Array, blocks));
  const { status, contact, peakForces } = run;
  const sha256 = await digest(rows, changes, outcomes[status]);
  if (id !== latest) return;
  postMessage({ id, rows, changes, status, holding, contact, peakForces, milliseconds, sha256 }, [rows.buffer]);
}

// How the runs of some cells of a map end, as places in the program's list of categories.
async function computeCells({ cells, scenario, columns, categories }) {
  const kernel = await loading;
  const found = cells.map(({ cell, values }) => {
    const run = runOf(kernel, scenario, values);
    while (!run.advance(STEPS));
    return [cell, categoryOf(run, columns, categories)];
  });
  postMessage({ found });
}

function categoryOf(run, columns, { byStatus, window, ...completed }) {
  return byStatus[run.status] ?? completed[holdingOf(run, columns, window)];
}

// Whether a completed run holds the object, as the metric `held` says it.
function holdingOf(run, { width, phase: [first, fingers] }, window) {
  const [rows, changes] = [run.blocks, run.changes].map((blocks) => blocks.findLast(({ length }) => length > 0));
  const last = rows.subarray(-width);
  const isSlipping = last.subarray(first, first + fingers).some((phase) => phase !== 0);
  const rest = changes ? last[0] - changes[changes.length - 4] : Infinity;
  if (isSlipping) return "slipping";
  if (rest < window) return "settling";
  return last[0] - run.blocks[0][0] < window ? "tooShort" : "held";
}

// A run with other values at some places: of its table, or of the model of a spatial hand.
function runOf(kernel, scenario, values) {
  if (scenario.run) return new PackedRun(kernel, { ...scenario, values });
  const table = Float64Array.from(scenario.table);
  for (const [place, value] of values) table[place] = value;
  return new Run(kernel, table, scenario.segments);
}

function joined(Numbers, blocks) {
  const whole = new Numbers(blocks.reduce((sum, block) => sum + block.length, 0));
  let at = 0;
  for (const block of blocks) {
    whole.set(block, at);
    at += block.length;
  }
  return whole;
}

// The hash of a run (`RunResult.sha256`): its rows, its phase changes, and its outcome.
async function digest(rows, changes, outcome) {
  const parts = [rows, changes].map(({ buffer }) => new Uint8Array(buffer));
  parts.push(new TextEncoder().encode(outcome));
  const hash = new Uint8Array(await crypto.subtle.digest("SHA-256", joined(Uint8Array, parts)));
  return [...hash].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
