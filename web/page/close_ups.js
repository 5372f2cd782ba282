// The close-ups over the view of the dashboard.
import { coveredHeight } from "./page_layout.js";
import { onFrame } from "./session_state.js";
import { drawCloseUps } from "./viser_view.js";

/** Begins to draw them. */
export function startCloseUps() {
  onFrame(() => drawCloseUps({ top: 0, bottom: coveredHeight }));
}
