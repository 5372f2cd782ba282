// Starts the worker first, so that the kernel is compiled while viser's page loads. Then starts
// viser's page and, as modules with an address each, this one. What is loaded before it: unpack.js.
(async () => {
  const own = window.slipgrasp;
  const textOf = (id) => document.getElementById(id).textContent;
  const addressOf = (script) => URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
  const startThread = () => new own.Real(addressOf(textOf("sg-worker")));
  const thread = startThread();
  const decoder = await loadDecoder(textOf("sg-decoder"));
  globalThis.__viserZstdWasm = decoder; // viser's page wants it too
  own.makeWorker = (made = startThread()) => {
    made.postMessage({ decoder, kernel: textOf("sg-kernel") });
    return made;
  };
  own.worker = own.makeWorker(thread);
  own.unpack = await makeUnpack(decoder);
  own.read = (id) => own.unpack(decode(textOf(id)));
  own.readText = (id) => new TextDecoder().decode(own.read(id));
  document.head.append(Object.assign(document.createElement("style"), { textContent: own.readText("sg-style") }));
  const viewer = addressOf(own.read("sg-viewer"));
  document.head.append(Object.assign(document.createElement("link"), { rel: "modulepreload", href: viewer }));
  const modules = { ...JSON.parse(own.readText("sg-modules")), formulas: own.readText("sg-formulas") };
  const made = {};
  const addressOfModule = (name) => (made[name] ??= make(modules[name]));
  function make(text) {
    return addressOf(text.replace(/from "\.\/(\w+)\.js"/g, (_, name) => `from "${addressOfModule(name)}"`));
  }
  await import(addressOfModule("page"));
  await import(viewer);
})();
