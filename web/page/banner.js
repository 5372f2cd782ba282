// Tells honestly whether the server is there, and shows what the session has to say. viser opens
// its connection again by itself and is then given a new session; this script brings back what
// was shown (link.js), without a reload of the page.
import { onChange, state } from "./beacon.js";

const ASK_MS = 1500;
const PATIENCE_MS = 2500;
const NEW_SESSION_MS = 5000;
const FOCUS_MS = 4000;

let answeredAt = Date.now();
let lonelySince = null;
let server = "";

/** Begins to ask after the server. */
export function startBanner() {
  onChange((now, before) => {
    if (now.notice !== before.notice) now.notice === "" ? clear("notice") : say(now.notice);
    if (now.session !== before.session) {
      lonelySince = null;
      clear("alarm");
    }
  });
  ask();
}

/** Shows a sentence until the user dismisses it. */
export function say(sentence) {
  show("notice", "", sentence, "Dismiss", () => clear("notice"));
}

async function ask() {
  const key = state.session || "none";
  try {
    const answer = await fetch(`/dashboard/sessions/${key}`, {
      cache: "no-store",
      signal: AbortSignal.timeout(PATIENCE_MS),
    });
    if (!answer.ok) throw new Error(answer.statusText);
    const found = await answer.json();
    answeredAt = Date.now();
    if (key === (state.session || "none")) judge(found);
  } catch {
    const since = new Date(answeredAt).toLocaleTimeString();
    alarm(
      "Connection lost.",
      `The server does not answer; what you see is frozen since ${since}. ` +
        "This page goes on by itself as soon as the server is back.",
    );
  }
  setTimeout(ask, ASK_MS);
}

function judge(found) {
  const isSameServer = server === "" || server === found.server;
  if (found.alive) {
    server = found.server;
    lonelySince = null;
    clear("alarm");
    return;
  }
  lonelySince ??= Date.now();
  letViserConnect();
  const alone = Date.now() - lonelySince;
  if (found.full) {
    alarm("Too many viewers.", "The server has no room for another page at the moment; this one waits.");
  } else if (state.session !== "" && !isSameServer) {
    alarm("The server is back.", "Opening what you saw …");
  } else if (state.session !== "" && alone > NEW_SESSION_MS) {
    show(
      "alarm",
      "This session ended by an internal error.",
      "Runs that were saved are safe.",
      "Start again",
      () => location.reload(),
    );
  }
}

/** viser only tries again in a window that has the focus; one beside it should come back, too. */
function letViserConnect() {
  if (document.hasFocus()) return;
  document.hasFocus = () => true;
  window.dispatchEvent(new Event("focus"));
  setTimeout(() => delete document.hasFocus, FOCUS_MS);
}

function alarm(title, text) {
  show("alarm", title, text);
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
  box.append(strong, words);
  if (action !== undefined) {
    const button = document.createElement("button");
    button.textContent = action;
    button.addEventListener("click", act);
    box.append(button);
  }
  document.body.append(box);
}

function clear(kind) {
  document.getElementById(`sg-${kind}`)?.remove();
}
