// The charts: what each shows, in which unit, and what that means.

const AXIS_COLOURS = ["x", "y", "z"];

// `bounds: "always"` widens the scale to the limit; "near" only if the figures come near it.
const axes = (prefix, digits) =>
  ["x", "y", "z"].map((label, i) => ({ key: `${prefix}${i}`, label, colour: AXIS_COLOURS[i], digits }));

export const CHARTS = [
  {
    id: "error",
    title: "Tracking error",
    unit: "mm",
    help:
      "Distance between the vehicle and the desired point of the same moment: against the true " +
      "position in a simulation, against the reported one otherwise.",
    series: [{ key: "error", label: "error", colour: "flown", digits: 1, fill: true }],
    floor: 0,
    least: 10,
  },
  {
    id: "tilt",
    title: "Tilt and thrust",
    unit: "°, share of full",
    help:
      "Tilt of the vehicle against its limit (dashed), left scale; thrust field of the setpoint " +
      "sent, 0 to 1, right scale.",
    series: [
      { key: "tilt", label: "tilt", colour: "flown", digits: 1, unit: "°" },
      { key: "thrust", label: "thrust", colour: "preview", digits: 2, scale: "right" },
    ],
    limit: (flight) => flight?.limits?.tilt_deg,
    bounds: "near",
    floor: 0,
    least: 5,
  },
  {
    id: "y_tilde",
    title: "Prediction error ỹ",
    unit: "m/s",
    help:
      "Predicted less measured velocity in the adaptive controller, by axis; dashed is the bound " +
      "that the monitor watches. Beyond it, the vehicle is not the one that the controller knows.",
    series: axes("y", 3),
    dashed: ["y_high0", "y_low0", "y_high1", "y_low1", "y_high2", "y_low2"],
    bounds: "near",
    least: 0.005,
    both: true,
  },
  {
    id: "sigma",
    title: "Disturbance estimate σ̂",
    unit: "% of its bound",
    help:
      "What the adaptive controller takes for disturbance, by axis, as a share of the bound of " +
      "its projection (dashed, ±100 %). At the bound, more disturbance is not made good.",
    series: axes("s", 1),
    limit: () => 100,
    bounds: "near",
    least: 2,
    both: true,
  },
  {
    id: "time",
    title: "Computing time and latency",
    unit: "ms",
    help:
      "Computing: the controller's work on one sample. Latency: from the sample's arrival to its " +
      "setpoint's departure. The largest since the last point; a deadline is missed at 5 ms (dashed).",
    series: [
      { key: "computed", label: "computing", colour: "flown", digits: 2 },
      { key: "latency", label: "latency", colour: "wind", digits: 2 },
    ],
    limit: (flight) => flight?.limits?.latency_ms ?? 5,
    bounds: "always",
    floor: 0,
    least: 1,
  },
  {
    id: "age",
    title: "State age",
    unit: "ms",
    help:
      "Age of the newest usable state when a setpoint was due. Beyond the limit (dashed) the " +
      "supervisor levels the vehicle, then hands it over.",
    series: [{ key: "age", label: "age", colour: "flown", digits: 1 }],
    limit: (flight) => flight?.limits?.state_age_ms,
    bounds: "always",
    floor: 0,
    least: 10,
  },
];
