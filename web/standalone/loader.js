// Unpacks what the file holds, and starts the page: the modules, each as an address of its own.
window.slipgrasp.unpack = async (id) => {
  const text = document.getElementById(id).textContent;
  const packed = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};
(async () => {
  const textOf = async (id) => new TextDecoder().decode(await window.slipgrasp.unpack(id));
  const [scripts, formulas] = await Promise.all(["sg-modules", "sg-formulas"].map(textOf));
  const modules = { ...JSON.parse(scripts), formulas };
  const made = {};
  const addressOf = (name) => (made[name] ??= make(modules[name]));
  function make(text) {
    const linked = text.replace(/from "\.\/(\w+)\.js"/g, (_, name) => `from "${addressOf(name)}"`);
    return URL.createObjectURL(new Blob([linked], { type: "text/javascript" }));
  }
  await import(addressOf("page"));
})();
