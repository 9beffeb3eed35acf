// Joins the parts of the page: data in, scene, charts and words out.

import { Charts } from "./charts.js";
import { Commands, takeToken } from "./commands.js";
import { Connection } from "./connection.js";
import { showChips, showFigures, showFlight, showLink, showOutcome, showPhase } from "./header.js";
import { Messages } from "./messages.js";
import { Player } from "./player.js";
import { TRAIL_S } from "./scene/bounds.js";
import { makeView, showLegend } from "./scene/view.js";
import { Store } from "./store.js";
import { reducedMotion, startTheme } from "./theme.js";

const WINDOW_S = 30;
const CHART_MS = 100;
const STILL_CHART_MS = 1000;
const LINK_MS = 250;

const byId = (id) => document.getElementById(id);
const store = new Store();
const commands = new Commands(takeToken());
const messages = new Messages(byId("messages"));
const charts = new Charts(byId("charts"), (time) => player.active && player.seek(time));
const player = new Player(() => showAt());
const view = makeView(byId("stage"));
const link = { open: false, arrivedAt: null };
let waiting = false;
let chartsAt = 0;
let chartsLater = null;

startTheme(byId("theme"), () => {
  charts.recolour();
  view.rebuild();
});
startViewButtons();
setInterval(showLinkState, LINK_MS);

new Connection({
  flight(flight) {
    store.flight = flight;
    showFlight(flight);
    showLegend(byId("legend"), flight);
    view.setFlight(flight);
    const { result } = flight;
    if (result) showOutcome(result.outcome, result.note, result.mean_error_mm);
    flight.readOnly = !commands.token;
    offerCommands();
    changed();
  },
  history(frames, said) {
    store.reset(frames, said);
    if (store.flight?.mode === "recorded") offerPlayer(store.firstTime);
    changed();
  },
  frame(frame) {
    link.arrivedAt = performance.now();
    if (store.append(frame)) changed();
  },
  message(message) {
    store.messages.push(message);
    changed();
  },
  end(end) {
    store.end = end;
    showOutcome(end.outcome, end.note, end.mean_error_mm);
    offerCommands();
    offerPlayer(store.lastTime);
    changed();
  },
  state(state) {
    link.open = state === "open";
    offerCommands();
    showLinkState();
  },
}).start();

function offerCommands() {
  commands.offer(store.flight?.commands && store.flight.mode === "live" && !store.end);
}

// A flight that is over is shown whole, with a slider.
function offerPlayer(time) {
  if (!store.frames.length) return;
  charts.show(store, store.firstTime, store.lastTime);
  player.offer(store.firstTime, store.lastTime, time);
}

// Whatever came since the last picture is shown at once.
function changed() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    showAt();
  });
}

function showAt() {
  const time = player.active ? player.time : store.lastTime;
  const sample = player.active ? store.at(time) : store.last;
  showPhase(sample);
  showChips(sample, store.flight);
  showFigures(sample);
  messages.show(store.messages, player.active ? time : Infinity);
  if (sample) view.show(sample, store.trail(time, TRAIL_S));
  if (player.active) charts.mark(time);
  else if (sample) showLiveCharts(time);
}

function showLiveCharts(time) {
  const now = performance.now();
  const rest = chartsAt + (reducedMotion() ? STILL_CHART_MS : CHART_MS) - now;
  clearTimeout(chartsLater);
  if (rest > 0) {
    chartsLater = setTimeout(changed, rest);
    return;
  }
  chartsAt = now;
  charts.show(store, Math.max(store.firstTime, time - WINDOW_S), Math.max(time, store.firstTime + WINDOW_S));
}

function showLinkState() {
  showLink({
    recorded: store.flight?.mode === "recorded",
    over: store.end !== null,
    open: link.open,
    silentS: link.arrivedAt === null ? Infinity : (performance.now() - link.arrivedAt) / 1000,
  });
}

function startViewButtons() {
  const follow = byId("view-follow");
  const setFollow = (on) => {
    follow.setAttribute("aria-pressed", String(on));
    view.follow(on);
  };
  const acts = {
    r: () => {
      setFollow(false);
      view.reset();
    },
    f: () => setFollow(follow.getAttribute("aria-pressed") !== "true"),
    t: () => {
      setFollow(false);
      view.top();
    },
  };
  byId("view-reset").addEventListener("click", acts.r);
  follow.addEventListener("click", acts.f);
  byId("view-top").addEventListener("click", acts.t);
  byId("stage").addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const act = acts[event.key.toLowerCase()];
    if (act) act();
    else if (!view.key(event.key)) return;
    event.preventDefault();
  });
}
