// What is known of the flight: its frames in order, and their figures by columns for the charts.

import { isNumber, known } from "./format.js";

const MOST_FRAMES = 40000;
const AXES = [0, 1, 2];

// How each column comes from a frame.
const COLUMNS = {
  t: (f) => f.t,
  error: (f) => f.error_mm,
  tilt: (f) => f.tilt_deg,
  thrust: (f) => f.thrust,
  computed: (f) => (isNumber(f.computed_us) ? f.computed_us / 1000 : null),
  latency: (f) => f.latency_ms,
  age: (f) => f.state_age_ms,
};
for (const axis of AXES) {
  const bound = (f) => f.y_tilde_bound?.[axis] ?? null;
  COLUMNS[`y${axis}`] = (f) => f.y_tilde?.[axis] ?? null;
  COLUMNS[`y_high${axis}`] = bound;
  COLUMNS[`y_low${axis}`] = (f) => (isNumber(bound(f)) ? -bound(f) : null);
  // The axes' units differ (sine of the tilt, m/s): only shares of the bounds share a scale.
  COLUMNS[`s${axis}`] = (f) => {
    const value = f.sigma?.[axis];
    const most = f.sigma_bound?.[axis];
    return isNumber(value) && isNumber(most) && most > 0 ? (100 * value) / most : null;
  };
}

export class Store {
  constructor() {
    this.flight = null;
    this.end = null;
    this.reset([], []);
  }

  /** Begin anew with a history. */
  reset(frames, messages) {
    this.frames = [];
    this.columns = Object.fromEntries(Object.keys(COLUMNS).map((name) => [name, []]));
    this.messages = [...messages];
    for (const frame of frames) this.append(frame);
  }

  /** Take a frame, unless it is not newer than the newest. */
  append(frame) {
    if (!isNumber(frame.t) || frame.t <= this.lastTime) return false;
    this.frames.push(frame);
    for (const [name, value] of Object.entries(COLUMNS)) {
      const number = value(frame);
      this.columns[name].push(isNumber(number) ? number : null);
    }
    if (this.frames.length > MOST_FRAMES) this.#thin();
    return true;
  }

  get last() {
    return this.frames.at(-1) ?? null;
  }

  get firstTime() {
    return this.frames.length ? this.frames[0].t : 0;
  }

  get lastTime() {
    return this.last?.t ?? -Infinity;
  }

  /** Index of the newest frame that is not after a time; 0 before the first. */
  indexAt(time) {
    let low = 0;
    let high = this.frames.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.frames[middle].t <= time) low = middle + 1;
      else high = middle;
    }
    return Math.max(0, low - 1);
  }

  /** The frame at a time, its place and attitude drawn straight between the two beside it. */
  at(time) {
    const index = this.indexAt(time);
    const before = this.frames[index];
    const after = this.frames[index + 1];
    if (!before || !after || after.t - before.t > 1) return before ?? null;
    const share = Math.min(1, Math.max(0, (time - before.t) / (after.t - before.t)));
    return {
      ...before,
      t: time,
      position: between(before.position, after.position, share),
      desired: between(before.desired, after.desired, share),
      attitude: turned(before.attitude, after.attitude, share),
    };
  }

  /** Places of the last seconds before a time, oldest first: [[t, place]…]. */
  trail(time, seconds) {
    const places = [];
    for (let i = this.indexAt(time); i >= 0; i -= 1) {
      const { t, position } = this.frames[i];
      if (t < time - seconds) break;
      if (t <= time && known(position)) places.push([t, position]);
    }
    return places.reverse();
  }

  // A flight of more than half an hour: every second frame of its older half goes.
  #thin() {
    const half = this.frames.length >> 1;
    const keep = (_, index) => index >= half || index % 2 === 0;
    this.frames = this.frames.filter(keep);
    for (const name of Object.keys(this.columns)) {
      this.columns[name] = this.columns[name].filter(keep);
    }
  }
}

function between(a, b, share) {
  if (!known(a) || !known(b)) return a;
  return AXES.map((i) => a[i] + share * (b[i] - a[i]));
}

// Near enough to the turn at even speed, at a twentieth of a second.
function turned(a, b, share) {
  if (!known(a) || !known(b)) return a;
  const dot = a.reduce((sum, value, i) => sum + value * b[i], 0);
  const mixed = a.map((value, i) => (1 - share) * value + share * Math.sign(dot || 1) * b[i]);
  const length = Math.hypot(...mixed);
  return mixed.map((value) => value / length);
}
