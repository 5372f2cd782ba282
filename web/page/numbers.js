// Numbers as people write them. A number field of viser drops the characters that it does not
// know: "2e-3" would become -23, and "1,5" could become 15, without a word.
import { say } from "./banner.js";

const FIELD = 'input[inputmode="decimal"], input[inputmode="numeric"]';

let before = "";

export function startNumbers() {
  document.addEventListener("beforeinput", check, true);
  document.addEventListener("focusin", ({ target }) => {
    if (target.matches?.(FIELD)) before = target.value;
  });
  document.addEventListener("focusout", ({ target }) => {
    if (target.matches?.(FIELD) && target.value.trim() === "") write(target, before);
  });
}

/** Puts a value back into a field that was left empty, as if it were typed: viser's page listens. */
function write(input, value) {
  const { set } = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value");
  set.call(input, value);
  input.dispatchEvent(new Event("input", { bubbles: true }));
}

function check(event) {
  if (!(event.target instanceof HTMLInputElement) || !event.target.matches(FIELD)) return;
  const text = event.data ?? event.dataTransfer?.getData("text/plain") ?? "";
  if (text.length > 1) return void checkWhole(event, text.trim());
  const hasExponent = /[eE]/.test(text);
  const isMisplacedSign = text === "-" && event.target.selectionStart !== 0;
  if (!hasExponent && !isMisplacedSign) return;
  event.preventDefault();
  if (hasExponent) say("Write the number without an exponent, such as 0.002 for 2e-3.");
  else say("A minus sign belongs before the number.");
}

/** What is pasted: a number in any notation, digit for digit where it can be. */
function checkWhole(event, text) {
  if (/^[-+]?[0-9]*\.?[0-9]*$/.test(text)) return;
  event.preventDefault();
  const number = Number(text.replace(/^([^.,]*),([^.,]*)$/, "$1.$2"));
  if (text === "" || !Number.isFinite(number)) {
    say(`"${text.slice(0, 40)}" is not a number.`);
    return;
  }
  const digits = number.toLocaleString("en-US", { useGrouping: false, maximumFractionDigits: 20 });
  document.execCommand("insertText", false, digits);
}
