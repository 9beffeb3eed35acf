// What stands in the scene: the vehicle, fans, arrows, the ground and its figures.

import {
  BoxGeometry, BufferGeometry, CanvasTexture, CircleGeometry, Color, ConeGeometry, CylinderGeometry,
  DoubleSide, Float32BufferAttribute, Group, Line, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, Quaternion, RingGeometry, SphereGeometry, Sprite,
  SpriteMaterial, TorusGeometry, Vector3,
} from "../vendor/three/three.module.min.js";

/** A quadrotor with arms of 1 in body axes FLU: nose along x, the front rotors coloured. */
export function vehicle(colours) {
  const body = new MeshLambertMaterial({ color: colours.vehicle });
  const front = new MeshLambertMaterial({ color: colours.front, side: DoubleSide });
  const back = new MeshLambertMaterial({ color: colours.vehicle, side: DoubleSide });
  const group = new Group();
  group.add(new Mesh(new BoxGeometry(0.75, 0.42, 0.2), body));
  const nose = new Mesh(new ConeGeometry(0.17, 0.4, 4), front);
  nose.rotation.z = -Math.PI / 2;
  nose.position.set(0.5, 0, 0);
  group.add(nose);
  for (const angle of [45, 135, 225, 315]) {
    const turn = (angle * Math.PI) / 180;
    const place = [Math.cos(turn), Math.sin(turn)];
    const arm = new Mesh(new BoxGeometry(1, 0.09, 0.09), body);
    arm.position.set(place[0] / 2, place[1] / 2, 0);
    arm.rotation.z = turn;
    const material = place[0] > 0 ? front : back;
    const ring = new Mesh(new TorusGeometry(0.46, 0.045, 6, 28), material);
    const disc = new Mesh(new CircleGeometry(0.46, 28), material.clone());
    disc.material.transparent = true;
    disc.material.opacity = 0.35;
    disc.material.depthWrite = false;
    for (const part of [ring, disc]) {
      part.position.set(place[0], place[1], 0.12);
      group.add(part);
    }
    group.add(arm);
  }
  return group;
}

/** The vehicle's shadow, and the stalk from it to the ground. */
export function shadow(colours) {
  const disc = new Mesh(
    new CircleGeometry(1, 32),
    new MeshBasicMaterial({ color: colours.ink, transparent: true, opacity: 0.16, depthWrite: false }),
  );
  const stalk = new Line(
    new BufferGeometry().setAttribute("position", new Float32BufferAttribute([0, 0, 0, 0, 0, 1], 3)),
    new LineBasicMaterial({ color: colours.muted }),
  );
  return { disc, stalk };
}

/** An arrow of length 1 along x; `point` turns and stretches it. */
export class Arrow {
  constructor(colour, width) {
    const material = new MeshLambertMaterial({ color: colour });
    this.shaft = new Mesh(new CylinderGeometry(width, width, 1, 10), material);
    this.head = new Mesh(new ConeGeometry(3 * width, 7 * width, 14), material);
    this.headLength = 7 * width;
    this.object = new Group();
    this.object.add(this.shaft, this.head);
    this.object.visible = false;
  }

  point(from, along) {
    const length = Math.hypot(...along);
    this.object.visible = length > 0.02;
    if (!this.object.visible) return;
    this.object.position.set(...from);
    this.object.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), new Vector3(...along).normalize());
    const shaft = Math.max(1e-3, length - this.headLength);
    this.shaft.scale.y = shaft;
    this.shaft.position.y = shaft / 2;
    this.head.position.y = shaft + this.headLength / 2;
  }
}

/** A fan: a disc where it stands, and the cone of its jet. */
export function fan({ position_enu_m: place, direction_enu: towards, half_angle_deg: half, range_m: range }, colours) {
  const radius = range * Math.tan((half * Math.PI) / 180);
  const group = new Group();
  const cone = new ConeGeometry(radius, range, 40, 1, true);
  cone.translate(0, -range / 2, 0);
  const look = { color: colours.wind, transparent: true, depthWrite: false, side: DoubleSide };
  group.add(new Mesh(cone, new MeshBasicMaterial({ ...look, opacity: 0.13 })));
  const ribs = [];
  for (let i = 0; i < 8; i += 1) {
    const turn = (i * Math.PI) / 4;
    ribs.push(0, 0, 0, radius * Math.cos(turn), -range, radius * Math.sin(turn));
  }
  group.add(
    new LineSegments(
      new BufferGeometry().setAttribute("position", new Float32BufferAttribute(ribs, 3)),
      new LineBasicMaterial({ color: colours.wind, transparent: true, opacity: 0.4 }),
    ),
  );
  const frame = new Mesh(new TorusGeometry(0.22, 0.03, 8, 32), new MeshLambertMaterial({ color: colours.wind }));
  const blades = new Mesh(new CircleGeometry(0.22, 3), new MeshBasicMaterial({ ...look, opacity: 0.6 }));
  for (const part of [frame, blades]) {
    part.rotation.x = Math.PI / 2;
    group.add(part);
  }
  group.position.set(...place);
  group.quaternion.copy(
    new Quaternion().setFromUnitVectors(new Vector3(0, -1, 0), new Vector3(...towards).normalize()),
  );
  return group;
}

/** The ring where the plan ends. */
export function planEnd(colours) {
  return new Mesh(new SphereGeometry(1, 14, 10), new MeshBasicMaterial({ color: colours.preview }));
}

/** The edges of a box. */
export function edges({ low_enu_m: low, high_enu_m: high }, colour) {
  const corner = (bits) => [0, 1, 2].map((i) => (bits & (1 << i) ? high[i] : low[i]));
  const ends = [];
  for (let bits = 0; bits < 8; bits += 1) {
    for (let i = 0; i < 3; i += 1) {
      if (!(bits & (1 << i))) ends.push(...corner(bits), ...corner(bits | (1 << i)));
    }
  }
  return new LineSegments(
    new BufferGeometry().setAttribute("position", new Float32BufferAttribute(ends, 3)),
    new LineBasicMaterial({ color: colour, transparent: true, opacity: 0.55 }),
  );
}

/** The ground: a line at each metre, figures at two edges, an arrow to the north. */
export function ground(box, colours) {
  const [[west, south], [east, north]] = [box.low, box.high];
  const group = new Group();
  const thin = [];
  const thick = [];
  const line = (list, ...ends) => list.push(...ends);
  for (let x = west; x <= east; x += 1) line(x === 0 ? thick : thin, x, south, 0, x, north, 0);
  for (let y = south; y <= north; y += 1) line(y === 0 ? thick : thin, west, y, 0, east, y, 0);
  for (const [list, colour] of [[thin, colours.line], [thick, colours.muted]]) {
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(list, 3));
    group.add(new LineSegments(geometry, new LineBasicMaterial({ color: colour })));
  }
  const size = Math.max(0.16, 0.045 * Math.max(east - west, north - south));
  const every = Math.ceil(Math.max(east - west, north - south) / 10);
  const text = (words, x, y, colour = colours.muted, height = size) => group.add(label(words, [x, y, 0], height, colour));
  for (let x = west; x <= east; x += 1) if (x % every === 0) text(`${x}`.replace("-", "−"), x, south - 1.1 * size);
  for (let y = south; y <= north; y += 1) if (y % every === 0) text(`${y}`.replace("-", "−"), west - 1.2 * size, y);
  text("east, m", (west + east) / 2, south - 2.6 * size);
  const middle = (west + east) / 2;
  const tip = [-0.6, 0, 0, 0, 0.35, 0, 0, 1.8, 0, 0.6, 0, 0, 0, 1.8, 0, 0, 0.35, 0].map((value) => value * size);
  const arrow = new Mesh(
    new BufferGeometry().setAttribute("position", new Float32BufferAttribute(tip, 3)),
    new MeshBasicMaterial({ color: colours.north, side: DoubleSide }),
  );
  arrow.position.set(middle, north + 0.4 * size, 0);
  group.add(arrow);
  text("N", middle, north + 3.2 * size, colours.north, 1.5 * size);
  return group;
}

/** The ring around the place of take-off. */
export function start(colours) {
  return new Mesh(
    new RingGeometry(0.1, 0.13, 32),
    new MeshBasicMaterial({ color: colours.muted, side: DoubleSide }),
  );
}

// A text that always faces the camera.
function label(words, place, height, colour) {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d");
  const font = "600 44px system-ui, sans-serif";
  context.font = font;
  canvas.width = Math.ceil(context.measureText(words).width) + 8;
  canvas.height = 56;
  context.font = font;
  context.fillStyle = colour;
  context.textBaseline = "middle";
  context.fillText(words, 4, 30);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = "srgb";
  const sprite = new Sprite(new SpriteMaterial({ map: texture, transparent: true, depthWrite: false }));
  sprite.scale.set((height * canvas.width) / canvas.height, height, 1);
  sprite.position.set(...place);
  return sprite;
}

/** Give back what a branch of the scene holds on the graphics card. */
export function dispose(branch) {
  branch.traverse((object) => {
    object.geometry?.dispose();
    object.material?.map?.dispose();
    object.material?.dispose();
  });
  branch.removeFromParent();
}

/** A colour on the way from the background to itself. */
export function faded(background, colour, share) {
  return new Color(background).lerp(new Color(colour), share);
}
