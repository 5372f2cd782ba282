// Stands in for the server of the viewer. viser's page talks to its server in a worker of its own;
// this takes the place of that worker and hands over messages as they are after unpacking:
//   window.slipgrasp.feed(messages)   to the viewer
//   window.slipgrasp.onSent           called with each message of the viewer
//   window.slipgrasp.asked            resolves when the viewer wants its first messages
// All other workers are real; the first message decides which one it is.
(() => {
  const OWN = new Set(["zstd_wasm", "set_server", "retry", "send", "close"]);
  const Real = window.Worker;
  const viewer = { Real, onSent: () => {}, feed: () => {} };
  viewer.asked = new Promise((resolve) => (viewer.resolve = resolve));
  window.slipgrasp = viewer;

  // viser writes the address of its server into that of the page, which has none.
  const replaceState = history.replaceState.bind(history);
  history.replaceState = (state, title, address) => {
    if (title !== "Viser") replaceState(state, title, address);
  };

  window.Worker = class extends EventTarget {
    constructor(...source) {
      super();
      this.make = () => this.forward(new Real(...source));
    }
    postMessage(data, transfer) {
      this.isOwn ??= OWN.has(data?.type);
      if (!this.isOwn) (this.real ??= this.make()).postMessage(data, transfer);
      else if (data.type === "send") viewer.onSent(data.message);
      else if (data.type === "set_server") this.connect();
    }
    forward(real) {
      for (const kind of ["message", "error", "messageerror"]) {
        real.addEventListener(kind, (event) => this.emit(kind, event.data));
      }
      return real;
    }
    emit(kind, data) {
      const event = new MessageEvent(kind, { data });
      this["on" + kind]?.(event);
      this.dispatchEvent(event);
    }
    connect() {
      viewer.feed = (messages) => {
        this.emit("message", { type: "message_batch", messages });
        // At once rather than during the next picture, which would show a part of them only.
        window.__viserMutable?.drainMessageQueue?.();
      };
      setTimeout(() => {
        this.emit("message", { type: "connected" });
        viewer.resolve();
      });
    }
    terminate() {
      this.real?.terminate();
    }
  };
})();
