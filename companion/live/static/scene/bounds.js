// What the scene shows of the world: a box in whole metres around what is flown.

import { known } from "../format.js";

const START = { low: [-1, -1, 0], high: [1, 1, 1.5] };
const MARGIN_M = 0.4;

/** The box around the desired path, the start and the fans' mouths. */
export function boundsOf(flight) {
  const box = { low: [...START.low], high: [...START.high] };
  for (const point of flight?.scene?.desired_enu_m ?? []) include(box, point);
  return box;
}

/** Widen a box, in whole metres, until a point is inside; true if it was not. */
export function include(box, point) {
  if (!known(point)) return false;
  let grown = false;
  for (let i = 0; i < 3; i += 1) {
    if (point[i] - MARGIN_M < box.low[i] && i < 2) {
      box.low[i] = Math.floor(point[i] - MARGIN_M);
      grown = true;
    }
    if (point[i] + MARGIN_M > box.high[i]) {
      box.high[i] = Math.ceil(point[i] + MARGIN_M);
      grown = true;
    }
  }
  return grown;
}

/** The smallest box that holds both. */
export function union(one, other) {
  return {
    low: one.low.map((value, i) => Math.min(value, other.low[i])),
    high: one.high.map((value, i) => Math.max(value, other.high[i])),
  };
}

export function centreOf(box) {
  return box.low.map((value, i) => (value + box.high[i]) / 2);
}

export function sizeOf(box) {
  return box.high.map((value, i) => value - box.low[i]);
}

/** How much larger than it is the vehicle is drawn, to be seen. */
export function vehicleScale(flight, box) {
  const arm = flight?.scene?.arm_m || 0.17;
  return Math.min(4, Math.max(1, (0.05 * Math.hypot(...sizeOf(box))) / arm));
}

/** How strongly a place of the path is drawn that is some seconds old. */
export function strength(age_s) {
  return 0.18 + 0.82 * Math.exp(-Math.max(0, age_s) / 6);
}

export const TRAIL_S = 60;
/** Metres of the arrow for each m/s² of push. */
export const PUSH_SCALE_M = 0.5;
