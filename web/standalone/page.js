// The page: runs the scenario, shows the run in the viewer, and plays it. It says what `data` says;
// places, colours and values come from the formulas that the program has written (formulas.js).
import { startCharts } from "./charts.js";
import { startClock } from "./clock.js";
import { startGestures } from "./gestures.js";
import { startKeyboard } from "./keyboard.js";
import { startNames } from "./names.js";
import { onFrame, timeNow, watchSessionState } from "./session_state.js";
import { readAddress, writeAddress } from "./address.js";
import { contactRun } from "./close_up_run.js";
import { firstDifference, valuesFor } from "./compare.js";
import { SuccessMap } from "./map.js";
import { cameraMessages, load } from "./page_data.js";
import { playRun, startPlayback } from "./playback.js";
import { onIntent } from "./post.js";
import { openRecording, readTables } from "./recording.js";
import { Rows, statesOf } from "./rows.js";
import { SceneFeed } from "./scene_feed.js";
import { drawCloseUps, withPicture } from "./viser_view.js";
import { cardHtml, checkHtml, endedHtml, stripHtml, waitingHtml } from "./words.js";

const PICTURES_BEFORE_START = 3;
const READ_EVERY_MS = 100;
const BESIDE_PANEL = 4; // px that viser leaves between a panel at a side and the scene
const PAUSE_MS = 700; // between two changes that are seen as two
const NONE = new Set();
const viewer = window.slipgrasp;
const { worker } = viewer;

let data = null;
let own = null;
let ghost = null;
let scene = null;
let contacts = null;
let isNew = false; // only the scene shows the run so far
let isAwaited = false; // the rest is shown with the next picture
let stale = new Set(); // charts that show an older run
let map = null;
let requests = 0;
let movedAt = -Infinity;
let before = null; // the run that the sliders were moved from
let dropped = null; // the recording that is compared with the run
let timeRange = [0, 1];
let drawnAt = NaN;
let readAt = -Infinity;
const values = new Map();
const hidden = new Map();
let haveStarted = null;
const started = new Promise((resolve) => (haveStarted = resolve));

start().catch(tellFailure);

async function start() {
  const address = readAddress();
  let messages = null;
  ({ data, messages } = load(address.dark));
  for (const { key, value } of data.controls) values.set(key, address.values.get(key) ?? value);
  listen();
  request();
  takeIntents(address);
  viewer.onSent = take;
  const panels = arrangement();
  keepFree(panels);
  await viewer.asked;
  const isPanel = ({ type }) => type.includes("Gui");
  viewer.feed(messages.filter((each) => !isPanel(each)));
  await firstPicture();
  viewer.feed(messages.filter(isPanel));
  viewer.feed(panels);
  viewer.feed(data.controls.map(({ key, uuid }) => update(uuid, { value: values.get(key) })));
  scene = new SceneFeed(data.scene);
  if (data.html.map) map = new SuccessMap({ ...data, placed }, makeMapWorker, () => values, (content) => setHtml("map", content));
  startPlayback(data, address.time, showPlayback);
  for (const begin of [startClock, startGestures, startCharts, startKeyboard, startNames]) begin();
  for (const each of [draw, read, frameCamera, updateCharts, drawContacts]) onFrame(each);
  watchSessionState();
  haveStarted();
}

/** Resolves once the scene is being drawn, which takes long; at the latest when it is out of sight. */
function firstPicture() {
  const later = window.requestAnimationFrame;
  return new Promise((resolve) => {
    later(function look() {
      if (window.__viserMutable?.nodeRefFromName[data.closeUps.facts.object]) {
        withPicture(resolve);
        later(() => later(resolve));
      } else later(look);
    });
  });
}

/** Where the panels go: into two columns or one; on a phone viser has one sheet for all. */
function arrangement() {
  const { two, one, narrow, sheet } = data.panels;
  if (window.innerWidth <= sheet) return [];
  return window.innerWidth >= narrow ? two : one;
}

/** Keeps the space at the sides free until the panels are there: the scene is drawn in its size at once. */
function keepFree(panels) {
  for (const { uuid, position } of panels) {
    if (position?.kind !== "edge") continue;
    const { width } = panels.findLast((each) => each.uuid === uuid && each.width !== undefined);
    document.documentElement.style.setProperty(`--sg-${position.edge}`, `${width + BESIDE_PANEL}px`);
  }
}

function takeIntents(address) {
  onIntent("choose-recording", chooseRecording);
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    event.preventDefault();
    takeRecording(event.dataTransfer.files[0]);
  });
  onIntent("choose-map", ({ field, value }) => map.choose(field, value));
  onIntent("compute-map", () => map.compute());
  onIntent("stop-map", () => {
    map.stop();
    map.draw();
  });
  onIntent("open-cell", ({ cell }) => setValues(new Map([...values, ...map.valuesOf(cell)])));
  onIntent("toggle-dark", () => writeAddress({ dark: !address.dark }));
  onIntent("toggle-line", ({ chart: key, line }) => {
    const chart = data.charts.find((each) => each.key === key);
    const lines = hidden.get(key) ?? new Set();
    const place = chart.lines.indexOf(line);
    if (!lines.delete(place)) lines.add(place);
    hidden.set(key, lines);
    viewer.feed([update(chart.uuid, { data: chart.columns(own, ghost, lines) })]);
    const button = document.querySelectorAll(`[data-sg-chart="${key}"] .sg-line`)[place];
    button?.setAttribute("aria-pressed", String(!lines.has(place)));
  });
}

function listen() {
  worker.onmessage = async ({ data: answer }) => {
    await started;
    if (answer.id !== requests) return;
    if (answer.seconds !== undefined) setHtml("card", waitingHtml(answer.seconds));
    else finish(answer);
  };
  worker.onerror = tellFailure;
}

/** What the viewer says: a slider has moved. */
function take(message) {
  if (message.type !== "GuiUpdateMessage") return;
  const control = data.controls.find(({ uuid }) => uuid === message.uuid);
  const value = message.updates.value;
  if (!control || !(value >= control.low && value <= control.high)) return;
  // While a slider is dragged, the ghost stays the run from before.
  const now = performance.now();
  if (now - movedAt > PAUSE_MS) before = own;
  movedAt = now;
  values.set(control.key, value);
  dropped = null;
  if (map !== null && !map.isAxis(control.key)) map.clear();
  writeAddress({ values: changed() });
  request();
}

/** Moves all sliders, and simulates. */
function setValues(wanted) {
  for (const [key, value] of wanted) {
    if (values.get(key) !== value && !map?.isAxis(key)) map?.clear();
    values.set(key, value);
  }
  viewer.feed(data.controls.map(({ key, uuid }) => update(uuid, { value: values.get(key) })));
  [before, movedAt] = [own, performance.now()];
  writeAddress({ values: changed() });
  request();
}

function chooseRecording() {
  const input = Object.assign(document.createElement("input"), { type: "file", accept: ".mcap" });
  input.onchange = () => takeRecording(input.files[0]);
  input.click();
}

/** Simulates the scenario of a recording, to compare both. */
async function takeRecording(file) {
  if (!file) return;
  dropped = { name: file.name };
  try {
    const opened = openRecording(new Uint8Array(await file.arrayBuffer()), data.recording);
    const set = valuesFor(opened, data);
    dropped.read = readTables(opened, data.recording);
    setValues(new Map(data.controls.map(({ key, value }) => [key, set.get(key) ?? value])));
  } catch (error) {
    dropped = { words: `${file.name} cannot be checked here: ${error.message}` };
    showCheck();
  }
}

/** How the recording compares with the run, in words. */
function compared() {
  if (dropped?.read) {
    const found = firstDifference(dropped.read, own, data);
    const words = found ? `differs first in ${found}` : `is equal to this run bit by bit: SHA-256 ${own.sha256}`;
    dropped = { words: `${dropped.name} ${words}` };
  }
  return dropped?.words ?? "";
}

function showCheck() {
  setHtml("check", checkHtml(own, data, changed(), compared()));
}

function changed() {
  const moved = data.controls.filter(({ key, value }) => values.get(key) !== value);
  return new Map(moved.map(({ key }) => [key, values.get(key)]));
}

function request() {
  const { run } = data;
  const outcomes = Object.fromEntries(Object.entries(run.ends).map(([k, end]) => [k, end.outcome]));
  const job = { scenario: run.scenario, columns: statesOf(run), window: data.map.categories.window, outcomes };
  worker.postMessage({ id: ++requests, values: placed(values), ...job });
}

/** Values of sliders that differ from the scenario, by their places. */
function placed(wanted) {
  const moved = data.controls.filter(({ key, value }) => wanted.get(key) !== value);
  return moved.flatMap(({ key, places }) => places.map((place) => [place, wanted.get(key)]));
}

function makeMapWorker() {
  const made = viewer.makeWorker();
  made.onerror = tellFailure;
  return made;
}

function finish(answer) {
  if (answer.rows.length === 0) {
    // It ended before its first row: nothing of it can be shown.
    setHtml("card", endedHtml(data.run.ends[answer.status].headline));
    return;
  }
  ghost = before;
  own = new Rows(answer, data.run);
  playRun(own);
  show();
}

/** Shows a new run: the scene first, which takes longest to draw, all else while it is drawn. */
function show() {
  drawnAt = NaN;
  draw(timeNow());
  document.documentElement.dataset.sgSha256 = own.sha256;
  [isNew, isAwaited] = [true, false];
  if (document.hidden || !window.__viserMutable) showRest();
}

function showRest() {
  [isNew, readAt] = [false, -Infinity];
  setHtml("card", cardHtml(own, data.run));
  showCheck();
  setHtml("strip", stripHtml(data, own, ghost, timeRange));
  stale = new Set(data.charts);
  updateCharts();
  contacts = contactRun(data.closeUps, own, ghost);
}

/** Gives the run to the charts that are in sight, to others once they are. */
function updateCharts() {
  const seen = [...stale].filter(({ key }) => {
    const legend = document.querySelector(`[data-sg-chart="${key}"]`);
    return legend !== null && legend.getBoundingClientRect().top < window.innerHeight;
  });
  if (seen.length === 0) return;
  for (const chart of seen) stale.delete(chart);
  viewer.feed(seen.map(({ key, uuid, columns }) => update(uuid, { data: columns(own, ghost, hidden.get(key) ?? NONE) })));
}

/** The controls of the play head; where another time range is shown, timeline and charts. */
function showPlayback({ playing, start, end }, last) {
  const isWhole = end - start >= data.run.duration;
  setHtml("transport", data.transport[`${playing} ${isWhole ? "whole run" : "closer"}`]);
  if (last.start === start && last.end === end) return;
  timeRange = [start, end];
  if (own !== null) setHtml("strip", stripHtml(data, own, ghost, timeRange));
}

function draw(time) {
  if (own === null || time === drawnAt) return;
  drawnAt = time;
  viewer.feed(scene.messages(own.at(time), ghost?.at(time) ?? null));
}

function drawContacts(time) {
  if (isNew && !isAwaited) {
    isAwaited = true;
    withPicture(() => drawContacts(time));
    return;
  }
  if (isNew) showRest(); // also if there is no picture, because the scene is out of sight
  if (contacts !== null) drawCloseUps({ top: 0, bottom: covered }, { run: contacts, time });
}

function read(time) {
  const now = performance.now();
  if (own === null || now - readAt < READ_EVERY_MS) return;
  readAt = now;
  const readings = Object.fromEntries(data.charts.map(({ key, read: words }) => [key, words(own, time)]));
  const text = JSON.stringify({ time, values: readings, spots: {}, marked: {}, changes: [], mark: null });
  const element = document.querySelector("[data-sg-readings]");
  if (element && element.dataset.sgReadings !== text) element.dataset.sgReadings = text;
}

let framed = "";
let covered = 0;
let pictures = 0;

/** Puts the camera in front of the hand whenever the size of the picture changes. */
function frameCamera() {
  const element = document.querySelector("canvas[data-engine]");
  // What holds the canvas has its new size at once, the canvas later.
  const canvas = element?.parentElement.getBoundingClientRect();
  if (!canvas || canvas.width < 1 || own === null) return;
  const strip = document.querySelector(".sg-transport");
  const panel = strip?.closest("[data-floating-window]") ?? strip?.closest(".mantine-Paper-root");
  const above = panel ? canvas.bottom - panel.getBoundingClientRect().top : 0;
  covered = above > 0 && above < 0.6 * canvas.height ? above : 0;
  const seen = [canvas.width, canvas.height, covered].map(Math.round);
  if (String(seen) !== framed) {
    const { width: message, margin } = data.panels;
    if (seen[0] !== Number(framed.split(",")[0])) {
      viewer.feed([{ ...message, width: seen[0] - 2 * margin, counter: ++message.counter }]);
    }
    framed = String(seen);
    viewer.feed(cameraMessages(data, seen));
  } else if (element.clientWidth === seen[0] && ++pictures === PICTURES_BEFORE_START) {
    document.documentElement.dataset.sgStarted = "";
  }
}

function setHtml(name, content) {
  viewer.feed([update(data.html[name], { content })]);
}

function update(uuid, updates) {
  return { type: "GuiUpdateMessage", uuid, updates };
}

function tellFailure(error) {
  const note = document.createElement("p");
  note.className = "sg-banner";
  note.setAttribute("role", "alert");
  note.textContent = `This page cannot simulate here: ${error?.message ?? error}`;
  document.body.append(note);
}
