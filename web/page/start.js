// Shows the page once the first picture is on it, in the colours that its user prefers.
import { onFrame, state } from "./session_state.js";
import { hasPicture, onPicture } from "./viser_view.js";

const PATIENCE_MS = 2000; // for the colours, which a round trip to the session brings
let readyAt = null;

/** Begins to wait for the first picture. */
export function startStart() {
  onFrame(look);
  onPicture(look);
}

function look() {
  const page = document.documentElement;
  if (page.dataset.sgStarted !== undefined || !state.ready) return;
  readyAt ??= performance.now();
  const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  const isRight = page.dataset.mantineColorScheme === (dark ? "dark" : "light");
  if (!isRight && performance.now() - readyAt < PATIENCE_MS) return;
  // Without a run there is a message, which needs no picture.
  if (hasPicture() || !state.shows) page.dataset.sgStarted = "";
}
