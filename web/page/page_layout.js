// The size of the page: reported to the session whenever it has changed and come to rest, so
// that the columns, the playback panel and the camera fit. Only the page knows its own pixels:
// those of the canvas depend on the screen, and on how fast it draws.
import { onFrame, state } from "./session_state.js";
import { post } from "./post.js";

/** Height at the bottom of the scene that a panel covers [px], as measured last. */
export let coveredHeight = 0;

const INTERVAL_MS = 120;
let lookedAt = -Infinity;
let seen = "";
let told = "";

/** Begins to measure. */
export function startPageLayout() {
  onFrame(() => {
    const now = performance.now();
    if (now - lookedAt < INTERVAL_MS || state.session === "") return;
    lookedAt = now;
    const measured = measure();
    if (measured === null) return;
    const before = seen;
    seen = `${state.session} ${JSON.stringify(measured)}`;
    if (seen !== before || seen === told) return;
    told = seen;
    post(measured);
  });
}

function measure() {
  const scene = document.querySelector("canvas[data-engine]")?.getBoundingClientRect();
  if (!scene || scene.width < 1 || scene.height < 1) return null;
  coveredHeight = covered(scene);
  return {
    kind: "measure-page",
    layout: {
      width: window.innerWidth,
      height: window.innerHeight,
      scene_width: Math.round(scene.width),
      scene_height: Math.round(scene.height),
      covered: coveredHeight,
    },
    prefers_dark: window.matchMedia("(prefers-color-scheme: dark)").matches,
  };
}

/** How much of the scene's lower half lies below the upper edge of what holds the strip: a window
 * of its own, or on a phone the sheet of everything. */
function covered(scene) {
  const strip = document.querySelector(".sg-transport");
  const panel =
    strip?.closest("[data-floating-window]") ?? strip?.closest(".mantine-Paper-root");
  const height = panel ? scene.bottom - panel.getBoundingClientRect().top : 0;
  return height > 0 && height < 0.6 * scene.height ? Math.round(height) : 0;
}
