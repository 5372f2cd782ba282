// The view as viser draws it now: its run, its time, and where its camera is, from what viser's page
// shows its own tests.
import { ContactRun } from "./contact_run.js";
import { Overlay } from "./overlay.js";
import { multiply } from "./projection.js";

const [PACKET, CLOCK] = ["/close-ups", "/clock"]; // slipgrasp.web.scene.close_ups
const LABEL = "/push/words"; // slipgrasp.web.scene.push_view
const MARK = /\/contact\d+\/tip\/(ball|pad|halo|arrows)$/; // slipgrasp.web.scene.contact_view
const MARGIN = 8;

let known = null;
let run = null;
let overlay = null;
let pictured = null; // the run and the time of the last picture
let isPictured = false;
const [beforeListeners, pictureListeners] = [[], []];

/**
 * Draws the close-ups over the view. covered: what of its top and bottom is not free [px]; given:
 * the run and the time; null for those that the scene shows.
 */
export function drawCloseUps(covered, given = null) {
  const { scene, canvas2d } = window.__viserMutable ?? {};
  // The element over the scene that has its size, once viser has made it.
  const host = canvas2d?.parentElement;
  if (!host || !scene) return;
  if (overlay?.element.parentElement !== host) {
    overlay = new Overlay(host, JSON.parse(document.getElementById("sg-colours").textContent));
  }
  const draw = (shown) => {
    const view = readView(covered, shown);
    overlay.draw(view);
    return view !== null;
  };
  scene.onBeforeRender = (renderer) => {
    paintMarks();
    for (const listener of beforeListeners) listener(renderer);
  };
  // What comes with a picture is drawn with it; all else that may change, before the next one.
  scene.onAfterRender = () => {
    pictured = given ?? shownByScene();
    isPictured = draw(pictured);
    for (const listener of pictureListeners) listener();
  };
  draw(given ?? pictured);
}

/**
 * Gives the marks of contacts the colours of the instant that is about to be drawn. viser does so
 * with the next picture, but moves nodes at once: they would have the colours of another instant.
 */
function paintMarks() {
  const { nodeRefFromName } = window.__viserMutable;
  for (const [name, { message }] of Object.entries(window.__viserSceneTree.getState())) {
    if (!MARK.test(name)) continue;
    const colours = message.props.color ?? message.props.colors;
    const [red, green, blue] = colours;
    const colour = (red << 16) | (green << 8) | blue;
    nodeRefFromName[name]?.traverse((node) => {
      const paint = node.material?.color;
      if (node.setColorAt) paintArrows(node, colours);
      else if (paint && paint.getHex() !== colour) paint.setHex(colour);
    });
  }
}

/** Gives arrows, which are instances of one mesh, their colours: three bytes each. */
function paintArrows(mesh, colours) {
  if (!mesh.colorsTexture) return; // not drawn yet
  const paint = mesh.material.color.clone();
  for (let i = 0; i < mesh.instancesCount; i += 1) {
    const wanted = [0, 1, 2].map((k) => Math.fround(colours[3 * i + k] / 255));
    const { r, g, b } = mesh.getColorAt(i, paint);
    if (r === wanted[0] && g === wanted[1] && b === wanted[2]) continue;
    mesh.setColorAt(i, paint.setRGB(...wanted));
  }
}

/** The time of the last picture [s]; null before the first. */
export function picturedTime() {
  return pictured?.time ?? null;
}

/** Whether the last picture shows a run. */
export function hasPicture() {
  return isPictured;
}

/** Calls back before every picture, with the renderer of three.js. */
export function beforePicture(call) {
  beforeListeners.push(call);
}

/** Calls back after every picture. */
export function onPicture(call) {
  pictureListeners.push(call);
}

/** Calls back once the next picture is being drawn, by the graphics process and meanwhile. */
export function withPicture(call) {
  const { scene, canvas } = window.__viserMutable;
  scene.onAfterRender = () => {
    canvas.getContext("webgl2").flush();
    call();
  };
}

/** What Overlay.draw takes; null until there is a picture. */
function readView(covered, shown) {
  const viser = window.__viserMutable;
  const object = shown && viser.nodeRefFromName[shown.run.facts.object];
  if (!object || !viser.camera || !viser.canvas) return null;
  const { projectionMatrix, matrixWorldInverse } = viser.camera;
  const toClip = multiply(projectionMatrix.elements, matrixWorldInverse.elements);
  const { clientWidth: width, clientHeight: height } = viser.canvas;
  const page = document.documentElement;
  return {
    ...shown,
    // viser's world has z upwards, that of three.js has y.
    worldToClip: multiply(toClip, viser.nodeRefFromName[""].matrixWorld.elements),
    objectToClip: multiply(toClip, object.matrixWorld.elements),
    labels: labelsOf(viser, toClip),
    size: { width, height },
    free: {
      left: MARGIN,
      top: covered.top + MARGIN,
      right: width - MARGIN,
      bottom: height - covered.bottom - MARGIN,
    },
    dark: page.dataset.mantineColorScheme === "dark",
    font: parseFloat(getComputedStyle(page).fontSize) * Math.min(0.64 + 0.00025 * width, 1.15),
  };
}

/** The texts of the scene: {text, toClip, place: in the frame of the matrix}. */
function labelsOf({ nodeRefFromName, nodePoseData }, toClip) {
  const nodes = window.__viserSceneTree.getState();
  return Object.keys(nodes).flatMap((name) => {
    if (!name.endsWith(LABEL)) return [];
    const parent = name.slice(0, name.lastIndexOf("/"));
    const frame = nodeRefFromName[parent];
    const place = nodePoseData[name]?.position;
    if (!frame?.visible || place === undefined) return [];
    const { text } = nodes[name].message.props;
    return [{ text, toClip: multiply(toClip, frame.matrixWorld.elements), place }];
  });
}

/** The run and the time that the scene shows; null until there are any. */
function shownByScene() {
  const time = window.__viserMutable?.nodePoseData[CLOCK]?.position[0];
  const shown = time === undefined ? null : currentRun();
  return shown && { run: shown, time };
}

/** The run whose packet came last. */
function currentRun() {
  const points = window.__viserSceneTree.getState()[PACKET]?.message.props.points;
  if (points !== undefined && points !== known) {
    known = points;
    const bytes = new Uint8Array(points.buffer, points.byteOffset, points.byteLength);
    run = bytes.length > 16 ? ContactRun.unpack(bytes) : null;
  }
  return run;
}
