// Everything that shows where the play head stands:
//   data-sg-head     gets --sg-share, from 0 at the start of the window to 1 at its end
//   data-sg-clock    shows the time in words
//   data-sg-time     an input that holds the exact time [s], unless the user is typing in it
import { onFrame, shareOf } from "./session_state.js";

/** Begins to show the time. */
export function startClock() {
  onFrame(show);
}

function show(time) {
  const share = shareOf(time).toFixed(5);
  for (const head of document.querySelectorAll("[data-sg-head]")) {
    if (head.style.getPropertyValue("--sg-share") !== share) {
      head.style.setProperty("--sg-share", share);
    }
  }
  const words = inWords(time);
  for (const clock of document.querySelectorAll("[data-sg-clock]")) {
    if (clock.textContent !== words) clock.textContent = words;
  }
  const exact = String(Number(time.toFixed(6)));
  for (const input of document.querySelectorAll("[data-sg-time]")) {
    if (input !== document.activeElement && input.value !== exact) input.value = exact;
  }
}

function inWords(time) {
  return time < 1 ? `${(1000 * time).toFixed(1)} ms` : `${time.toFixed(3)} s`;
}
