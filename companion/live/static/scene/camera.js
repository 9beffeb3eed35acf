// The camera: turned by hand, by keys and by buttons.

import { PerspectiveCamera, Vector3 } from "../vendor/three/three.module.min.js";
import { OrbitControls } from "../vendor/three/OrbitControls.js";
import { reducedMotion } from "../theme.js";
import { centreOf, sizeOf } from "./bounds.js";

const TURN_RAD = Math.PI / 24;
const ZOOM = 0.9;
const GLIDE_MS = 350;
const FROM_SOUTH_WEST = new Vector3(-0.42, -0.92, 0.62).normalize();
// Not straight from above: there the turn about the vertical would not be defined.
const FROM_ABOVE = new Vector3(0, -0.001, 1).normalize();

export class Camera {
  constructor(canvas, changed) {
    this.lens = new PerspectiveCamera(40, 1, 0.05, 400);
    this.lens.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.lens, canvas);
    this.controls.enableDamping = false;
    this.controls.maxPolarAngle = Math.PI * 0.495;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 120;
    this.controls.zoomToCursor = false;
    this.controls.addEventListener("change", changed);
    this.controls.addEventListener("start", () => {
      this.untouched = false;
      this.gliding = 0;
    });
    this.untouched = true;
    this.view = FROM_SOUTH_WEST;
    this.followed = null;
    this.following = false;
    this.gliding = 0;
  }

  resize(width, height) {
    this.lens.aspect = width / height;
    this.lens.updateProjectionMatrix();
  }

  /** Look at the whole box, from the south-west or from above. */
  frame(box, above = false, glide = true) {
    this.untouched = true;
    this.view = above ? FROM_ABOVE : FROM_SOUTH_WEST;
    const size = sizeOf(box);
    const centre = new Vector3(...centreOf(box));
    centre.z = above ? 0 : 0.42 * size[2];
    const half = Math.tan((this.lens.fov * Math.PI) / 360);
    const wide = (above ? 0.5 * size[0] : 0.5 * Math.hypot(size[0], size[1])) + 0.6;
    const high = 0.5 * (above ? size[1] : 0.55 * Math.hypot(size[0], size[1]) + size[2]) + (above ? 1 : 0.6);
    const distance = Math.max(high / half, wide / (half * this.lens.aspect)) + (above ? 0 : 0.2 * size[1]);
    this.#move(centre, centre.clone().addScaledVector(this.view, distance), glide);
  }

  /** Frame the box again if nobody has turned the view since. */
  keep(box) {
    if (this.untouched && !this.following) this.frame(box, this.view === FROM_ABOVE, false);
  }

  follow(on) {
    this.following = on;
    this.followed = null;
    this.gliding = 0;
  }

  /** The vehicle has moved: while it is followed, the camera moves along. */
  track(position) {
    if (!this.following) return;
    const place = new Vector3(...position);
    const step = place.clone().sub(this.followed ?? this.controls.target);
    this.followed = place;
    this.lens.position.add(step);
    this.controls.target.add(step);
    this.controls.update();
  }

  /** Take a key; true if it meant something. */
  key(name) {
    const turns = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[name];
    if (turns) {
      this.controls.rotateLeft(-TURN_RAD * turns[0]);
      this.controls.rotateUp(TURN_RAD * turns[1]);
    } else if (name === "+" || name === "=") this.controls.dollyIn(ZOOM);
    else if (name === "-") this.controls.dollyOut(ZOOM);
    else return false;
    this.untouched = false;
    this.gliding = 0;
    this.controls.update();
    return true;
  }

  #move(target, position, glide) {
    const from = { target: this.controls.target.clone(), position: this.lens.position.clone() };
    this.gliding += 1;
    const mine = this.gliding;
    const begun = performance.now();
    const step = (now) => {
      if (mine !== this.gliding) return;
      const share = Math.min(1, Math.max(0, (now - begun) / GLIDE_MS));
      const eased = share * share * (3 - 2 * share);
      this.controls.target.lerpVectors(from.target, target, eased);
      this.lens.position.lerpVectors(from.position, position, eased);
      this.controls.update();
      if (share < 1) requestAnimationFrame(step);
    };
    step(glide && !reducedMotion() ? begun : begun + GLIDE_MS);
  }
}
