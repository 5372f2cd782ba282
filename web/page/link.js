// The address of the page names the run and the time on the screen, and what the user has made of
// the charts: /?run=ID&t=2.5&charts=…. Opened with such an address the page asks its session for
// that. It also asks a new session for what the last one showed, when the server was away in
// between. The browser keeps the layout of the charts for pages without one in their address.
import { onChange, onFrame, state, timeNow } from "./session_state.js";
import { say } from "./banner.js";
import { post } from "./post.js";

const SETTLED_MS = 400;
const KEPT_LAYOUT = "sg-charts";
const MOST_LAYOUT = 6000;
let wanted = fromAddress();
let layout = new URLSearchParams(location.search).get("charts") ?? kept();
let movedAt = 0;
let atRest = "";

/** Begins to follow the session. */
export function startLink() {
  // What is relative on the page hangs on the slash, which a proxy may have taken away.
  if (!location.pathname.endsWith("/")) {
    history.replaceState(history.state, "", `${location.pathname}/${location.search}`);
  }
  onChange(follow);
  onFrame(writeAddress);
  document.addEventListener("click", (event) => {
    const button = event.target.closest?.("[data-sg-copy-link]");
    if (button) copy(button);
  });
}

function fromAddress() {
  const query = new URLSearchParams(location.search);
  if (!query.has("run")) return null;
  return { run: query.get("run").slice(0, 200), time: (query.get("t") ?? "").slice(0, 40) };
}

function kept() {
  try {
    return localStorage.getItem(KEPT_LAYOUT) ?? "";
  } catch {
    return "";
  }
}

function keep(text) {
  try {
    if (text !== kept()) localStorage.setItem(KEPT_LAYOUT, text);
  } catch {
    // A browser that keeps nothing for pages has the layout in the address all the same.
  }
}

function follow(now, before) {
  movedAt = performance.now();
  if (now.session === before.session) {
    if (now.charts !== before.charts) keep(now.charts);
    return;
  }
  if (before.session !== "") {
    layout = before.charts;
    wanted = before.run === "" ? null : { run: before.run, time: String(before.time) };
    if (wanted === null) {
      say("The server is back. The run on the screen had not been saved, so this is a new one.");
    }
  }
  if (layout !== "") post({ kind: "lay-out-charts", layout: layout.slice(0, MOST_LAYOUT) });
  if (wanted !== null) post({ kind: "open-link", ...wanted });
  wanted = null;
}

/** Lets the address follow, once the play head rests: browsers count how often it changes. */
function writeAddress() {
  // Until a run is shown, the address still says which one was asked for.
  if (state.run === "" && atRest === "") return;
  if (state.session === "" || state.playing || performance.now() - movedAt < SETTLED_MS) return;
  const resting = `${state.run} ${timeNow()} ${state.charts}`;
  if (resting === atRest) return;
  atRest = resting;
  history.replaceState(history.state, "", address());
}

function address() {
  const query = new URLSearchParams(location.search);
  query.delete("run");
  query.delete("t");
  query.delete("charts");
  // viser adds its own address behind a proxy that shows the page at a path.
  query.delete("websocket");
  if (state.run !== "") {
    for (const [name, value] of Object.entries(linked())) query.set(name, value);
  }
  return query.size === 0 ? location.pathname : `${location.pathname}?${query}`;
}

/** What a link to the run on the screen names. */
function linked() {
  const time = String(Number(timeNow().toFixed(6)));
  return { run: state.run, t: time, ...(state.charts === "" ? {} : { charts: state.charts }) };
}

async function copy(button) {
  if (state.run === "") {
    say("This run is not saved yet; it has a link once it is.");
    return;
  }
  const link = `${location.origin}${location.pathname}?${new URLSearchParams(linked())}`;
  try {
    await navigator.clipboard.writeText(link);
  } catch {
    say(`The browser does not let the page copy; the link is ${link}`);
    return;
  }
  button.dataset.sgCopied = "";
  setTimeout(() => delete button.dataset.sgCopied, 1500);
}
