// Close-ups of the contacts over a view of the scene, as SVG: lenses, captions, lines to the contacts.
// Everything comes in as numbers, so that any page can use it, whatever computes the run and draws
// the scene: a run (contact_run.js), a time, and matrices of the camera.
import { Lens, leftByMoment, make, set } from "./close_up.js";
import { place } from "./close_up_places.js";
import { boxOf, project } from "./projection.js";

const LINE = 1.25; // height of a line of text, in its size
const SCALE = 1.5; // height of the scale below a lens, in the size of the text
const LARGE = 1.6; // size of an enlarged close-up, as far as there is space, in that of the area
const LARGEST_RING = 0.6; // of a ring around a contact, in the radius of a close-up
const LEAST_RING = 4; // px
// What a newcomer cannot know, beside the first close-up, where a page shows it.
const EXPLAINED = ["◁ friction cone", "→ contact force", "▬ slip so far", "↑ slip velocity", "○ what is enlarged"];
const STYLE = `
.sg-overlay { position: absolute; inset: 0; width: 100%; height: 100%; overflow: hidden;
  z-index: 2; pointer-events: none; font-family: system-ui, sans-serif; }
.sg-overlay text { fill: var(--sg-ink); stroke: var(--sg-page); stroke-width: 3px;
  stroke-linejoin: round; paint-order: stroke; text-anchor: middle; white-space: pre;
  font-variant-numeric: tabular-nums; pointer-events: auto; user-select: text; cursor: text; }
.sg-overlay .sg-labels text { pointer-events: none; }
.sg-overlay .sg-first { display: none; }
.sg-overlay .sg-first text { text-anchor: end; pointer-events: none; }
.sg-overlay [role=button] { pointer-events: auto; cursor: pointer; outline-offset: 3px; }
`;

/** Close-ups over one view. */
export class Overlay {
  /** host: the element over the view, which has its size; colours: see web.page.colours. */
  constructor(host, colours) {
    this.colours = colours;
    this.element = make("svg", { class: "sg-overlay" });
    make("style", {}, this.element).textContent = STYLE;
    addDefinitions(this.element);
    host.append(this.element);
    this.labels = make("g", { class: "sg-labels", visibility: "visible" }, this.element);
    this.explanation = new Explanation(this);
    this.drawn = "";
    this.run = null;
    // What is pressed here neither turns the camera nor drags the object.
    for (const kind of ["pointerdown", "mousedown", "touchstart", "dblclick"]) {
      this.element.addEventListener(kind, (event) => event.stopPropagation());
    }
    this.element.addEventListener("click", (event) => this.toggle(event.target));
    this.element.addEventListener("keydown", (event) => this.press(event));
  }

  /**
   * Draws an instant of a run; null hides everything.
   *
   * picture: {run, time [s], worldToClip, objectToClip, labels: [{text, toClip, place}], size: {width, height},
   * free: {left, top, right, bottom}, dark, font: size of the text} in pixels of the page.
   */
  draw(picture) {
    const isVisible = picture !== null && picture.run.facts.visible;
    set(this.element, { visibility: isVisible ? null : "hidden" });
    if (picture !== null) setColours(this.element, picture.dark ? this.colours.dark : this.colours.light, picture.font);
    this.label(picture);
    if (!isVisible || !this.hasChanged(picture)) return;
    if (picture.run !== this.run) this.take(picture.run);
    const { worldToClip, objectToClip, size, free } = picture;
    const { contacts, reach } = this.run.facts;
    const states = contacts.map((_, i) => this.run.at(i, picture.time));
    const points = contacts.map(({ anchor }) => project(objectToClip, anchor, size));
    const held = boxOf(worldToClip, this.run.arrays.held, size) ?? middleOf(free);
    const words = this.wordsOf(picture.font);
    const where = points.map((at) => at ?? [held.left, held.top]);
    this.placed = place(where, held, free, words, this.placed);
    this.closeUps.forEach((closeUp, i) => {
      closeUp.draw(states[i], picture.time, this.placed.places[i], this.placed.radius, picture.font);
      const ring = ringOf(objectToClip, contacts[i].anchor, reach, size);
      closeUp.lead(points[i], this.placed.places[i].end, Math.min(ring, LARGEST_RING * this.placed.radius));
    });
    this.explanation.draw(this.placed, held, free, picture.font);
    if (this.large !== null) this.large.draw(states[this.large.index], picture.time, free, picture.font);
  }

  /** Writes the texts of the scene, also without close-ups. */
  label(picture) {
    const seen = (picture?.labels ?? []).flatMap(({ text: words, toClip, place: at }) => {
      const point = project(toClip, at, picture.size);
      return point === null ? [] : [{ words, point }];
    });
    while (this.labels.childElementCount < seen.length) text(this.labels, "bold");
    [...this.labels.children].forEach((element, k) => {
      const { words, point } = seen[k] ?? { words: "", point: [0, 0] };
      write(element, words, ...point, picture?.font ?? 0);
    });
  }

  hasChanged({ run, time, worldToClip, objectToClip, size, free, dark, font }) {
    const numbers = [time, ...worldToClip, ...objectToClip, size.width, size.height, font];
    const drawn = [...numbers, ...Object.values(free), dark, this.large?.index].join();
    if (drawn === this.drawn && run === this.run) return false;
    this.drawn = drawn;
    return true;
  }

  /** Makes the elements of another run; those of contacts that stay the same stay. */
  take(run) {
    const { arrays: _, ...facts } = run.facts;
    const made = JSON.stringify(facts);
    this.run = run;
    if (made === this.made) return;
    this.made = made;
    this.placed = null;
    this.closeUps?.forEach((closeUp) => closeUp.remove());
    const index = this.large?.index;
    this.enlarge(null);
    this.closeUps = facts.contacts.map((contact, i) => new CloseUp(facts, contact, i, this));
    this.element.append(this.labels); // over them
    if (index !== undefined && index < run.count) this.enlarge(index);
  }

  wordsOf(font) {
    const lines = this.run.arrays.ghostTimes === undefined ? 2 : 3;
    return { above: 2 * font, below: (SCALE + LINE * lines) * font, half: 5 * font };
  }

  toggle(target) {
    const button = target.closest?.("[role=button]");
    if (!button || !getSelection().isCollapsed) return;
    const index = Number(button.dataset.contact);
    this.element.dispatchEvent(new CustomEvent("sg-contact", { detail: index, bubbles: true }));
    this.enlarge(button.dataset.close !== undefined || this.large?.index === index ? null : index);
  }

  press(event) {
    if (event.key === "Escape" && this.large !== null) this.enlarge(null);
    else if (event.key === "Enter" || event.key === " ") this.toggle(event.target);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Enlarges the close-up of a contact; null makes it small again. */
  enlarge(index) {
    const before = this.large ?? null;
    before?.element.remove();
    this.large = null;
    this.drawn = "";
    if (index !== null) {
      this.large = new LargeCloseUp(this.run.facts, index, this);
      this.large.button.focus();
    } else if (before !== null) {
      this.closeUps[before.index]?.button.focus();
    }
  }
}

/** What the first close-up shows, in words beside it, where nothing else is. */
class Explanation {
  constructor(overlay) {
    this.element = make("g", { class: "sg-first" }, overlay.element);
    this.lines = EXPLAINED.map(() => text(this.element));
  }

  /** Beside the first close-up, or in the corner of the view: where nothing else is. */
  draw({ places, radius }, held, free, font) {
    const [width, half] = [9 * font, 3.75 * font];
    const { x, y } = places[0];
    const spots = [
      { right: x - radius - 0.8 * font, y },
      { right: free.left + width + font, y: free.top + half + font },
    ];
    const taken = [
      held,
      ...places.map((each) => ({
        left: each.x - radius,
        right: each.x + radius,
        top: each.y - radius - 2 * font,
        bottom: each.y + radius + 5 * font,
      })),
    ];
    const spot = spots.find(({ right, y: middle }) => {
      const box = { left: right - width, right, top: middle - half, bottom: middle + half };
      return box.left > free.left && !taken.some((other) => overlap(box, other));
    });
    set(this.element, { visibility: spot ? null : "hidden" });
    if (!spot) return;
    this.lines.forEach((line, k) => {
      write(line, EXPLAINED[k], spot.right, spot.y + 1.5 * (k - 2) * font, 0.9 * font);
    });
  }
}

/** A close-up beside the scene, with its caption and the line to its contact. */
class CloseUp {
  constructor(facts, contact, index, overlay) {
    this.contact = contact;
    this.lines = make("g", {}, overlay.element);
    overlay.element.querySelector("defs").after(this.lines);
    this.line = make("line", { stroke: "var(--sg-leader)", "stroke-width": 1.25 }, this.lines);
    this.ring = make("circle", { fill: "none", stroke: "var(--sg-leader)", "stroke-width": 1.25 }, this.lines);
    this.element = make("g", { class: "sg-close-up" }, overlay.element);
    const label = `Enlarge the close-up of ${contact.name}`;
    this.button = addButton(this.element, label, { "data-contact": index });
    this.lens = new Lens(facts, contact, overlay.colours, this.button);
    this.title = text(this.element, "bold");
    this.scale = new Scale(facts, this.element);
    this.values = [0, 1, 2].map(() => text(this.element));
  }

  draw(state, time, { x, y }, radius, font) {
    this.lens.draw(state, time, x, y, radius);
    write(this.title, captionOf(this.contact, state), x, y - radius - 0.6 * font, 1.1 * font);
    this.scale.draw(x, y + radius, radius, font);
    const told = [`slip ${slipWords(state, this.contact)}`, `force ${forceOf(state).toFixed(1)} N`];
    if (state.ghost !== null) told.push(`ghost ${lengthWords(Math.hypot(...state.ghost))}`);
    this.values.forEach((element, k) => {
      write(element, told[k] ?? "", x, y + radius + (SCALE + LINE * (k + 1) - 0.35) * font, font);
    });
  }

  /** Draws the line to the contact, from the ring around what the lens shows. */
  lead(point, end, ring) {
    set(this.lines, { visibility: point === null ? "hidden" : null });
    if (point === null) return;
    const radius = Math.max(ring, LEAST_RING);
    const [dx, dy] = [end[0] - point[0], end[1] - point[1]];
    const share = radius / Math.max(Math.hypot(dx, dy), radius);
    const [x1, y1, x2, y2] = [point[0] + share * dx, point[1] + share * dy, ...end].map(tenth);
    set(this.line, { x1, y1, x2, y2 });
    set(this.ring, { cx: tenth(point[0]), cy: tenth(point[1]), r: tenth(radius) });
  }

  remove() {
    this.lines.remove();
    this.element.remove();
  }
}

/** An enlarged close-up with all values, and the limit surface of a soft fingertip. */
class LargeCloseUp {
  constructor(facts, index, overlay) {
    this.index = index;
    this.contact = facts.contacts[index];
    this.element = make("g", { class: "sg-large" }, overlay.element);
    const card = { fill: "var(--sg-page)", stroke: "var(--sg-leader)", rx: 8 };
    this.card = make("rect", { ...card, "pointer-events": "auto" }, this.element);
    this.lens = new Lens(facts, this.contact, overlay.colours, this.element);
    this.title = text(this.element, "bold");
    this.scale = new Scale(facts, this.element);
    this.values = Array.from({ length: 5 }, () => text(this.element));
    this.surface = this.contact.pad > 0 ? new LimitSurface(this.element, overlay.colours) : null;
    this.button = addButton(this.element, "Close", { "data-close": "", "data-contact": index });
    this.cross = make("path", { stroke: "var(--sg-ink)", "stroke-width": 2, d: "M-5-5L5 5M-5 5L5-5" }, this.button);
    make("rect", { x: -12, y: -12, width: 24, height: 24, fill: "transparent" }, this.button);
  }

  draw(state, time, free, font) {
    const lines = detailsOf(state, this.contact);
    const [wide, high] = [free.right - free.left, free.bottom - free.top];
    const below = (SCALE + LINE * lines.length) * font + 8;
    const columns = this.surface === null ? 1 : LARGE;
    const radius = Math.min(0.5 * (high - below - 5 * font), (0.5 * (wide - 4 * font)) / columns, 200);
    const width = Math.max(2 * radius * columns + 4 * font, Math.min(22 * font, wide));
    const height = 2 * radius + below + 4 * font;
    const [left, top] = [0.5 * (free.left + free.right - width), 0.5 * (free.top + free.bottom - height)];
    set(this.card, { x: tenth(left), y: tenth(top), width: tenth(width), height: tenth(height) });
    set(this.button, { transform: `translate(${tenth(left + width - 16)} ${tenth(top + 16)})` });
    const x = left + 0.5 * width - (columns - 1) * radius;
    const y = top + 2.6 * font + radius;
    this.lens.draw(state, time, x, y, radius);
    write(this.title, captionOf(this.contact, state), left + 0.5 * width, top + 1.6 * font, 1.2 * font);
    this.scale.draw(x, y + radius, radius, font);
    this.surface?.draw(state, this.contact, x + 1.6 * radius, y, 0.42 * radius, 0.85 * font);
    this.values.forEach((element, k) => {
      const at = y + radius + (SCALE + LINE * (k + 1)) * font + 4;
      write(element, lines[k] ?? "", left + 0.5 * width, at, font);
    });
  }
}

/** The limit surface of a soft fingertip: friction and moment, each in its largest value. */
class LimitSurface {
  constructor(parent, colours) {
    this.colours = colours;
    this.element = make("g", {}, parent);
    this.frame = make("g", {}, this.element);
    make("circle", { r: 1, fill: colours.inside, "fill-opacity": 0.5, stroke: colours.cone, "stroke-width": 0.03 }, this.frame);
    make("path", { d: "M-1 0H1M0-1V1", stroke: "var(--sg-leader)", "stroke-width": 0.02 }, this.frame);
    this.dot = make("circle", { r: 0.09 }, this.frame);
    this.words = ["limit surface", "friction →", "moment ↑"].map(() => text(this.element));
  }

  draw(state, { eccentricity }, x, y, radius, font) {
    set(this.frame, { transform: `translate(${tenth(x)} ${tenth(y)}) scale(${tenth(radius)} ${-tenth(radius)})` });
    const limit = Math.max(state.friction * state.normal, 1e-12);
    const [cx, cy] = [Math.hypot(...state.tangential) / limit, state.moment / (eccentricity * limit)];
    set(this.dot, { cx: cx.toFixed(3), cy: cy.toFixed(3), fill: this.colours.phases[state.phase] });
    ["limit surface", "friction →", "moment ↑"].forEach((words, k) => {
      write(this.words[k], words, x, k === 0 ? y - radius - 0.6 * font : y + radius + 1.2 * k * font, font);
    });
  }
}

/** A bar below a lens as long as a round slip. */
class Scale {
  constructor(facts, parent) {
    this.share = facts.tick / facts.reach;
    const [value, unit] = lengthWords(facts.tick).split(" ");
    this.words = `${Number(value)} ${unit}`;
    this.bar = make("path", { fill: "none", stroke: "var(--sg-ink)", "stroke-width": 1.25 }, parent);
    this.label = text(parent);
  }

  draw(x, y, radius, font) {
    const length = this.share * radius;
    const half = 0.25 * this.words.length * font;
    const start = x - 0.5 * (length + 2 * half + 0.6 * font);
    const at = y + 0.04 * radius + 0.7 * font;
    set(this.bar, { d: `M${tenth(start)} ${tenth(at - 3)}v6m0-3h${tenth(length)}m0-3v6` });
    write(this.label, this.words, start + length + half + 0.6 * font, at + 0.3 * font, 0.85 * font);
  }
}

function addDefinitions(parent) {
  const definitions = make("defs", {}, parent);
  make("circle", { r: 1 }, make("clipPath", { id: "sg-lens-clip" }, definitions));
  const hatch = make(
    "pattern",
    { id: "sg-hatch", width: 0.1, height: 0.1, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" },
    definitions,
  );
  make("rect", { width: 0.012, height: 0.1, fill: "black", "fill-opacity": 0.06 }, hatch);
}

function setColours(element, colours, font) {
  const style = Object.entries(colours).map(([name, colour]) => `--sg-${name}:${colour}`);
  set(element, { style: style.join(";"), "font-size": font });
}

function addButton(parent, label, attributes) {
  const button = make("g", { role: "button", tabindex: 0, "aria-label": label, ...attributes }, parent);
  make("title", {}, button).textContent = label;
  return button;
}

function text(parent, weight = null) {
  return make("text", { "font-weight": weight }, parent);
}

/** Places a text; text that stays is not touched, so that it stays selected. */
function write(element, words, x, y, size) {
  if (element.textContent !== words) element.textContent = words;
  set(element, { x: tenth(x), y: tenth(y), "font-size": tenth(size) });
}

function captionOf({ name }, { slips }) {
  return `${name.charAt(0).toUpperCase()}${name.slice(1)} ${slips ? "SLIPS" : "sticks"}`;
}

function slipWords({ slip, spin }, { pad }) {
  const turned = pad > 0 ? `, ${((180 / Math.PI) * Math.abs(spin)).toFixed(0)}°` : "";
  return `${lengthWords(Math.hypot(...slip))}${turned}`;
}

function forceOf({ tangential, normal }) {
  return Math.hypot(...tangential, normal);
}

/** What an enlarged close-up says below its lens. */
function detailsOf(state, contact) {
  const limit = leftByMoment(state.friction * state.normal, state.moment, contact.eccentricity);
  const speed = Math.hypot(...state.velocity);
  const estimate = state.estimate === null ? "" : `, estimated ${state.estimate.toPrecision(3)}`;
  const lines = [
    `slip ${slipWords(state, contact)}${state.slips ? ` at ${lengthWords(speed)}/s` : ""}`,
    `normal force ${state.normal.toFixed(1)} N, friction coefficient ${state.friction.toPrecision(3)}${estimate}`,
    `friction ${Math.hypot(...state.tangential).toFixed(2)} N of at most ${limit.toFixed(2)} N`,
  ];
  if (contact.pad > 0) {
    const most = contact.eccentricity * state.friction * state.normal;
    lines.push(`moment ${(1e3 * Math.abs(state.moment)).toFixed(1)} of at most ${(1e3 * most).toFixed(1)} mN m`);
  }
  if (state.ghost !== null) lines.push(`ghost: slip ${lengthWords(Math.hypot(...state.ghost))}`);
  return lines;
}

/** A length in the unit that suits it [m], as slipgrasp.core.words.phrases writes it. */
export function lengthWords(length) {
  if (length < 1e-9) return length > 0 ? "less than 1 nm" : "0 mm";
  const [unit, factor] = length >= 1e-4 ? ["mm", 1e3] : length >= 1e-7 ? ["µm", 1e6] : ["nm", 1e9];
  const value = factor * length;
  return `${value >= 100 ? value.toFixed(0) : value.toPrecision(3)} ${unit}`;
}

/** How large the circle around an anchor is on the screen that a close-up shows [px]. */
function ringOf(objectToClip, anchor, reach, size) {
  const middle = project(objectToClip, anchor, size);
  if (middle === null) return 0;
  const ends = [0, 1, 2].map((axis) =>
    project(objectToClip, anchor.map((value, k) => value + (k === axis ? reach : 0)), size),
  );
  return Math.max(...ends.map((end) => (end === null ? 0 : Math.hypot(end[0] - middle[0], end[1] - middle[1]))));
}

function overlap(a, b) {
  return a.left < b.right && a.right > b.left && a.top < b.bottom && a.bottom > b.top;
}

function middleOf({ left, top, right, bottom }) {
  const [x, y] = [0.5 * (left + right), 0.5 * (top + bottom)];
  return { left: x, top: y, right: x, bottom: y };
}

function tenth(value) {
  return Math.round(10 * value) / 10;
}
