// Title, phase, outcome, link, and the chips of health.

import { clock, fixed, isNumber, known, norm } from "./format.js";

const STALE_S = 1;
const OUTCOME_LEVELS = { landed: "good", "handed over": "half", refused: "half" };

const byId = (id) => document.getElementById(id);

export function showFlight(flight) {
  document.title = `${flight.title} · companion`;
  byId("title").textContent = flight.title;
  const parts = [
    flight.controller,
    flight.trajectory,
    flight.vehicle,
    flight.autopilot,
    flight.wind,
    isNumber(flight.seed) ? `seed ${flight.seed}` : null,
    flight.mode === "recorded" ? "recorded" : null,
  ];
  byId("about").textContent = parts.filter(Boolean).join(" · ");
}

/** The outcome: of the recorded flight, or what the end of the live one says. */
export function showOutcome(outcome, note, meanErrorMm) {
  const badge = byId("outcome");
  badge.hidden = !outcome;
  if (!outcome) return;
  const mean = isNumber(meanErrorMm) ? `, mean error ${fixed(meanErrorMm, 1)} mm` : "";
  setBadge(badge, OUTCOME_LEVELS[outcome] ?? "bad", outcome + mean);
  badge.title = note ?? "";
}

/** "live", "stale for 2 s", "no connection", "flight over", "recorded". */
export function showLink({ recorded, over, open, silentS }) {
  const badge = byId("link");
  if (recorded) setBadge(badge, "none", "recorded");
  else if (over) setBadge(badge, "none", "flight over");
  else if (!open) setBadge(badge, "bad", "no connection, trying again");
  else if (silentS === Infinity) setBadge(badge, "half", "waiting for the flight");
  else if (silentS > STALE_S) setBadge(badge, "half", `stale for ${Math.floor(silentS)} s`);
  else setBadge(badge, "good", "live");
}

export function showPhase(frame) {
  const badge = byId("phase");
  if (!frame) setBadge(badge, "none", "no data yet");
  else setBadge(badge, frame.phase === "silence" ? "bad" : "none", frame.phase || "no phase");
}

/** The chips: mode, armed, battery, rung and fallback, monitor, missed deadlines. */
export function showChips(frame, flight) {
  const chips = frame ? chipsOf(frame) : [];
  if (flight?.commands && flight.readOnly) {
    chips.push(["Commands", "read-only: opened without the token", "none"]);
  }
  const list = byId("chips");
  while (list.children.length > chips.length) list.lastChild.remove();
  chips.forEach(([name, value, level], i) => {
    let chip = list.children[i];
    if (!chip) {
      chip = document.createElement("li");
      chip.append(document.createElement("span"), document.createElement("strong"));
      list.append(chip);
    }
    chip.dataset.level = level;
    setText(chip.firstChild, name);
    setText(chip.lastChild, value);
  });
}

function chipsOf(frame) {
  const battery = frame.battery_percent;
  const batteryLevel = !isNumber(battery) ? "none" : battery < 15 ? "bad" : battery < 30 ? "half" : "good";
  const armed = frame.armed === null || frame.armed === undefined ? "–" : frame.armed ? "yes" : "no";
  const rungLevel = { track: "good", level: "half", "hand over": "bad" }[frame.rung] ?? "none";
  const monitorLevel = { nominal: "good", reduced: "half", robust: "half", failed: "bad" };
  const missed = frame.missed_deadlines;
  return [
    ["Mode", frame.mode || "–", "none"],
    ["Armed", armed, frame.armed ? "good" : "none"],
    ["Battery", isNumber(battery) ? `${fixed(battery, 0)} %` : "–", batteryLevel],
    ["Supervisor", (frame.rung || "–") + (frame.fallback ? ` (${frame.fallback})` : ""),
      frame.fallback && rungLevel === "good" ? "half" : rungLevel],
    ["Controller", frame.controller || "–", "none"],
    ["Monitor", frame.monitor || "–", monitorLevel[frame.monitor] ?? "none"],
    ["Missed deadlines", isNumber(missed) ? String(missed) : "–", missed > 0 ? "half" : isNumber(missed) ? "good" : "none"],
  ];
}

/** The figures over the scene. */
export function showFigures(frame) {
  const push = norm(frame?.push);
  const rows = [
    ["time", frame ? clock(frame.t) : "–"],
    ["error", isNumber(frame?.error_mm) ? `${fixed(frame.error_mm, frame.error_mm < 10 ? 1 : 0)} mm` : "–"],
    ["height", known(frame?.position) ? `${fixed(frame.position[2], 2)} m` : "–"],
    ["speed", isNumber(norm(frame?.velocity)) ? `${fixed(norm(frame.velocity), 2)} m/s` : "–"],
    ["wind's push", isNumber(push) ? `${fixed(push, 2)} m/s²` : "–"],
  ];
  const list = byId("figures");
  if (!list.children.length) {
    for (const [name] of rows) {
      const row = document.createElement("div");
      const term = document.createElement("dt");
      term.textContent = name;
      row.append(term, document.createElement("dd"));
      list.append(row);
    }
  }
  rows.forEach(([, value], i) => setText(list.children[i].lastChild, value));
}

function setBadge(badge, level, text) {
  badge.dataset.level = level;
  setText(badge, text);
}

// A text that is set again, the same, would be read again by a screen reader.
function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}
