// The success map: two sliders as axes, a run in the middle of every cell, computed by workers of its
// own. The map is that of a study in the dashboard; here only cells and counts go into it.
import { statesOf } from "./rows.js";

const MOST_WORKERS = 8;
const PIECES = 8; // that each worker gets, one after another
const SHOW_EVERY_MS = 500;

export class SuccessMap {
  /** data: of the page; makeWorker: with the kernel; valuesNow: of all sliders; show: takes HTML. */
  constructor(data, makeWorker, valuesNow, show) {
    Object.assign(this, { data, makeWorker, valuesNow, show });
    [this.across, this.up] = data.controls;
    this.side = data.map.sides[1];
    this.workers = [];
    this.clear();
  }

  /** Takes another axis or number of cells, by the name of its field. */
  choose(field, value) {
    if (field === "side") this.side = Number(value);
    else {
      const other = field === "across" ? "up" : "across";
      const chosen = this.data.controls.find(({ key }) => key === value);
      if (chosen === this[other]) this[other] = this[field];
      this[field] = chosen;
    }
    this.clear();
  }

  /** Forgets the runs, for instance because another slider has moved. */
  clear() {
    this.stop();
    [this.found, this.words] = [new Map(), ""];
    this.draw();
  }

  stop() {
    for (const worker of this.workers) worker.terminate();
    this.workers = [];
  }

  isAxis(key) {
    return key === this.across.key || key === this.up.key;
  }

  /** The values of both axes in the middle of a cell; cells count from the lower left, row by row. */
  valuesOf(cell) {
    const middle = ({ low, high }, k) => low + ((k + 0.5) * (high - low)) / this.side;
    const [row, column] = [Math.floor(cell / this.side), cell % this.side];
    return new Map([[this.across.key, middle(this.across, column)], [this.up.key, middle(this.up, row)]]);
  }

  compute() {
    this.clear();
    const count = Math.max(1, Math.min(navigator.hardwareConcurrency, MOST_WORKERS));
    const cells = Array.from({ length: this.side ** 2 }, (_, cell) => ({ cell, values: this.data.placed(new Map([...this.valuesNow(), ...this.valuesOf(cell)])) }));
    const size = Math.ceil(cells.length / (count * PIECES));
    const { run, map } = this.data;
    const job = { scenario: run.scenario, columns: statesOf(run), categories: map.categories };
    const give = (worker) => {
      const next = cells.splice(0, size);
      if (next.length > 0) worker.postMessage({ ...job, cells: next });
    };
    [this.began, this.shownAt] = [performance.now(), performance.now()];
    this.workers = Array.from({ length: count }, () => this.makeWorker());
    for (const worker of this.workers) {
      worker.onmessage = ({ data: { found } }) => {
        give(worker);
        this.take(found);
      };
      give(worker);
    }
    this.draw();
  }

  take(found) {
    for (const [cell, category] of found) this.found.set(cell, category);
    const [total, now] = [this.side ** 2, performance.now()];
    const isDone = this.found.size === total;
    this.words = `${this.found.size} of ${total} runs in ${((now - this.began) / 1000).toFixed(1)} s`;
    if (isDone) this.stop();
    if (!isDone && now - this.shownAt < SHOW_EVERY_MS) return;
    this.shownAt = now;
    this.draw();
  }

  draw() {
    this.show(this.formHtml() + this.mapHtml());
  }

  formHtml() {
    const select = (field, label, choices, chosen) => {
      const options = choices.map(([value, words]) => `<option value="${value}"${value === chosen ? " selected" : ""}>${words}</option>`);
      const intent = JSON.stringify({ kind: "choose-map", field, value: "$value" });
      return `<label>${label} <select data-sg-change='${intent}'>${options.join("")}</select></label> `;
    };
    const axes = this.data.controls.map(({ key, label }) => [key, label]);
    const isBusy = this.workers.length > 0;
    const button = `<button type="button" class="sg-try" data-sg-intent='{"kind":"${isBusy ? "stop-map" : "compute-map"}"}'>${isBusy ? "Stop" : "Compute"}</button>`;
    return (
      `<div class="sg-outcome sg-map-form">${select("across", "across", axes, this.across.key)}` +
      `${select("up", "up", axes, this.up.key)}` +
      `${select("side", "cells", this.data.map.sides.map((side) => [side, `${side} × ${side}`]), this.side)}` +
      `${button} <span role="status">${this.words}</span></div>`
    );
  }

  mapHtml() {
    const { templates, size, words, places } = this.data.map;
    const template = document.createElement("template");
    template.innerHTML = templates[`${this.across.key} ${this.up.key}`];
    const place = (k) => Math.round((size * k) / this.side);
    const cells = new Map(places.map((category) => [category, []]));
    for (const [cell, category] of this.found) {
      const [row, column] = [Math.floor(cell / this.side), cell % this.side];
      const [left, top] = [place(column), size - place(row + 1)];
      const box = `x="${left}" y="${top}" width="${place(column + 1) - left}" height="${size - place(row) - top}"`;
      const title = [...this.valuesOf(cell).values()].map((value) => Number(value.toPrecision(4))).join(", ");
      cells.get(category).push(`<rect ${box} data-sg-intent='{"kind":"open-cell","cell":${cell}}'><title>${title}: ${words[category]}</title></rect>`);
    }
    template.content.querySelector("[data-sg-cells]").innerHTML = [...cells]
      .map(([category, boxes]) => `<g class="sg-cells" fill="url(#sg-way-${category})">${boxes.join("")}</g>`)
      .join("");
    this.fillKey(template.content.querySelector(".sg-map-key"), cells);
    return template.innerHTML;
  }

  /** How many runs ended in each way; four elements for each in the key. */
  fillKey(key, cells) {
    const parts = [...key.children];
    [...cells.values()].forEach(({ length }, k) => {
      const [swatch, words, count, share] = parts.slice(4 * k, 4 * k + 4);
      count.textContent = String(length);
      share.textContent = length ? `${((100 * length) / this.found.size).toFixed(1)} %` : "";
      if (length === 0) for (const each of [swatch, words, count, share]) each.remove();
    });
  }
}
