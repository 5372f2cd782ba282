// Recordings that the user sends: [data-sg-upload='/address'] is a button around a file input.
// The file goes to the REST interface as it is, which reads it in full before it keeps it;
// what it answers stands in the element behind the label.
import { post } from "./post.js";

/** Begins to listen. */
export function startUploads() {
  document.addEventListener("change", onFile);
  document.addEventListener("click", onClick);
  document.addEventListener("keydown", onKey);
}

function onClick(event) {
  if (event.target.matches?.("[data-sg-upload]")) event.target.querySelector("input").click();
}

function onKey(event) {
  if (!event.target.matches?.("[data-sg-upload]")) return;
  if (event.key !== "Enter" && event.key !== " ") return;
  event.preventDefault();
  event.target.querySelector("input").click();
}

async function onFile(event) {
  const button = event.target.closest?.("[data-sg-upload]");
  const file = event.target.files?.[0];
  if (!button || !file) return;
  const input = event.target;
  const answer = button.nextElementSibling;
  input.disabled = true;
  tell(answer, `Sending ${file.name} …`, "");
  try {
    const run = await send(button.dataset.sgUpload, file);
    tell(answer, `${file.name} is kept as ${run.id}.`, "good");
    post({ kind: "list-recordings", page: 0 });
    post({ kind: "choose-recording", run_id: run.id });
  } catch (error) {
    tell(answer, `${file.name} is not kept: ${error.message}`, "bad");
  } finally {
    input.disabled = false;
    // So that the same file, mended, can be chosen again.
    input.value = "";
  }
}

/** Sends a file; throws an error with a sentence if the server does not keep it. */
async function send(address, file) {
  let answer;
  try {
    answer = await fetch(address, {
      method: "POST",
      headers: { "Content-Type": "application/octet-stream" },
      body: file,
    });
  } catch {
    throw new Error("the server did not take it all; it is too large, or the server is gone.");
  }
  const content = await answer.json();
  if (!answer.ok) throw new Error(content.detail);
  return content;
}

function tell(element, words, tone) {
  element.textContent = words;
  element.dataset.tone = tone;
}
