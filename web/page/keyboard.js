// The keys of the dashboard. Their table comes with the page (<script id="sg-keys">), so that
// the list of commands, this script and the help know the same keys.
import { post } from "./post.js";

const TYPING = "input, textarea, select, [contenteditable]:not([contenteditable=false])";
// What has a use for arrows itself, or for Space.
const OWN_ARROWS = "[role=slider], [role=tab], [role=listbox], [role=option], [role=menu]";
const OWN_SPACE = "button, a[href], summary, [role=button], [role=tab], [data-sg-intent]";
// A list from which something was chosen is a field, but nobody types into it.
const CLOSED_LIST = "[aria-haspopup=listbox]:not([aria-expanded=true])";
const ARROWS = /Arrow|Home|End/;
const [HELP_KEY, FULL_SCREEN_KEY] = ["?", "Shift+F"];
// Whether the focus was brought where it is by the keyboard. A button that was clicked keeps the
// focus, and Space belongs to the page again.
let isByKeyboard = false;

const commands = new Map();
let rows = [];

/** Begins to listen; before viser, whose camera moves by some of the same keys. */
export function startKeyboard() {
  rows = JSON.parse(document.getElementById("sg-keys").textContent);
  for (const row of rows) {
    for (const key of row.keys) commands.set(key, row);
  }
  window.addEventListener("keydown", onKey, { capture: true });
  window.addEventListener("pointerdown", () => (isByKeyboard = false), { capture: true });
  // What a control or a field has taken must not turn viser's camera, too; that listens further out.
  document.body.addEventListener("keydown", keepFromCamera);
  document.addEventListener("click", (event) => {
    if (event.target.closest?.("[data-sg-help]")) showHelp();
  });
}

function onKey(event) {
  if (event.key === "Tab") isByKeyboard = true;
  const key = nameOf(event);
  if (event.altKey || isForOthers(event, key)) return;
  if (key === HELP_KEY) showHelp();
  else if (key === FULL_SCREEN_KEY) switchFullScreen();
  else if (commands.has(key)) run(commands.get(key));
  else return;
  event.preventDefault();
  event.stopImmediatePropagation();
}

function run(command) {
  post(command.intent);
  showTab(command.tab);
}

/** Shows the tab of viser with a title, if there is one. */
export function showTab(title) {
  for (const tab of document.querySelectorAll("[role=tab]")) {
    if (tab.title !== title) continue;
    // viser's tabs can be dragged: they listen to this key, and not to a click alone.
    tab.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
  }
}

function nameOf(event) {
  const isLetter = /^[a-z]$/i.test(event.key);
  const key = event.key === " " ? "Space" : isLetter ? event.key.toUpperCase() : event.key;
  const shift = event.shiftKey && (isLetter || event.key.length > 1) ? "Shift+" : "";
  return `${event.ctrlKey || event.metaKey ? "Ctrl+" : ""}${shift}${key}`;
}

function isForOthers(event, key) {
  const target = event.target;
  if (!(target instanceof Element)) return false;
  if (document.querySelector("[role=dialog], dialog[open]")) return true;
  if (target.closest(TYPING)) return isByKeyboard || !target.matches(CLOSED_LIST);
  if (ARROWS.test(key) && target.closest(OWN_ARROWS)) return true;
  return key === "Space" && isByKeyboard && target.closest(OWN_SPACE) !== null;
}

function keepFromCamera(event) {
  if (event.target.closest?.(`${TYPING}, ${OWN_ARROWS}`)) event.stopPropagation();
}

function switchFullScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen();
}

function showHelp() {
  const dialog = document.createElement("dialog");
  dialog.className = "sg-help";
  dialog.setAttribute("aria-label", "Keys");
  const title = document.createElement("h2");
  title.textContent = "Keys";
  const list = document.createElement("dl");
  const own = [
    { shown: FULL_SCREEN_KEY, text: "Full screen, or back" },
    { shown: HELP_KEY, text: "This list" },
  ];
  for (const row of [...rows, ...own]) {
    const keys = document.createElement("dt");
    keys.textContent = row.shown;
    const text = document.createElement("dd");
    text.textContent = row.text;
    list.append(keys, text);
  }
  const close = document.createElement("button");
  close.textContent = "Close";
  close.addEventListener("click", () => dialog.close());
  dialog.append(title, list, close);
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}
