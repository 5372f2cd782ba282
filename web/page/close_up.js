// One contact magnified, as SVG. Its lens has a radius of 1, with y upwards; a planar one shows the
// face in the axes of the object, a spatial one the face from outside, t_y to the right and t_x up.
// The face rests, and the fingertip slides along it. Colours: slipgrasp.web.page.colours.

const SVG = "http://www.w3.org/2000/svg";
const INSIDE = 0.97;
const BALL = 0.085; // radius of the fingertip
const SPATIAL_BALL = 0.055;
const HALO = 1.75; // radius of the ring around a slipping fingertip, in that of the fingertip
const BESIDE = 3.6; // where a slip velocity is drawn, likewise
const TRAIL = 0.1;
const CONE = 0.58;
const FULL_FORCE = 0.65;
const FULL_SPEED = { flat: 0.5, round: 0.32 };
const FULL_LIMIT = 0.5; // radius of the largest limit of friction
const ESTIMATED = 0.85; // length of the estimated cone, in that of the cone
const PATCH = 1.2 * BALL;
const FINE = 0.014;

/** Makes an element of SVG. */
export function make(name, attributes = {}, parent = null) {
  const element = document.createElementNS(SVG, name);
  set(element, attributes);
  parent?.append(element);
  return element;
}

/** Sets attributes; those that stay are not touched. */
export function set(element, attributes) {
  element.known ??= {};
  for (const [name, value] of Object.entries(attributes)) {
    if (element.known[name] === value) continue;
    element.known[name] = value;
    if (value === null) element.removeAttribute(name);
    else element.setAttribute(name, value);
  }
}

/** The lens of one contact: what of it is seen, and the rim in the colour of its phase. */
export class Lens {
  constructor(facts, contact, colours, parent) {
    this.facts = facts;
    this.contact = contact;
    this.colours = colours;
    this.element = make("g", { class: "sg-lens" }, parent);
    make("circle", { r: 1, fill: contact.flat ? "var(--sg-lens)" : "var(--sg-object)" }, this.element);
    const inside = make("g", { "clip-path": "url(#sg-lens-clip)" }, this.element);
    this.parts = contact.flat ? this.addPlanar(inside) : this.addSpatial(inside);
    this.bezel = make("circle", { r: 1.02, fill: "none", stroke: "var(--sg-joint)" }, this.element);
    this.rim = make("circle", { r: 1, fill: "none" }, this.element);
  }

  /** Shows a contact (ContactRun.at) at a time [s], with its middle at a point [px]. */
  draw(state, time, x, y, radius) {
    const colour = this.colours.phases[state.phase];
    const width = Math.max(0.05, 3 / radius);
    set(this.element, { transform: `translate(${tenth(x)} ${tenth(y)}) scale(${tenth(radius)} ${-tenth(radius)})` });
    set(this.rim, { stroke: colour, "stroke-width": number(width) });
    set(this.bezel, { "stroke-width": number(1.6 * width) });
    this.contact.patches.forEach((patch, k) => {
      const isThere = patch.start <= time && (patch.end === null || time < patch.end);
      set(this.parts.patches[k], { visibility: isThere ? null : "hidden" });
    });
    if (this.contact.flat) this.drawPlanar(state, colour);
    else this.drawSpatial(state, colour);
  }

  addPlanar(parent) {
    const { tangent, inward, patches } = this.contact;
    const [start, end] = [tangent, tangent.map((part) => -part)];
    const turnsLeft = tangent[0] * inward[1] - tangent[1] * inward[0] > 0;
    const solid = `M${point(start)}A1 1 0 0 ${turnsLeft ? 1 : 0} ${point(end)}Z`;
    make("path", { d: solid, fill: "var(--sg-object)" }, parent);
    make("path", { d: solid, fill: "url(#sg-hatch)" }, parent);
    const scale = 1 / this.facts.reach;
    const water = patches.map(({ centre: [middle], radius }) => {
      const [a, b] = [-radius, radius].map((aside) => times(scale * (middle + aside), tangent));
      const inside = times(PATCH, inward);
      const d = `M${[a, b, sum(b, inside), sum(a, inside)].map(point).join("L")}Z`;
      return make("path", { d, fill: "var(--sg-water)" }, parent);
    });
    const ghost = this.addGhost(parent);
    const cone = this.addCone(parent);
    const trails = [-1, 1].map((phase) => line(parent, this.colours.phases[phase], TRAIL));
    line(parent, "var(--sg-edge)", 0.03, { d: `M${point(times(INSIDE, start))}L${point(times(INSIDE, end))}` });
    line(parent, "var(--sg-edge)", 0.018, { d: this.ticks() });
    const stub = line(parent, "var(--sg-link)", 1.5 * BALL);
    return { patches: water, ghost, trails, cone, stub, ...addMarks(parent, BALL) };
  }

  addSpatial(parent) {
    const scale = 1 / this.facts.reach;
    const water = this.contact.patches.map(({ centre: [up, right], radius }) =>
      make("circle", { cx: scale * right, cy: scale * up, r: scale * radius, fill: "var(--sg-water)" }, parent),
    );
    line(parent, "var(--sg-edge)", FINE, { d: "M-1 0H1M0-1V1", opacity: 0.5 });
    const ghost = this.addGhost(parent);
    const cone = this.addCone(parent);
    const trails = [line(parent, this.colours.phases[2], 0.05)];
    const pad = scale * this.contact.pad;
    const tip = make("g", {}, parent);
    const disc = make("circle", { r: pad, "fill-opacity": 0.3, "stroke-width": 0.02 }, tip);
    const hands = pad > 0 && {
      start: line(tip, "var(--sg-edge)", 0.02, { d: `M0 0V${number(pad)}` }),
      now: line(tip, "var(--sg-joint)", 0.045),
    };
    return { patches: water, ghost, trails, cone, tip, disc, hands, ...addMarks(parent, SPATIAL_BALL) };
  }

  addGhost(parent) {
    return {
      line: line(parent, "var(--sg-ghost)", 0.35 * TRAIL),
      ring: make("circle", { r: BALL, fill: "none", stroke: "var(--sg-ghost)", "stroke-width": 0.3 * BALL }, parent),
    };
  }

  addCone(parent) {
    const shown = { visibility: this.facts.cones ? null : "hidden" };
    const { inside, cone, estimated } = this.colours;
    return {
      inside: make("path", { fill: inside, "fill-opacity": 0.75, ...shown }, parent),
      edge: line(parent, cone, FINE, shown),
      estimated: line(parent, estimated, FINE, { "stroke-dasharray": "0.05 0.035", ...shown }),
    };
  }

  drawPlanar(state, colour) {
    const { facts, contact, parts } = this;
    const { tangent, inward } = contact;
    const scale = 1 / facts.reach;
    const tip = times(scale * state.slip[0], tangent);
    const outside = times(-BALL, inward);
    const ball = sum(tip, outside);
    const under = times(0.5 * TRAIL, inward);
    state.trail.forEach((end, k) => {
      set(parts.trails[k], { d: `M${point(under)}L${point(sum(under, times(scale * end, tangent)))}` });
    });
    this.drawGhost(state.ghost && times(scale * state.ghost[0], tangent), outside);
    const sides = (friction, length) =>
      [1, -1].map((sign) =>
        sum(tip, times(length / Math.hypot(1, friction), sum(inward, times(sign * friction, tangent)))),
      );
    const [left, right] = sides(state.friction, CONE).map(point);
    const edges = `M${left}L${point(tip)}L${right}`;
    set(parts.cone.inside, { d: `${edges}Z` });
    set(parts.cone.edge, { d: edges });
    const [low, high] = sides(state.estimate ?? 0, ESTIMATED * CONE).map(point);
    set(parts.cone.estimated, { d: state.estimate === null ? "" : `M${low}L${point(tip)}L${high}` });
    const back = contact.onSlides ? times(-1, inward) : [-Math.cos(state.link), -Math.sin(state.link)];
    set(parts.stub, { d: `M${point(ball)}L${point(sum(ball, times(toCircle(ball, back, 0.92), back)))}` });
    drawBall(parts, ball, colour, state.slips);
    const force = sum(times(-state.tangential[0], tangent), times(state.normal, inward));
    drawArrow(parts.force, tip, times(FULL_FORCE / facts.force, force), colour);
    const half = times((0.5 * FULL_SPEED.flat * state.velocity[0]) / facts.speed, tangent);
    const from = sum(sum(tip, times(-BESIDE * BALL, inward)), times(-1, half));
    drawArrow(parts.motion, from, state.slips ? times(2, half) : [0, 0], colour);
  }

  drawSpatial(state, colour) {
    const { facts, contact, parts } = this;
    const scale = 1 / facts.reach;
    const inFace = ([up, right], size) => [size * right, size * up];
    const tip = inFace(state.slip, scale);
    const path = state.trail.map((slip) => point(inFace(slip, scale)));
    set(parts.trails[0], { d: `M${path.join("L")}` });
    this.drawGhost(state.ghost && inFace(state.ghost, scale), [0, 0]);
    const size = FULL_LIMIT / facts.limit;
    const outline = (friction) => {
      const radius = Math.min(size * leftByMoment(friction * state.normal, state.moment, contact.eccentricity), 2);
      return `M${facts.outline.map((corner) => point(sum(tip, times(radius, corner)))).join("L")}Z`;
    };
    const limit = outline(state.friction);
    set(parts.cone.inside, { d: limit });
    set(parts.cone.edge, { d: limit });
    set(parts.cone.estimated, { d: state.estimate === null ? "" : outline(state.estimate) });
    if (parts.hands) {
      set(parts.tip, { transform: `translate(${tip.map(number).join(" ")})` });
      set(parts.disc, { fill: colour, stroke: colour });
      const hand = inFace([Math.cos(state.spin), Math.sin(state.spin)], scale * contact.pad);
      set(parts.hands.now, { d: `M0 0L${point(hand)}` });
    }
    drawBall(parts, tip, colour, false);
    const friction = inFace(state.tangential, -size);
    drawArrow(parts.force, tip, friction, this.colours.cone);
    const motion = inFace(state.velocity, FULL_SPEED.round / facts.speed);
    drawArrow(parts.motion, sum(tip, friction), state.slips ? motion : [0, 0], colour);
  }

  /** Where the fingertip of the ghost is; not drawn where that is outside of the lens. */
  drawGhost(place, outside) {
    const { line: path, ring } = this.parts.ghost;
    const isSeen = place !== null && Math.hypot(...place) < 0.9;
    const [cx, cy] = isSeen ? sum(place, outside).map(number) : [0, 0];
    set(ring, { cx, cy, visibility: isSeen ? null : "hidden" });
    const inside = times(-1, outside);
    set(path, { d: place === null ? "" : `M${point(inside)}L${point(sum(inside, place))}` });
  }

  /** Marks at round slips along the face of a planar contact. */
  ticks() {
    const { tangent, inward } = this.contact;
    const step = this.facts.tick / this.facts.reach;
    const count = Math.floor(0.9 / step);
    return Array.from({ length: 2 * count + 1 }, (_, k) => {
      const at = times((k - count) * step, tangent);
      const end = sum(at, times(k === count ? 0.14 : 0.07, inward));
      return `M${point(at)}L${point(end)}`;
    }).join("");
  }
}

/** The largest friction beside a moment of a soft fingertip: a section of its limit surface [N]. */
export function leftByMoment(limit, moment, eccentricity) {
  if (eccentricity === 0) return limit;
  return Math.sqrt(Math.max(limit ** 2 - (moment / eccentricity) ** 2, 0));
}

function addMarks(parent, size) {
  return {
    halo: make("circle", { r: HALO * size, fill: "none", "stroke-width": 0.4 * size }, parent),
    ball: make("circle", { r: size }, parent),
    force: make("path", {}, parent),
    motion: make("path", {}, parent),
  };
}

function line(parent, stroke, width, attributes = {}) {
  return make("path", { fill: "none", stroke, "stroke-width": width, ...attributes }, parent);
}

function drawBall({ ball, halo }, place, colour, slips) {
  const [cx, cy] = place.map(number);
  set(ball, { cx, cy, fill: colour });
  set(halo, { cx, cy, stroke: colour, visibility: slips ? null : "hidden" });
}

/** An arrow with a head; as much of it as is inside of the lens. */
function drawArrow(element, tail, vector, fill) {
  const full = Math.hypot(...vector);
  if (full < 1e-6) {
    set(element, { d: "" });
    return;
  }
  const along = times(1 / full, vector);
  const length = Math.min(full, Math.max(toCircle(tail, along, INSIDE), 0));
  const across = [-along[1], along[0]];
  const head = Math.min(0.13, length);
  const [shaft, wide] = [0.022, 0.5 * head];
  const corner = (forward, aside) => point(sum(sum(tail, times(forward, along)), times(aside, across)));
  const neck = length - head;
  const corners = [[0, shaft], [neck, shaft], [neck, wide], [length, 0], [neck, -wide], [neck, -shaft], [0, -shaft]];
  set(element, { d: `M${corners.map((each) => corner(...each)).join("L")}Z`, fill });
}

/** How far a ray goes until it leaves a circle about the origin; 0 if it starts outside. */
function toCircle(start, direction, radius) {
  const along = start[0] * direction[0] + start[1] * direction[1];
  const inside = radius ** 2 - start[0] ** 2 - start[1] ** 2;
  return inside > 0 ? Math.sqrt(along ** 2 + inside) - along : 0;
}

function sum(a, b) {
  return [a[0] + b[0], a[1] + b[1]];
}

function times(factor, vector) {
  return [factor * vector[0], factor * vector[1]];
}

function number(value) {
  return String(Math.round(1e4 * value) / 1e4);
}

function tenth(value) {
  return Math.round(10 * value) / 10;
}

function point([x, y]) {
  return `${number(x)} ${number(y)}`;
}
