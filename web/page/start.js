// Shows the page once the first picture is on it, in the colours that its user prefers.
import { onFrame, state } from "./session_state.js";

const PATIENCE_MS = 2000; // for the colours, which a round trip to the session brings
let readyAt = null;
let pictures = 0;

/** Begins to wait for the first picture. */
export function startStart() {
  onFrame(() => {
    const page = document.documentElement;
    if (page.dataset.sgStarted !== undefined || !state.ready) return;
    readyAt ??= performance.now();
    const dark = window.matchMedia("(prefers-color-scheme: dark)").matches;
    const isRight = page.dataset.mantineColorScheme === (dark ? "dark" : "light");
    if (!isRight && performance.now() - readyAt < PATIENCE_MS) return;
    // The scene is drawn after the elements of the page, which bring the state.
    if (++pictures > 2) page.dataset.sgStarted = "";
  });
}
