// Brings what the user does to the session: one request at a time, in order. Of what would
// be void by the time it arrives (a play head that is dragged on) only the newest is sent.
import { onChange, state } from "./session_state.js";
import { say } from "./banner.js";

const NEWEST_COUNTS = new Set(["seek", "show-window"]);
const MOST_AT_ONCE = 20;
const MOST_WAITING = 200;
const waiting = [];
let underWay = false;

// What was done before the session was known waits for it.
onChange((now, before) => {
  if (now.session !== before.session) send();
});

/** Sends what the user asks for, such as {kind: "seek", time: 0.08}. */
export function post(intent) {
  const last = waiting.at(-1);
  if (last !== undefined && last.kind === intent.kind && NEWEST_COUNTS.has(intent.kind)) {
    waiting.pop();
  }
  if (waiting.length < MOST_WAITING) waiting.push(intent);
  send();
}

async function send() {
  if (underWay || waiting.length === 0 || state.session === "") return;
  underWay = true;
  const body = JSON.stringify(waiting.splice(0, MOST_AT_ONCE));
  try {
    const address = new URL(`../sessions/${state.session}/intents`, import.meta.url);
    const answer = await fetch(address, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body,
    });
    if (!answer.ok && answer.status !== 404) say((await answer.json()).detail);
  } catch {
    // The server is lost; the banner finds that out by itself, and what was asked for is void.
    waiting.length = 0;
  } finally {
    underWay = false;
  }
  send();
}
