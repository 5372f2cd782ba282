// The address of the page: sliders that were moved, the time, and dark or light, behind a #.
const [TIME, THEME] = ["t", "theme"];

/** What the address says: values of sliders by key, a time [s] or null, and whether it is dark. */
export function readAddress() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const prefersDark = window.matchMedia("(prefers-color-scheme: dark)").matches;
  const theme = parts.get(THEME);
  const values = new Map();
  for (const [key, text] of parts) {
    if (key !== TIME && key !== THEME && Number.isFinite(Number(text))) values.set(key, Number(text));
  }
  const time = parts.has(TIME) ? Number(parts.get(TIME)) : null;
  return { values, time, dark: theme === null ? prefersDark : theme === "dark" };
}

/** Writes what has changed; another theme loads the page again. */
export function writeAddress({ values, time, dark }) {
  const parts = new URLSearchParams(location.hash.slice(1));
  if (values) {
    for (const key of [...parts.keys()]) if (key !== TIME && key !== THEME) parts.delete(key);
    for (const [key, value] of values) parts.set(key, String(value));
  }
  if (time !== undefined) parts.set(TIME, String(Number(time.toFixed(6))));
  if (dark !== undefined) parts.set(THEME, dark ? "dark" : "light");
  // The whole address, for that of a page in a frame of a notebook has no base of its own.
  history.replaceState(null, "", `${location.href.split("#")[0]}#${parts}`);
  if (dark !== undefined) location.reload();
}
