// Who has read what stands above the outcome card does not see it again in this browser.
const KEY = "slipgrasp-was-here";

/** Begins to wait for the button. */
export function startWelcome() {
  if (remembered()) hide();
  document.addEventListener("click", (event) => {
    if (!event.target.closest?.("[data-sg-welcomed]")) return;
    hide();
    remember();
  });
}

function hide() {
  document.documentElement.dataset.sgWasHere = "";
}

// A browser may store nothing; then it is shown again, and nothing else is lost.
function remembered() {
  try {
    return localStorage.getItem(KEY) !== null;
  } catch {
    return false;
  }
}

function remember() {
  try {
    localStorage.setItem(KEY, "yes");
  } catch {
    return;
  }
}
