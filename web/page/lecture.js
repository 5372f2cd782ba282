// Large type for a lecture hall, as long as the session says so.
import { onChange } from "./session_state.js";

/** Begins to follow the session. */
export function startLecture() {
  onChange((now) => document.documentElement.classList.toggle("sg-lecture", now.lecture));
}
