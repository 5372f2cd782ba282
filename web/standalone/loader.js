// Starts the worker first, so that the kernel is compiled while viser's page loads. Then unpacks and
// starts the page: its modules, each as an address of its own. What is loaded before it: unpack.js.
const textOf = (id) => document.getElementById(id).textContent;
const addressOfScript = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
window.slipgrasp.unpack = (id) => unpack(textOf(id));
window.slipgrasp.makeWorker = () => {
  const made = new window.slipgrasp.Real(addressOfScript(textOf("sg-worker")));
  made.postMessage({ kernel: textOf("sg-kernel") });
  return made;
};
window.slipgrasp.worker = window.slipgrasp.makeWorker();
(async () => {
  const read = async (id) => new TextDecoder().decode(await window.slipgrasp.unpack(id));
  const [scripts, formulas] = await Promise.all(["sg-modules", "sg-formulas"].map(read));
  const modules = { ...JSON.parse(scripts), formulas };
  const made = {};
  const addressOf = (name) => (made[name] ??= make(modules[name]));
  function make(text) {
    return addressOfScript(text.replace(/from "\.\/(\w+)\.js"/g, (_, name) => `from "${addressOf(name)}"`));
  }
  await import(addressOf("page"));
})();
