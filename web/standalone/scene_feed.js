// What moves in the scene, as messages to the viewer: assignments to its nodes, whose values the
// formulas of the dashboard's scene give for two rows of a run and a weight between them.
import { frame } from "./formulas.js";

const LEAST_MOVE = 1e-6;

export class SceneFeed {
  constructor(scene) {
    this.scene = scene;
    this.values = new Float64Array(scene.numValues);
    this.sent = new Map();
  }

  /** Messages for an instant of a run, and of the ghost or null; what did not change has none. */
  messages(own, ghost) {
    const { scene } = this;
    const pale = ghost ?? own;
    frame(...own.rows, [own.weight], ...pale.rows, [pale.weight], this.values);
    const found = [this.visibility(scene.ghostRoot, ghost !== null)];
    for (const assignment of scene.common) found.push(this.assign(assignment));
    own.phases.forEach((phase, finger) => {
      for (const assignment of scene.fingers[finger][phase]) found.push(this.assign(assignment));
    });
    const segment = scene.pushes.find(({ end }) => own.time < end) ?? scene.pushes.at(-1);
    for (const assignment of segment.assignments) found.push(this.assign(assignment));
    if (ghost) for (const assignment of scene.ghost) found.push(this.assign(assignment));
    return found.filter((message) => message !== null);
  }

  visibility(node, value) {
    return this.assign({ node, key: "visible", value });
  }

  assign({ node, key, places, value }) {
    const wanted = places ? places.map((place) => this.values[place]) : value;
    const name = `${node} ${key}`;
    if (isSame(this.sent.get(name), wanted)) return null;
    this.sent.set(name, wanted);
    const { field, message } = this.scene.messages[key] ?? this.scene.messages.updates;
    const content = field === "updates" ? { [key]: places ? Float32Array.from(wanted) : value } : wanted;
    return { ...message, name: node, [field]: content };
  }
}

function isSame(before, wanted) {
  if (!Array.isArray(wanted) || before === undefined) return before === wanted;
  return wanted.every((value, k) => Math.abs(value - before[k]) < LEAST_MOVE);
}
