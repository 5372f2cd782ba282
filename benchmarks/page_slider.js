// Time in the page from a key press on the slider of the mass until its run is drawn.
async (key) => {
  const slider = document.querySelector("[role=slider]");
  const root = document.documentElement, before = root.dataset.sgSha256;
  slider.focus();
  // Observed, because a timer may notice the run only after the frame that shows it.
  const arrived = new Promise((next) => {
    const observer = new MutationObserver(() => {
      if (root.dataset.sgSha256 === before) return;
      observer.disconnect();
      next();
    });
    observer.observe(root, { attributeFilter: ["data-sg-sha256"] });
  });
  const start = performance.now();
  slider.dispatchEvent(new KeyboardEvent("keydown", { key, code: key, bubbles: true }));
  await arrived;
  await new Promise((next) => requestAnimationFrame(() => setTimeout(next)));
  return performance.now() - start;
}
