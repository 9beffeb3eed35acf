// The flight in three dimensions, drawn by three.js whenever something has changed.
// World axes are those of the flight: x east, y north, z up, in metres.

import {
  AmbientLight, Color, DirectionalLight, Group, Scene, WebGLRenderer,
} from "../vendor/three/three.module.min.js";
import { known } from "../format.js";
import { colour } from "../theme.js";
import { boundsOf, include, PUSH_SCALE_M, strength, TRAIL_S, union, vehicleScale } from "./bounds.js";
import { Camera } from "./camera.js";
import { WideLine } from "./lines.js";
import { Arrow, dispose, edges, faded, fan, ground, planEnd, shadow, start, vehicle } from "./parts.js";

const NAMES = ["ink", "muted", "line", "paper", "stage", "flown", "desired", "preview", "wind", "fence", "front", "vehicle", "north"];
const SHADES = 64;

export class View3d {
  /** Throws where there is no WebGL. */
  constructor(host) {
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "low-power" });
    this.host = host;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.domElement.setAttribute("aria-hidden", "true");
    host.append(this.renderer.domElement);
    this.camera = new Camera(this.renderer.domElement, () => this.#draw());
    this.scene = new Scene();
    const sun = new DirectionalLight("#ffffff", 1.6);
    sun.position.set(-3, -5, 9);
    this.scene.add(sun, new AmbientLight("#ffffff", 1.5));
    this.flight = null;
    this.sample = null;
    this.box = boundsOf(null);
    this.asked = false;
    this.rebuild();
    this.camera.frame(this.box, false, false);
    new ResizeObserver(() => this.#resize()).observe(host);
    this.#resize();
  }

  setFlight(flight) {
    this.flight = flight;
    this.box = union(this.box, boundsOf(flight));
    this.rebuild();
    this.camera.keep(this.box);
  }

  /** Make everything anew, in the colours of now. */
  rebuild() {
    if (this.things) dispose(this.things);
    const colours = Object.fromEntries(NAMES.map((name) => [name, colour(name)]));
    this.scene.background = new Color(colours.stage);
    this.things = new Group();
    this.scene.add(this.things);
    this.scale = vehicleScale(this.flight, this.box);
    this.arm = (this.flight?.scene?.arm_m || 0.17) * this.scale;
    this.vehicle = vehicle(colours);
    this.vehicle.scale.setScalar(this.arm);
    this.shadow = shadow(colours);
    this.planEnd = planEnd(colours);
    this.planEnd.scale.setScalar(0.22 * this.arm);
    this.push = new Arrow(colours.wind, 0.09 * this.arm);
    this.trail = new WideLine(2000, 3, { coloured: true });
    this.preview = new WideLine(32, 4);
    this.desired = new WideLine(1000, 2, { dashed: true });
    this.preview.colour(colours.preview);
    this.desired.colour(colours.desired);
    this.desired.set(this.flight?.scene?.desired_enu_m ?? []);
    // The older, the nearer to the background; the newest first.
    this.shades = Array.from({ length: SHADES }, (_, i) =>
      faded(colours.stage, colours.flown, strength((i * TRAIL_S) / SHADES)));
    const moving = [this.vehicle, this.shadow.disc, this.shadow.stalk, this.planEnd, this.push.object];
    for (const thing of moving) thing.visible = false;
    const lines = [this.desired, this.trail, this.preview].map((line) => line.object);
    this.things.add(...moving, ...lines, ground(this.box, colours), start(colours));
    for (const one of this.flight?.scene?.fans ?? []) this.things.add(fan(one, colours));
    if (this.flight?.scene?.geofence) this.things.add(edges(this.flight.scene.geofence, colours.fence));
    if (this.sample) this.show(this.sample, this.places);
    this.#draw();
  }

  /** Show a frame, and the path flown up to it: [[t, place]…]. */
  show(sample, places) {
    this.sample = sample;
    this.places = places;
    const { position, attitude, preview, plan_end: end, push } = sample;
    const here = known(position);
    for (const thing of [this.vehicle, this.shadow.disc, this.shadow.stalk]) thing.visible = here;
    if (here) {
      if (include(this.box, position)) {
        this.rebuild();
        this.camera.keep(this.box);
        return;
      }
      this.vehicle.position.set(...position);
      if (known(attitude)) this.vehicle.quaternion.set(attitude[1], attitude[2], attitude[3], attitude[0]);
      this.shadow.disc.position.set(position[0], position[1], 0.006);
      this.shadow.disc.scale.setScalar(this.arm * 0.9);
      this.shadow.stalk.position.set(position[0], position[1], 0);
      this.shadow.stalk.scale.z = Math.max(1e-3, position[2]);
      this.camera.track(position);
    }
    this.planEnd.visible = known(end);
    if (known(end)) this.planEnd.position.set(...end);
    const along = known(push) ? push.map((value) => value * PUSH_SCALE_M) : [0, 0, 0];
    this.push.point(here ? position : [0, 0, 0], here ? along : [0, 0, 0]);
    this.preview.set((preview ?? []).filter(known));
    const newest = places.slice(-2000);
    const shade = ([t]) => this.shades[Math.min(SHADES - 1, Math.max(0, Math.floor(((sample.t - t) * SHADES) / TRAIL_S)))];
    this.trail.set(newest.map(([, place]) => place), newest.map(shade));
    this.#draw();
  }

  reset() {
    this.camera.frame(this.box);
  }

  top() {
    this.camera.frame(this.box, true);
  }

  follow(on) {
    this.camera.follow(on);
    if (on && known(this.sample?.position)) this.camera.track(this.sample.position);
  }

  key(name) {
    return this.camera.key(name);
  }

  #resize() {
    const width = Math.max(1, this.host.clientWidth);
    const height = Math.max(1, this.host.clientHeight);
    this.renderer.setSize(width, height);
    this.camera.resize(width, height);
    this.camera.keep(this.box);
    this.#draw();
  }

  // Once before the next picture, however much has changed.
  #draw() {
    if (this.asked || !this.camera) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.renderer.render(this.scene, this.camera.lens);
      this.host.dataset.drawn = String(this.renderer.info.render.frame);
    });
  }
}
