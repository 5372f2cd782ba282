// What the user has unfolded stays so when the session writes it anew:
//   <details data-sg-fold='NAME'>
import { onFrame } from "./session_state.js";

const unfolded = new Set();

/** Begins to note what is unfolded. */
export function startFolds() {
  document.addEventListener("click", (event) => {
    const fold = event.target.closest?.("[data-sg-fold] > summary")?.parentElement;
    if (!fold) return;
    // The click has not turned it yet.
    fold.open ? unfolded.delete(fold.dataset.sgFold) : unfolded.add(fold.dataset.sgFold);
  });
  onFrame(() => {
    for (const name of unfolded) {
      for (const fold of document.querySelectorAll(`[data-sg-fold="${name}"]:not([open])`)) {
        fold.open = true;
      }
    }
  });
}
