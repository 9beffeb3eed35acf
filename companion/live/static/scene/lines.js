// Wide lines whose points change at every frame, without new buffers.

import { Color } from "../vendor/three/three.module.min.js";
import { LineMaterial } from "../vendor/three/LineMaterial.js";
import { LineSegments2 } from "../vendor/three/LineSegments2.js";
import { LineSegmentsGeometry } from "../vendor/three/LineSegmentsGeometry.js";

/** A line of at most `most` points; each may have a colour of its own. */
export class WideLine {
  constructor(most, width, { dashed = false, coloured = false } = {}) {
    this.most = most;
    this.coloured = coloured;
    this.geometry = new LineSegmentsGeometry();
    this.geometry.setPositions(new Float32Array(6 * (most - 1)));
    if (coloured) this.geometry.setColors(new Float32Array(6 * (most - 1)));
    this.material = new LineMaterial({
      linewidth: width,
      vertexColors: coloured,
      dashed,
      dashSize: 0.09,
      gapSize: 0.07,
      alphaToCoverage: false,
    });
    this.object = new LineSegments2(this.geometry, this.material);
    this.object.frustumCulled = false;
    this.dashed = dashed;
    this.set([]);
  }

  /** Put the line through points [[x, y, z]…], with colours (three's) if it is coloured. */
  set(points, colours = null) {
    const count = Math.min(points.length, this.most);
    const places = this.geometry.attributes.instanceStart.data;
    const shades = this.coloured ? this.geometry.attributes.instanceColorStart.data : null;
    for (let i = 0; i + 1 < count; i += 1) {
      places.array.set(points[i], 6 * i);
      places.array.set(points[i + 1], 6 * i + 3);
      if (shades) {
        colours[i].toArray(shades.array, 6 * i);
        colours[i + 1].toArray(shades.array, 6 * i + 3);
      }
    }
    places.needsUpdate = true;
    if (shades) shades.needsUpdate = true;
    this.geometry.instanceCount = Math.max(0, count - 1);
    this.object.visible = count > 1;
    if (this.dashed && count > 1) this.object.computeLineDistances();
  }

  colour(value) {
    if (!this.coloured) this.material.color = new Color(value);
  }
}
