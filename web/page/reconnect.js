// When viser opens its connection again. Left alone it begins an attempt every second while the
// window has the focus, and abandons the one before. A browser lets an attempt wait the longer
// the more have failed, in the end for more than a second: after a long outage none would ever
// be finished. So viser sees a window without the focus, save for the moment when an attempt
// makes sense: once the server answers. That also works in a window beside the user's own.
const ATTEMPT_MS = 6000; // viser itself abandons an attempt after five seconds

let mayTry = false;
let triedAt = performance.now(); // a page begins with an attempt

/** Takes the decision when to try away from viser. */
export function startReconnect() {
  document.hasFocus = () => mayTry;
  // An interval that viser began before sees the change.
  window.dispatchEvent(new Event("blur"));
}

/** Lets viser try once; without effect while it is connected. */
export function tryNow() {
  triedAt = performance.now();
  mayTry = true;
  window.dispatchEvent(new Event("focus"));
  mayTry = false;
  window.dispatchEvent(new Event("blur"));
}

/** Lets viser try once, unless an attempt may still be under way. */
export function tryInTurn() {
  if (performance.now() - triedAt > ATTEMPT_MS) tryNow();
}

/** No attempt is under way any more, as one has succeeded. */
export function noteConnected() {
  triedAt = -Infinity;
}
