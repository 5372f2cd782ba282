// Names for elements that viser leaves nameless, for screen readers: a control by its label and its
// folder, a button that is only an icon by what it does, and the page by what is in it.
import { onFrame } from "./session_state.js";

const LOOK_EVERY_MS = 500;
const ICON_NAMES = {
  "tabler-icon-list-search": "Find a command",
  "tabler-icon-adjustments": "Settings of the viewer",
};
const FOLDER = ".mantine-Paper-root[data-with-border]";
let lookedAt = -Infinity;

/** Begins to name what appears. */
export function startNames() {
  const root = document.getElementById("root");
  root?.setAttribute("role", "main");
  const heading = document.createElement("h1");
  heading.textContent = "slipgrasp";
  heading.className = "sg-unseen";
  onFrame(() => {
    const now = performance.now();
    if (now - lookedAt < LOOK_EVERY_MS) return;
    lookedAt = now;
    if (root && !heading.isConnected) root.append(heading);
    document.querySelectorAll("label[for]").forEach(nameControl);
    document.querySelectorAll(`${FOLDER} > :first-child`).forEach(nameFolder);
    document.querySelectorAll("button:not([aria-label])").forEach(nameButton);
  });
}

function nameControl(label) {
  // The row of a control has its label in one half and its inputs in the other.
  const controls = label.parentElement?.parentElement?.nextElementSibling;
  if (!controls) return;
  const folder = label.closest(FOLDER)?.firstElementChild?.textContent.trim();
  const name = folder ? `${label.textContent}, ${folder}` : label.textContent;
  for (const control of controls.querySelectorAll("[role=slider], input")) {
    if (control.labels?.length) continue;
    if (control.getAttribute("aria-label") !== name) control.setAttribute("aria-label", name);
  }
}

/** viser's folders open by a click alone; here they are buttons for the keyboard and screen readers, too. */
function nameFolder(title) {
  if (!title.textContent.trim()) return; // a chart, which has such a border, too
  const isOpen = title.nextElementSibling?.getAttribute("aria-hidden") === "false";
  title.setAttribute("aria-expanded", String(isOpen));
  if (title.getAttribute("role") === "button") return;
  title.setAttribute("role", "button");
  title.tabIndex = 0;
  title.addEventListener("keydown", (event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    title.click();
  });
}

function nameButton(button) {
  const icon = button.querySelector("svg[class]")?.classList ?? [];
  const known = Object.keys(ICON_NAMES).find((name) => [...icon].includes(name));
  const isClose = button.classList.contains("mantine-CloseButton-root");
  const name = isClose ? "Close" : ICON_NAMES[known];
  if (name && !button.textContent.trim()) button.setAttribute("aria-label", name);
}
