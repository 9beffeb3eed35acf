// Numbers as a person reads them.

export function isNumber(value) {
  return typeof value === "number" && Number.isFinite(value);
}

/** A number with a fixed count of digits, a true minus, or a dash where it is unknown. */
export function fixed(value, digits = 1) {
  if (!isNumber(value)) return "–";
  const text = value.toFixed(digits);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
}

/** Seconds as 12.3 s, or 2:05.0 from a minute on. */
export function clock(seconds) {
  if (!isNumber(seconds)) return "–";
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const tenths = Math.round(seconds * 10);
  const rest = (tenths % 600) / 10;
  return `${Math.floor(tenths / 600)}:${rest.toFixed(1).padStart(4, "0")}`;
}

/** Length of a vector of three; NaN where it is unknown. */
export function norm(vector) {
  return vector && vector.every(isNumber) ? Math.hypot(...vector) : NaN;
}

/** A vector of three known numbers? */
export function known(vector) {
  return Array.isArray(vector) && vector.length >= 3 && vector.every(isNumber);
}
