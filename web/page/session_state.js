// The state of the session, in a hidden element that the session writes into the page:
//   <i id="sg-session-state" data-sg-state='{"session": KEY, "run": ID, "time": 0.08, …}'>
// It is written when something changes, and now and then while time runs on; in between the
// page moves the play head itself, so that no message is needed for it.

import { advance } from "./pace.js";

/** The last state of the session: session, whether it is ready to be shown, whether it shows a run, run, charts, notice, lecture, time, start, end, duration [s], speed, pace, playing. */
export let state = {
  session: "",
  ready: false,
  shows: false,
  run: "",
  charts: "",
  notice: "",
  lecture: false,
  time: 0,
  start: 0,
  end: 1,
  duration: 1,
  speed: 1,
  pace: null,
  playing: false,
};

const HOLD_MS = 2000;
const LAG_MS = 5000; // after which the play head no longer waits for a picture
const SHORTEST = 1e-3; // of the times that are shown [s]
const changeListeners = [];
const frameListeners = [];
let written = "";
let toldAt = performance.now();
let held = null;
let picturedTime = () => null;
let picturedAt = -Infinity;
let shown = null;

/** Calls back with (state, previous state) whenever the session has sent its state. */
export function onChange(listener) {
  changeListeners.push(listener);
}

/**
 * Calls back with the time of the play head [s]: for every picture of the browser, or while the run
 * plays, of the scene.
 */
export function onFrame(listener) {
  frameListeners.push(listener);
}

/**
 * Makes a moving play head stand where the picture does, and all that shows its time change with it.
 * time: of the last picture [s], or null; onPicture: calls back after every picture.
 */
export function followPicture(time, onPicture) {
  picturedTime = time;
  onPicture(() => {
    picturedAt = performance.now();
    if (state.playing) notifyFrame();
  });
}

function isFollowing() {
  return state.playing && performance.now() - picturedAt < LAG_MS;
}

/** Where the play head stands now [s]. */
export function timeNow() {
  if (held !== null) return held.time;
  if (!state.playing) return state.time;
  const seen = isFollowing() ? picturedTime() : null;
  return seen ?? advance(state, (performance.now() - toldAt) / 1000);
}

/** Which share of the window lies before a time, from 0 to 1. */
export function shareOf(time) {
  const share = (time - state.start) / Math.max(state.end - state.start, 1e-12);
  return Math.min(Math.max(share, 0), 1);
}

/** Shows the play head where the user has put it, until the session says so itself. */
export function hold(time) {
  held = { time, until: performance.now() + HOLD_MS };
}

/** Shows a time range, until the session says so itself. */
export function holdRange(from, to) {
  const first = Math.max(from, 0);
  const end = Math.min(Math.max(to, first + SHORTEST), state.duration);
  const start = Math.max(Math.min(first, end - SHORTEST), 0);
  shown = { start, end, until: performance.now() + HOLD_MS };
  showRange();
}

function showRange() {
  const { start, end } = shown;
  if (state.start === start && state.end === end) shown = null;
  else state = { ...state, start, end };
}

/** Begins to look at the state, once for every picture of the browser. */
export function watchSessionState() {
  if (shown !== null && performance.now() > shown.until) [shown, written] = [null, ""];
  read();
  if (held !== null && performance.now() > held.until) held = null;
  if (held !== null || !isFollowing()) notifyFrame();
  requestAnimationFrame(watchSessionState);
}

function notifyFrame() {
  const time = timeNow();
  for (const listener of frameListeners) listener(time);
}

function read() {
  const text = document.getElementById("sg-session-state")?.dataset.sgState;
  // A panel that is folded takes the element away; its last state holds.
  if (text === undefined || text === written) return;
  written = text;
  const previous = state;
  state = JSON.parse(text);
  toldAt = performance.now();
  if (shown !== null) showRange();
  if (held !== null && state.time === held.time) held = null;
  for (const listener of changeListeners) listener(state, previous);
}
