// Shows whether the server is there, and the messages of the session. Once the
// server is back, viser opens its connection again (reconnect.js) and is given a new session;
// link.js then brings back what was shown, without a reload of the page.
import { onChange, state } from "./session_state.js";
import { noteConnected, startReconnect, tryInTurn, tryNow } from "./reconnect.js";

const ASK_MS = 1500;
const AWAY_ASK_MS = 1000;
const PATIENCE_MS = 2500;
const NOTICE_MS = 20_000;
const NEW_SESSION_MS = 7000; // longer than an attempt of viser to connect

let answeredAt = null;
let isAway = false;
let lonelySince = null;
let server = "";
let asking = false;
let nextAsk;

/** Begins to ask after the server. */
export function startBanner() {
  startReconnect();
  // The timers of a page that nobody sees hardly run.
  document.addEventListener("visibilitychange", () => document.hidden || ask());
  onChange((now, before) => {
    if (now.notice !== before.notice) now.notice === "" ? clear("notice") : say(now.notice);
    if (now.session !== before.session) {
      lonelySince = null;
      clear("alarm");
    }
  });
  ask();
}

/** Shows a sentence until it had time to be read, or the user dismisses it. */
export function say(sentence) {
  show("notice", "", sentence, "Dismiss", () => clear("notice"));
  const box = document.getElementById("sg-notice");
  const leave = () => (box.matches(":hover, :focus-within") ? wait() : box.remove());
  const wait = () => setTimeout(leave, NOTICE_MS);
  wait();
}

async function ask() {
  if (asking) return;
  asking = true;
  clearTimeout(nextAsk);
  const key = state.session || "none";
  try {
    const answer = await fetch(new URL(`../sessions/${key}`, import.meta.url), {
      cache: "no-store",
      signal: AbortSignal.timeout(PATIENCE_MS),
    });
    if (!answer.ok) throw new Error(answer.statusText);
    const found = await answer.json();
    answeredAt = new Date();
    if (key === (state.session || "none")) judge(found);
  } catch {
    isAway = true;
    lonelySince = null;
    const [title, since] = answeredAt
      ? [
          "Connection lost.",
          `The server does not respond; the page has been frozen since ${answeredAt.toLocaleTimeString()}. `,
        ]
      : ["Waiting for the server.", "It has not answered yet. "];
    alarm(
      title,
      `${since}This page continues automatically as soon as the server ${answeredAt ? "is back" : "does"}.`,
      "Try again",
      ask,
    );
  }
  asking = false;
  nextAsk = setTimeout(ask, isAway ? AWAY_ASK_MS : ASK_MS);
}

function judge(found) {
  if (found.alive) {
    server = found.server;
    isAway = false;
    lonelySince = null;
    noteConnected();
    clear("alarm");
    return;
  }
  lonelySince ??= performance.now();
  // Who is turned away is answered at once: no attempt is under way.
  found.full ? tryNow() : tryInTurn();
  const wasAway = isAway || (server !== "" && server !== found.server);
  const alone = performance.now() - lonelySince;
  if (found.full) {
    alarm(
      "Too many viewers.",
      "The server has no capacity for another page at the moment; this one waits.",
      "Try again",
      ask,
    );
  } else if (state.session === "") {
    clear("alarm"); // the first session of this page is on its way
  } else if (wasAway) {
    alarm("The server is back.", "Opening what you saw …", "Reload now", () => location.reload());
  } else if (alone > NEW_SESSION_MS) {
    alarm(
      "This session ended by an internal error.",
      "Runs that were saved are safe.",
      "Start again",
      () => location.reload(),
    );
  }
}

function alarm(title, text, action, act) {
  show("alarm", title, text, action, act);
}

function show(kind, title, text, action, act) {
  const told = `${title} ${text}`;
  let box = document.getElementById(`sg-${kind}`);
  if (box?.dataset.told === told) return;
  box?.remove();
  box = document.createElement("div");
  box.id = `sg-${kind}`;
  box.className = "sg-banner";
  box.dataset.told = told;
  box.setAttribute("role", kind === "alarm" ? "alert" : "status");
  const strong = document.createElement("b");
  strong.textContent = title;
  const words = document.createElement("span");
  words.textContent = text;
  const button = document.createElement("button");
  button.textContent = action;
  button.addEventListener("click", act);
  box.append(strong, words, button);
  document.body.append(box);
}

function clear(kind) {
  document.getElementById(`sg-${kind}`)?.remove();
}
