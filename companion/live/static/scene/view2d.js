// The flight from the top, on a plain canvas: where there is no WebGL.

import { known } from "../format.js";
import { colour } from "../theme.js";
import { boundsOf, centreOf, include, PUSH_SCALE_M, sizeOf, strength, TRAIL_S, union, vehicleScale } from "./bounds.js";

const MARGIN_PX = 34;

export class View2d {
  constructor(host) {
    this.host = host;
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("aria-hidden", "true");
    host.append(this.canvas);
    this.pen = this.canvas.getContext("2d");
    this.flight = null;
    this.sample = null;
    this.places = [];
    this.zoom = 1;
    this.following = false;
    this.drawn = 0;
    this.box = boundsOf(null);
    new ResizeObserver(() => this.#draw()).observe(host);
  }

  setFlight(flight) {
    this.flight = flight;
    this.box = union(this.box, boundsOf(flight));
    this.#draw();
  }

  rebuild() {
    this.#draw();
  }

  show(sample, places) {
    this.sample = sample;
    this.places = places;
    include(this.box, sample.position);
    this.#draw();
  }

  reset() {
    this.zoom = 1;
    this.#draw();
  }

  top() {
    this.reset();
  }

  follow(on) {
    this.following = on;
    this.#draw();
  }

  key(name) {
    if (name === "+" || name === "=") this.zoom *= 1.1;
    else if (name === "-") this.zoom /= 1.1;
    else return false;
    this.#draw();
    return true;
  }

  #draw() {
    const width = Math.max(1, this.host.clientWidth);
    const height = Math.max(1, this.host.clientHeight);
    const ratio = Math.min(2, devicePixelRatio);
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    const size = sizeOf(this.box);
    const room = Math.min((width - 2 * MARGIN_PX) / size[0], (height - 2 * MARGIN_PX) / size[1]);
    this.metre = Math.max(1, room * this.zoom);
    const position = this.sample?.position;
    const middle = this.following && known(position) ? position : centreOf(this.box);
    this.at = ([x, y]) => [width / 2 + (x - middle[0]) * this.metre, height / 2 - (y - middle[1]) * this.metre];
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.fillStyle = colour("stage");
    this.pen.fillRect(0, 0, width, height);
    this.#ground();
    for (const fan of this.flight?.scene?.fans ?? []) this.#fan(fan);
    this.#fence();
    this.#line(this.flight?.scene?.desired_enu_m ?? [], "desired", 1.5, [6, 5]);
    this.#trail();
    this.#line((this.sample?.preview ?? []).filter(known), "preview", 3);
    this.#vehicle();
    this.drawn += 1;
    this.host.dataset.drawn = String(this.drawn);
  }

  #ground() {
    const [[west, south], [east, north]] = [this.box.low, this.box.high];
    this.pen.font = "11px system-ui, sans-serif";
    this.pen.textAlign = "center";
    this.pen.textBaseline = "middle";
    const every = Math.ceil(Math.max(east - west, north - south) / 10);
    const text = (value, place, right, down) => {
      if (value % every) return;
      this.pen.fillStyle = colour("muted");
      const [x, y] = this.at(place);
      this.pen.fillText(`${value}`.replace("-", "−"), x + right, y + down);
    };
    for (let x = west; x <= east; x += 1) {
      this.#line([[x, south], [x, north]], x === 0 ? "muted" : "line", 1);
      text(x, [x, south], 0, 12);
    }
    for (let y = south; y <= north; y += 1) {
      this.#line([[west, y], [east, y]], y === 0 ? "muted" : "line", 1);
      text(y, [west, y], -12, 0);
    }
    const [x, y] = this.at([(west + east) / 2, north]);
    this.pen.fillStyle = colour("north");
    this.pen.font = "600 14px system-ui, sans-serif";
    this.pen.fillText("▲ N", x, y - 14);
  }

  #fan({ position_enu_m: place, direction_enu: towards, half_angle_deg: half, range_m: range }) {
    const [x, y] = this.at(place);
    const heading = Math.atan2(-towards[1], towards[0]);
    const spread = (half * Math.PI) / 180;
    this.pen.beginPath();
    this.pen.moveTo(x, y);
    this.pen.arc(x, y, range * this.metre, heading - spread, heading + spread);
    this.pen.closePath();
    this.pen.globalAlpha = 0.22;
    this.pen.fillStyle = colour("wind");
    this.pen.fill();
    this.pen.globalAlpha = 1;
  }

  #fence() {
    const fence = this.flight?.scene?.geofence;
    if (!fence) return;
    const [[west, south], [east, north]] = [fence.low_enu_m, fence.high_enu_m];
    this.#line([[west, south], [east, south], [east, north], [west, north], [west, south]], "fence", 1.5);
  }

  #trail() {
    const newest = this.sample?.t ?? 0;
    for (let i = 0; i + 1 < this.places.length; i += 1) {
      const [t, place] = this.places[i];
      if (newest - t > TRAIL_S) continue;
      this.pen.globalAlpha = strength(newest - t);
      this.#line([place, this.places[i + 1][1]], "flown", 2.5);
    }
    this.pen.globalAlpha = 1;
  }

  #vehicle() {
    const { position, attitude, push, plan_end: end } = this.sample ?? {};
    if (known(end)) this.#disc(end, 4, "preview");
    if (!known(position)) return;
    if (known(push)) {
      const tip = position.map((value, i) => value + PUSH_SCALE_M * push[i]);
      if (Math.hypot(push[0], push[1]) > 0.05) this.#line([position, tip], "wind", 4);
    }
    const [w, x, y, z] = known(attitude) ? attitude : [1, 0, 0, 0];
    const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
    const arm = (this.flight?.scene?.arm_m || 0.17) * vehicleScale(this.flight, this.box);
    for (const turn of [45, 135, 225, 315]) {
      const angle = yaw + (turn * Math.PI) / 180;
      const rotor = [position[0] + arm * Math.cos(angle), position[1] + arm * Math.sin(angle)];
      this.#line([position, rotor], "vehicle", 3);
      this.#disc(rotor, Math.max(3, 0.4 * arm * this.metre), Math.cos((turn * Math.PI) / 180) > 0 ? "front" : "vehicle");
    }
  }

  #disc(place, radius, name) {
    this.pen.beginPath();
    this.pen.arc(...this.at(place), radius, 0, 2 * Math.PI);
    this.pen.fillStyle = colour(name);
    this.pen.fill();
  }

  #line(points, name, width, dash = []) {
    if (points.length < 2) return;
    this.pen.beginPath();
    points.forEach((point, i) => (i ? this.pen.lineTo(...this.at(point)) : this.pen.moveTo(...this.at(point))));
    this.pen.strokeStyle = colour(name);
    this.pen.lineWidth = width;
    this.pen.setLineDash(dash);
    this.pen.stroke();
    this.pen.setLineDash([]);
  }
}
