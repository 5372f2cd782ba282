// What the user does with elements that panels have marked:
//   data-sg-intent='{"kind": …}'   a click, Enter or Space asks for it, or for each of a list
//   data-sg-tab="TITLE"            a click shows this tab
//   data-sg-change='{"kind": …}'   a new value of an input or select asks for it, "$value" replaced
//   data-sg-track                  a strip over the whole window: press and drag puts the play
//                                  head there, and the wheel zooms at the pointer
//   data-sg-visible='{"kind": …}'  becoming visible sends "is_visible", and becoming invisible too
import { hold, holdRange, onFrame, state } from "./session_state.js";
import { showTab } from "./keyboard.js";
import { post } from "./post.js";

const LOOK_EVERY_MS = 100;
const ZOOM = 1.25; // of the shown time, for each step of the wheel
const STEP = 100; // of the wheel [px]
let lookedAt = -Infinity;
let lookedFor = "";
let visible = new Set();

/** Begins to listen. */
export function startGestures() {
  document.addEventListener("click", onClick);
  document.addEventListener("keydown", onKey);
  document.addEventListener("change", onValue);
  document.addEventListener("sg-contact", ({ detail }) => post({ kind: "select", part: `fingers.${detail}` }));
  document.addEventListener("pointerdown", onPress);
  document.addEventListener("wheel", onWheel, { passive: false });
  onFrame(look);
}

function onClick(event) {
  const opener = event.target.closest?.("[data-sg-tab]");
  if (opener) showTab(opener.dataset.sgTab);
  const element = event.target.closest?.("[data-sg-intent]");
  if (element && !element.disabled) ask(element);
}

function onKey(event) {
  const element = event.target;
  // Buttons and links make a click of these keys themselves.
  if (!element.matches?.("[data-sg-intent]:not(button, a)")) return;
  if (event.key !== "Enter" && event.key !== " ") return;
  event.preventDefault();
  ask(element);
}

function ask(element) {
  for (const intent of [JSON.parse(element.dataset.sgIntent)].flat()) post(intent);
}

function onValue(event) {
  const text = event.target.dataset?.sgChange;
  if (text === undefined) return;
  const isNumber = event.target.type === "number";
  const value = isNumber ? event.target.valueAsNumber : event.target.value;
  if (isNumber && !Number.isFinite(value)) return;
  const intent = Object.entries(JSON.parse(text)).map(([name, field]) => [
    name,
    field === "$value" ? value : field,
  ]);
  post(Object.fromEntries(intent));
}

function look() {
  const now = performance.now();
  if (now - lookedAt < LOOK_EVERY_MS || state.session === "") return;
  lookedAt = now;
  // Another session knows nothing of what this page shows.
  if (state.session !== lookedFor) visible = new Set();
  lookedFor = state.session;
  const before = visible;
  const marked = [...document.querySelectorAll("[data-sg-visible]")];
  visible = new Set(marked.filter((one) => one.checkVisibility()).map((one) => one.dataset.sgVisible));
  for (const text of new Set([...before, ...visible])) {
    const isVisible = visible.has(text);
    if (isVisible !== before.has(text)) post({ ...JSON.parse(text), is_visible: isVisible });
  }
}

function onPress(event) {
  const track = event.target.closest?.("[data-sg-track]");
  if (!track || event.button !== 0 || event.target.closest("[data-sg-intent]")) return;
  event.preventDefault();
  seekTo(track, event);
  const move = (moved) => seekTo(track, moved);
  const end = () => {
    window.removeEventListener("pointermove", move);
    window.removeEventListener("pointerup", end);
    window.removeEventListener("pointercancel", end);
  };
  window.addEventListener("pointermove", move);
  window.addEventListener("pointerup", end);
  window.addEventListener("pointercancel", end);
}

/** Shows less or more of the time around the pointer. */
function onWheel(event) {
  const track = event.target.closest?.("[data-sg-track]");
  if (!track || event.ctrlKey || event.deltaY === 0) return;
  event.preventDefault();
  const { start, end } = state;
  const time = start + shareAt(track, event) * (end - start);
  const factor = ZOOM ** Math.min(Math.max(event.deltaY / STEP, -3), 3);
  zoom(time - factor * (time - start), time + factor * (end - time));
}

/** Shows a time range at once; the session then sends what is drawn in it. */
export function zoom(start, end) {
  holdRange(start, end);
  post({ kind: "show-window", start, end });
}

function shareAt(track, event) {
  const { left, width } = track.getBoundingClientRect();
  return Math.min(Math.max((event.clientX - left) / Math.max(width, 1), 0), 1);
}

function seekTo(track, event) {
  const time = state.start + shareAt(track, event) * (state.end - state.start);
  hold(time);
  post({ kind: "seek", time });
}
