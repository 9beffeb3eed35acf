// The scene in three dimensions where there is WebGL, else from the top.

import { View2d } from "./view2d.js";
import { View3d } from "./view3d.js";

/** Make the view that this browser can show. */
export function makeView(host) {
  const kind = hasWebgl() ? View3d : View2d;
  host.dataset.view = kind === View3d ? "3d" : "2d";
  return new kind(host);
}

// Asked first and quietly: three.js itself complains loudly where there is none.
function hasWebgl() {
  return document.createElement("canvas").getContext("webgl2") !== null;
}

/** Say what the lines are; only those that this flight has. */
export function showLegend(list, flight) {
  const { scene } = flight;
  const entries = [
    ["flown", "line", "flown"],
    ["desired", "dashed", "desired"],
    ["preview", "line", `preview, ${scene.horizon_s ? `${Number(scene.horizon_s.toFixed(1))} s` : "horizon"}`],
    ["preview", "dot", "plan's end"],
    ["wind", "line", scene.fans.length ? "fan and its push" : "wind's push"],
  ];
  if (scene.geofence) entries.push(["fence", "line", "geofence"]);
  list.replaceChildren(
    ...entries.map(([colour, kind, text]) => {
      const item = document.createElement("li");
      item.dataset.colour = colour;
      item.dataset.kind = kind;
      item.textContent = text;
      return item;
    }),
  );
}
