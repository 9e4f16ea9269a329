// What is drawn at the tools: where each was, and by how much they are apart.
import { THREE } from "nicegui-scene";

const POINTS = 240;
const STEP_M = 0.0015;
const FADE_MS = 8000; // so old a point is gone; our choice
const SCALES = [1000, 300, 100, 30, 10, 3, 1]; // the largest whose arrow is not longer than LONGEST_M
const LONGEST_M = 0.15;
const LEAST_M = 2e-5; // below a resolver's noise there is nothing to magnify

// A line behind a tool, which fades as it grows old.
export class Trail {
  constructor(scene, colour) {
    this.colour = colour;
    this.points = [];
    this.last = null; // where the tool was last, also when no point of that is left
    this.positions = new Float32Array(3 * POINTS);
    this.colours = new Float32Array(4 * POINTS);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(this.positions, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(this.colours, 4));
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
    this.line.frustumCulled = false;
    scene.add(this.line);
  }

  // Take where the tool is; return whether there is something to draw. One point is no line yet.
  show(tool, now) {
    const drawn = this.points.length > 1;
    const moved = tool && (!this.last || Math.hypot(...tool.map((value, k) => value - this.last[k])) >= STEP_M);
    if (moved) this.points.push({ at: (this.last = tool), time: now });
    while (this.points.length > POINTS || (this.points.length && now - this.points[0].time > FADE_MS)) this.points.shift();
    if (this.points.length < 2 && !drawn) return false;
    const { r, g, b } = new THREE.Color(this.colour());
    this.points.forEach(({ at, time }, k) => {
      this.positions.set(at, 3 * k);
      this.colours.set([r, g, b, 1 - (now - time) / FADE_MS], 4 * k);
    });
    const { attributes } = this.line.geometry;
    attributes.position.needsUpdate = attributes.color.needsUpdate = true;
    this.line.geometry.setDrawRange(0, this.points.length);
    return true;
  }
}

// An arrow from the twin's tool towards the real robot's, longer than it is by a scale that stands beside the distance.
export class Apart {
  constructor(scene, place, colour) {
    this.place = place;
    this.colour = colour;
    this.arrow = new THREE.ArrowHelper(new THREE.Vector3(1, 0, 0), new THREE.Vector3(), 0.1);
    for (const part of [this.arrow.line, this.arrow.cone]) Object.assign(part.material, { depthTest: false, transparent: true });
    this.arrow.renderOrder = 2;
    this.arrow.name = "apart";
    this.arrow.visible = false;
    scene.add(this.arrow);
    this.shown = "";
  }

  // Return whether there is something to draw.
  show(real, twin) {
    const way = real && twin ? new THREE.Vector3(...real).sub(new THREE.Vector3(...twin)) : new THREE.Vector3();
    const length = way.length();
    const shown = length >= LEAST_M ? `${real} ${twin}` : "";
    if (shown === this.shown) return false;
    this.shown = shown;
    this.arrow.visible = shown !== "";
    const scale = SCALES.find((one) => one * length <= LONGEST_M) ?? 1;
    if (shown) {
      this.arrow.position.set(...twin);
      this.arrow.setDirection(way.normalize());
      this.arrow.setLength(scale * length, Math.min(0.03, 0.4 * scale * length), 0.014);
      this.arrow.setColor(this.colour());
    }
    const words = shown ? `arrow: ${scale} times` : "";
    if (this.place.textContent !== words) this.place.textContent = words;
    return true;
  }
}
