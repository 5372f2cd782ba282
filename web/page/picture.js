// The picture of the scene as a file. The session asks for it with a hidden element:
//   data-sg-picture='3' data-sg-name='NAME.png'   the number counts how often it was asked for
import { onFrame, state } from "./session_state.js";
import { say } from "./banner.js";

let taken = "";

/** Begins to wait for being asked. */
export function startPicture() {
  onFrame(() => {
    const asked = document.querySelector("[data-sg-picture]");
    const number = Number(asked?.dataset.sgPicture ?? 0);
    // Another session counts from the start again.
    const request = `${state.session} ${number}`;
    if (number === 0 || request === taken) return;
    taken = request;
    save(asked.dataset.sgName);
  });
}

async function save(name) {
  // viser keeps what it has drawn, so its canvas may be read at any time.
  const scene = document.querySelector("canvas[data-engine]");
  if (!scene) {
    say("There is no picture of the scene to save.");
    return;
  }
  const copy = document.createElement("canvas");
  copy.width = scene.width;
  copy.height = scene.height;
  const context = copy.getContext("2d");
  context.fillStyle = backgroundOf(scene);
  context.fillRect(0, 0, copy.width, copy.height);
  context.drawImage(scene, 0, 0);
  const overlay = document.querySelector(".sg-overlay");
  if (overlay) context.drawImage(await imageOf(overlay), 0, 0, copy.width, copy.height);
  copy.toBlob((picture) => download(picture, name), "image/png");
}

/** An SVG element as an image. */
function imageOf(element) {
  const { width, height } = element.getBoundingClientRect();
  const drawn = element.cloneNode(true);
  for (const [name, value] of Object.entries({ xmlns: "http://www.w3.org/2000/svg", width, height })) {
    drawn.setAttribute(name, value);
  }
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(drawn.outerHTML)}`;
  return image.decode().then(() => image);
}

/** What shines through where the scene is empty: the colour of what lies behind it. */
function backgroundOf(scene) {
  for (let element = scene; element; element = element.parentElement) {
    const { backgroundColor } = getComputedStyle(element);
    if (!/^(transparent|rgba\(.*, 0\))$/.test(backgroundColor)) return backgroundColor;
  }
  return "white";
}

function download(picture, name) {
  if (picture === null) {
    say("The browser could not make a file of the picture; try a smaller window.");
    return;
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(picture);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
