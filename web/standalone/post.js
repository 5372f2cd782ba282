// What the user asks for, which the dashboard brings to its server, stays in this page.
const takers = new Map();

/** Takes intents of one kind. */
export function onIntent(kind, take) {
  takers.set(kind, take);
}

/** Carries an intent out; one that this page cannot is ignored. */
export function post(intent) {
  takers.get(intent.kind)?.(intent);
}
