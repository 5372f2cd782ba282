// The play head: what moves it, and the state that the modules of the dashboard read.
import { onIntent } from "./post.js";
import { hold, timeNow } from "./session_state.js";

const CLOSER = 4;
const SHORTEST = 1e-3; // [s]
const ready = { session: "", ready: true, run: "", charts: "", notice: "", lecture: false, pace: null };
const element = document.createElement("i");
let given = null;
let duration = 0;
let playback = {};
let run = null;
let show = () => {};
let count = 0;

/** Begins to play, or stands at a time; calls back with every state and the one before. */
export function startPlayback(data, time, showPlayback) {
  [given, duration, show] = [data.playback, data.run.duration, showPlayback];
  element.id = "sg-session-state";
  element.hidden = true;
  document.body.append(element);
  takeIntents();
  const { start, end, speed } = given;
  write({ start, end, speed, time: time ?? given.time, playing: time === null });
  if (time !== null && (time < start || time > end)) showRange(0, duration);
  if (time !== null) seek(time);
}

/** Takes the run whose rows and events the play head steps over. */
export function playRun(rows) {
  run = rows;
}

function takeIntents() {
  const names = Object.keys(given.speeds);
  const speeds = Object.values(given.speeds);
  onIntent("toggle-play", () => write({ time: timeNow(), playing: !playback.playing }));
  onIntent("seek", ({ time }) => seek(time));
  onIntent("step", ({ direction }) => seek(neighbour(run.times, timeNow(), direction)));
  onIntent("jump-to-event", ({ direction }) => {
    const times = run.changes.map((change) => change.time);
    seek(neighbour([0, ...times, run.end], timeNow(), direction));
  });
  onIntent("go-to-next-slip", () => {
    const onsets = run.changes.filter(({ phase }) => phase !== 0).map((change) => change.time);
    const later = onsets.find((time) => time > timeNow() + 1e-12);
    if (onsets.length > 0) seek(later ?? onsets[0]);
  });
  onIntent("go-to-edge", ({ direction }) => {
    const [edge, last] = direction > 0 ? [playback.end, duration] : [playback.start, 0];
    seek(timeNow() === edge ? last : edge);
  });
  onIntent("set-speed", ({ name }) => write({ time: timeNow(), speed: given.speeds[name] }));
  onIntent("change-speed", ({ direction }) => {
    const place = speeds.indexOf(playback.speed) + direction;
    const name = names[Math.min(Math.max(place, 0), names.length - 1)];
    write({ time: timeNow(), speed: given.speeds[name] });
  });
  onIntent("choose-window", () => showRange(0, duration));
  onIntent("show-window", ({ start, end }) => showRange(start, end));
  onIntent("zoom", () => {
    const half = (0.5 * (playback.end - playback.start)) / CLOSER;
    showRange(timeNow() - half, timeNow() + half);
  });
}

/** Shows a time range, at a speed at which it passes in a few seconds. */
function showRange(from, to) {
  const range = rangeOf(from, to - from);
  const wanted = (range.end - range.start) / given.secondsPerPass;
  const distance = (speed) => Math.abs(Math.log(speed / wanted));
  const speed = Object.values(given.speeds).reduce((a, b) => (distance(b) < distance(a) ? b : a));
  write({ ...range, speed, time: Math.min(Math.max(timeNow(), range.start), range.end) });
}

function seek(time) {
  const wanted = Math.min(Math.max(time, 0), duration);
  const length = playback.end - playback.start;
  if (wanted < playback.start || wanted > playback.end) write(rangeOf(wanted - 0.5 * length, length));
  hold(wanted);
  write({ time: wanted, playing: false });
}

function rangeOf(from, wanted) {
  const length = Math.min(Math.max(wanted, SHORTEST), duration);
  const start = Math.min(Math.max(from, 0), duration - length);
  return { start, end: start + length };
}

function write(changed) {
  const before = playback;
  playback = { ...playback, ...changed };
  const { start, end, time, speed, playing } = playback;
  // The count makes the state new, so that the play head is taken from here.
  const state = { ...ready, duration, start, end, time, speed, playing, count: count++ };
  element.dataset.sgState = JSON.stringify(state);
  show(playback, before);
}

/** The next time (1) or the previous one (-1); times ascend, some twice. */
function neighbour(times, time, direction) {
  const isLater = (other) => (direction > 0 ? other > time + 1e-12 : other < time - 1e-12);
  const found = direction > 0 ? times.find(isLater) : times.findLast(isLater);
  return found ?? time;
}
