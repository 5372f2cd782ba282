// Fewer pixels while the mouse pulls the object, turns the camera or moves the play head, where no
// graphics card draws the pictures: a picture then takes a good part of the time between two.
import { beforePicture } from "./viser_view.js";

const REDUCED = 0.4; // pixels of a picture per pixel of the page
const SOFTWARE = /swiftshader|llvmpipe|software|basic render/i;

let isMoving = false; // the mouse, with a button pressed on the view or the timeline
let full = null; // the resolution to restore
let isSoftware = null;

/** Begins to watch the mouse. */
export function startResolution() {
  document.addEventListener("pointerdown", onPress, true);
  beforePicture(choose);
}

function onPress({ target }) {
  if (target !== window.__viserMutable?.canvas && !target.closest?.("[data-sg-track]")) return;
  const pressed = new AbortController();
  const listen = (type, call) => window.addEventListener(type, call, { signal: pressed.signal });
  const end = () => {
    pressed.abort();
    isMoving = false;
    if (full !== null) window.__viserMutable.requestRender();
  };
  listen("pointermove", () => (isMoving = true));
  listen("pointerup", end);
  listen("pointercancel", end);
}

function choose(renderer) {
  isSoftware ??= SOFTWARE.test(nameOf(renderer.getContext()));
  if (!isSoftware || isMoving === (full !== null)) return;
  const ratio = renderer.getPixelRatio();
  renderer.setPixelRatio(isMoving ? Math.min(ratio, REDUCED) : full);
  full = isMoving ? ratio : null;
}

function nameOf(context) {
  const names = context.getExtension("WEBGL_debug_renderer_info");
  return names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
}
