// The page's websocket lives in a worker. Its messages are recorded there with their times, so that
// a page that is busy drawing does not count as a message on its way.
const arrivals = []; let batches = 0; let pressed = 0; let cards = 0;
window.drawn = [];
// Scene, charts and card; notes on it, the list and the comparison come once the control rests.
const isCard = message => String(message.updates?.content).includes('sg-verdict');
const isDrawing = message => message.type === 'GuiUpdateMessage'
  ? 'data' in message.updates || (cards === 0 && isCard(message))
  : /^(Scene|Set)/.test(message.type);
const Plain = window.Worker;
window.Worker = class extends Plain {
  constructor(url, options) {
    const spy = `
      const Socket = self.WebSocket;
      self.WebSocket = class extends Socket {
        constructor(...a) {
          super(...a);
          this.addEventListener('message', () => self.postMessage(
            {type: 'arrival', at: performance.timeOrigin + performance.now()}));
        }
      };
      import(${JSON.stringify(String(url))});`;
    super(URL.createObjectURL(new Blob([spy], {type: 'text/javascript'})), {type: 'module'});
    this.addEventListener('message', event => {
      if (event.data.type === 'arrival') arrivals.push(event.data.at);
      if (event.data.type === 'message_batch') {
        const arrived = arrivals[batches++];
        if (event.data.messages.some(isDrawing)) window.drawn.push(
          [arrived - pressed, performance.timeOrigin + performance.now() - pressed]);
        cards += event.data.messages.filter(isCard).length;
      }
    });
  }
};
window.addEventListener('keydown', () => {
  pressed = performance.timeOrigin + performance.now();
  window.drawn.length = cards = 0;
}, true);
