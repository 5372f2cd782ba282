// What the page says of a run: sentences of the program with their blanks filled, and numbers.

const CELLS = 480;
const NUM_TICKS = 6;

/** How the run ended. */
export function cardHtml(own, run, charts) {
  const [end, time] = [run.ends[own.status], `at ${short(own.end)} s`];
  const headline = own.holding ? run.holds[own.holding] : `${end.headline} ${time}`;
  const blanks = { ...run.blanks, finger: run.fingers[own.contact] ?? "" };
  const sentence = end.sentence.replace(/{(\w+)}/g, (_, name) => blanks[name]);
  const told = sentence || (own.holding ? `${end.headline} ${time}.` : "");
  const rows = run.fingers.map((finger, k) => {
    const slip = own.slipOf(own.count - 1, k);
    const far = short(1000 * (slip.length > 1 ? Math.hypot(...slip) : slip[0]));
    return `<tr><th scope="row">${escape(finger)}</th><td>${far}</td><td>${own.peakForces[k].toFixed(1)} N</td></tr>`;
  });
  return (
    `<div class="sg-outcome"><div class="sg-verdict">${escape(headline)}</div>` +
    `${told && `<p>${escape(told)}</p>`}<table><tr><td></td><th scope="col">slip at the end [mm]</th>` +
    `<th scope="col" title="Largest normal force">peak Fₙ</th></tr>${rows.join("")}</table></div>`
  );
}

/** That a run takes long. */
export function waitingHtml(seconds) {
  return endedHtml(`Computing for ${seconds.toFixed(0)} s`);
}

/** How a run ended of which nothing else is known. */
export function endedHtml(headline) {
  return `<div class="sg-outcome"><div class="sg-verdict">${escape(headline)}</div></div>`;
}

/** The hash of the run, and the command that prints the same one. */
export function checkHtml(own, { command }, changed, compared) {
  const sets = [...changed].map(([key, value]) => ` --set '${key}=${value}'`).join("");
  const how = command ? `<p>The same hash: <code>${escape(command + sets)} --json</code></p>` : "";
  return (
    `<div class="sg-outcome sg-check"><p>SHA-256 of this run, computed here in ` +
    `${own.milliseconds.toFixed(1)} ms:</p><p><code id="sg-sha256">${own.sha256}</code></p>${how}` +
    `<p id="sg-compared" role="status">${escape(compared)}</p>` +
    `<p><button type="button" class="sg-try" data-sg-intent='{"kind":"choose-recording"}' title="An MCAP file of slipgrasp; it can also be dropped on this page">Check a recording</button> ` +
    `<button type="button" class="sg-try" data-sg-intent='{"kind":"toggle-dark"}'>Dark or light</button></p></div>`
  );
}

/** The timeline over a time range: a lane of phases per finger, and a thin one of the ghost. */
export function stripHtml({ strip, colours }, own, ghost, [start, end]) {
  const template = document.createElement("template");
  template.innerHTML = strip;
  const page = template.content;
  page.querySelector(".sg-strip").classList.toggle("sg-with-ghost", ghost !== null);
  page.querySelectorAll(".sg-mark").forEach((mark) => mark.remove());
  const bars = (spans) => [...spans].map((span) => barOf(span, start, end, colours)).join("");
  page.querySelectorAll(".sg-lane").forEach((lane, finger) => {
    lane.innerHTML = bars(own.spans(finger));
    if (ghost === null) return;
    const pale = lane.cloneNode();
    pale.setAttribute("class", "sg-ghost-lane");
    pale.innerHTML = bars(ghost.spans(finger));
    lane.after(pale);
  });
  const [ticks, unit] = axisOf(start, end);
  page.querySelector(".sg-names .sg-axis").textContent = unit;
  page.querySelector(".sg-track .sg-axis").innerHTML = ticks;
  return template.innerHTML;
}

function barOf({ phase, start, end }, from, to, colours) {
  if (end <= start || end < from || start > to) return "";
  const place = (time) => (CELLS * Math.min(Math.max(time - from, 0), to - from)) / (to - from);
  const width = Math.max(place(end) - place(start), 1);
  return `<rect x="${place(start)}" width="${width}" height="1" fill="${colours[phase]}"/>`;
}

/** Labels of the time axis at round times, and their unit. */
function axisOf(start, end) {
  const [scale, unit] = end < 1 ? [1000, "ms"] : [1, "s"];
  const least = (scale * (end - start)) / NUM_TICKS;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= least * (1 - 1e-9));
  const digits = Math.max(-Math.floor(Math.log10(step) + 1e-9), 0);
  let ticks = "";
  for (let k = Math.ceil((scale * start) / step - 1e-9); k * step <= scale * end + 1e-9; k++) {
    const left = (100 * ((k * step) / scale - start)) / (end - start);
    ticks += `<span style="left:${left}%">${(k * step).toFixed(digits)}</span>`;
  }
  return [ticks, unit];
}

function short(value) {
  return String(Number(value.toPrecision(4)));
}

function escape(text) {
  return text.replace(/[&<>"']/g, (character) => `&#${character.charCodeAt(0)};`);
}
