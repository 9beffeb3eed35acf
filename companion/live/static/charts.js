// Strip charts on one time axis with one cursor, drawn by uPlot.

import { CHARTS } from "./chart_list.js";
import { fixed, isNumber } from "./format.js";
import { colour } from "./theme.js";

const NEAR = 5;
const HEADROOM = 1.12;

export class Charts {
  /** `seek(time)` is called when a time is pressed in a chart. */
  constructor(host, seek) {
    this.strips = CHARTS.map((chart) => new Strip(chart, host, seek));
  }

  /** Draw the figures from `begin` to `end`. */
  show(store, begin, end) {
    for (const strip of this.strips) strip.show(store, begin, end);
  }

  /** Mark a time and say its figures; null for no mark and the newest figures. */
  mark(time) {
    for (const strip of this.strips) strip.mark(time);
  }

  /** Take the colours anew. */
  recolour() {
    for (const strip of this.strips) strip.build();
  }
}

class Strip {
  constructor(chart, host, seek) {
    this.chart = chart;
    this.seek = seek;
    this.window = [0, 1];
    this.data = null;
    this.limit = null;
    this.marked = null;
    this.values = [];
    this.#frame(host);
    this.lines = this.#lines();
    this.build();
    new ResizeObserver(() => this.plot.setSize(this.#size())).observe(this.body);
  }

  /** (Re)make the plot with the colours of now. */
  build() {
    this.plot?.destroy();
    this.plot = new uPlot(this.#options(), this.data ?? [[], ...this.lines.map(() => [])], this.body);
    this.head = document.createElement("div");
    this.head.className = "playhead";
    this.plot.over.append(this.head);
    this.plot.over.addEventListener("click", () => {
      const { left } = this.plot.cursor;
      if (left >= 0) this.seek(this.plot.posToVal(left, "x"));
    });
    this.mark(this.marked);
  }

  show(store, begin, end) {
    const times = store.columns.t;
    const from = Math.max(0, store.indexAt(begin) - 1);
    const to = store.indexAt(end) + 1;
    const whole = from === 0 && to >= times.length;
    const cut = (column) => (whole ? column : column.slice(from, to));
    const limit = this.chart.limit?.(store.flight);
    this.limit = isNumber(limit) ? limit : null;
    const x = cut(times);
    const flat = (value) => x.map(() => value);
    const columns = this.lines.map((line) => {
      if (line.key) return cut(store.columns[line.key]);
      return flat(this.limit === null ? null : line.sign * this.limit);
    });
    this.window = [begin, Math.max(end, begin + 1)];
    this.data = [x, ...columns];
    this.plot.setData(this.data);
    this.mark(this.marked);
  }

  mark(time) {
    this.marked = time;
    const shown = time !== null && this.data !== null;
    this.head.hidden = !shown;
    if (shown) this.head.style.transform = `translateX(${this.plot.valToPos(time, "x")}px)`;
    this.#say();
  }

  // The chart's place in the page: title, figures, and what it means.
  #frame(host) {
    const { id, title, unit, help, series } = this.chart;
    const figure = document.createElement("figure");
    figure.className = "strip";
    figure.id = `chart-${id}`;
    const head = document.createElement("figcaption");
    const name = document.createElement("h2");
    name.textContent = title;
    const small = document.createElement("small");
    small.textContent = unit;
    const details = document.createElement("details");
    const summary = document.createElement("summary");
    summary.textContent = "?";
    summary.setAttribute("aria-label", `What ${title} means`);
    const text = document.createElement("p");
    text.textContent = help;
    details.append(summary, text);
    details.addEventListener("keydown", (event) => {
      if (event.key === "Escape") details.open = false;
    });
    const values = document.createElement("span");
    values.className = "values";
    this.values = series.map((line) => {
      const item = document.createElement("span");
      item.dataset.colour = line.colour;
      const number = document.createElement("b");
      item.append(line.label, " ", number);
      values.append(item);
      return number;
    });
    head.append(name, small, details, values);
    this.body = document.createElement("div");
    this.body.className = "plot";
    this.body.setAttribute("role", "img");
    figure.append(head, this.body);
    host.append(figure);
  }

  // Every line of the plot: the figures, then the dashed bounds.
  #lines() {
    const { series, dashed = [], limit, both } = this.chart;
    const bounds = dashed.map((key) => ({ key }));
    if (limit) bounds.push({ sign: 1 }, ...(both ? [{ sign: -1 }] : []));
    return [...series, ...bounds.map((line) => ({ ...line, bound: true }))];
  }

  #size() {
    return { width: Math.max(120, this.body.clientWidth), height: Math.max(60, this.body.clientHeight) };
  }

  #options() {
    const grid = { stroke: colour("line"), width: 1 };
    const axis = (more) => ({
      stroke: colour("muted"),
      font: "11px system-ui, sans-serif",
      grid,
      ticks: { show: false },
      ...more,
    });
    const number = (_, values) => values.map((value) => (value === null ? "" : String(value).replace("-", "−")));
    const right = this.chart.series.some((line) => line.scale === "right");
    return {
      ...this.#size(),
      legend: { show: false },
      cursor: { sync: { key: "time" }, y: false, drag: { setScale: false, x: false }, points: { size: 6 } },
      padding: [4, right ? 0 : 38, 0, 0],
      scales: {
        x: { time: false, range: () => this.window },
        y: { range: (plot, low, high) => this.#range(low, high) },
        right: { range: [0, 1] },
      },
      axes: [
        axis({ size: 20, gap: 2, values: (_, values) => values.map((value) => `${value} s`), space: 60 }),
        axis({ scale: "y", size: 44, gap: 4, space: 18, values: number }),
        ...(right ? [axis({ scale: "right", side: 1, size: 38, gap: 4, space: 24, grid: { show: false } })] : []),
      ],
      series: [{}, ...this.lines.map((line) => this.#series(line))],
      hooks: { setCursor: [() => this.#say()] },
    };
  }

  #series(line) {
    if (line.bound) {
      return { scale: "y", auto: false, stroke: colour("half"), width: 1, dash: [5, 4], points: { show: false } };
    }
    const stroke = colour(line.colour);
    return {
      scale: line.scale ?? "y",
      stroke,
      width: 1.5,
      points: { show: false },
      ...(line.fill ? { fill: `${stroke}22` } : {}),
    };
  }

  // The figures' range; the bounds too, always or if the figures come near them.
  #range(low, high) {
    const { floor, least, both, bounds } = this.chart;
    const peak = Math.max(least, Math.abs(low ?? 0), Math.abs(high ?? 0));
    const bound = this.#largestBound();
    const reach = bound !== null && (bounds === "always" || bound <= NEAR * peak) ? Math.max(peak, bound) : peak;
    return [both ? -reach * HEADROOM : floor, reach * HEADROOM];
  }

  #largestBound() {
    if (this.limit !== null) return this.limit;
    let largest = null;
    this.lines.forEach((line, i) => {
      if (!line.bound || !this.data) return;
      for (const value of this.data[i + 1]) {
        if (value !== null && value > (largest ?? -Infinity)) largest = value;
      }
    });
    return largest;
  }

  // The figures at the cursor, else at the mark, else the newest.
  #say() {
    if (!this.data || !this.data[0].length) return;
    const times = this.data[0];
    let index = this.plot?.cursor.idx ?? null;
    if (index === null && this.marked !== null) index = nearest(times, this.marked);
    if (index === null || index >= times.length) index = times.length - 1;
    const said = this.chart.series.map((line, i) => {
      const text = fixed(this.data[i + 1][index], line.digits);
      if (this.values[i].textContent !== text) this.values[i].textContent = text;
      return `${line.label} ${text}`;
    });
    this.body.setAttribute("aria-label", `${this.chart.title}, ${this.chart.unit}: ${said.join(", ")}`);
  }
}

// Index of the newest time that is not after the one given.
function nearest(times, time) {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return Math.max(0, low - 1);
}
