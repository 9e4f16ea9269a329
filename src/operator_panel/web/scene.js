// Moves the groups of the 3-D scene; draws edges, ghosts and the trails of both tools.
import { THREE } from "nicegui-scene";
import { Pace } from "./pace.js";

const TRAIL_POINTS = 240;
const TRAIL_STEP_M = 0.0015;
const EDGE_ANGLE_DEG = 30;
const PART_EDGES = 32;
const PERSON = { radius: 0.25, low: -0.4, high: 1.3, place: 0.05 }; // m: a body on the floor, and what was seen
const SEEN = 3e-4; // rad or m: less is no change of the picture, a resting encoder's noise least of all

export class Scene {
  constructor(told) {
    this.told = told;
    this.finished = new Set();
    this.trails = null;
    this.pose = {};
    this.size = "";
    this.parts = new Map();
    this.people = { told: "[]", bodies: [] };
    this.waiting = null;
    this.pace = null;
    this.poses = {};
    this.still = false;
  }

  get software() {
    return this.pace?.software ?? false;
  }

  get view() {
    return getElement(this.told.scene);
  }

  mesh(id) {
    return this.view?.objects?.get(id)?.mesh;
  }

  show(frame) {
    if (this.still || !this.view?.objects) return;
    if (!this.view.renderer) return this.standStill();
    this.pace ||= new Pace(this.view);
    this.fit();
    this.finish();
    if (this.waiting) this.putParts(this.waiting);
    for (const [side, pose] of Object.entries(frame.pose || {})) this.place(side, pose);
    for (const [side, tool] of Object.entries(frame.tool || {})) this.trace(side, tool);
    this.putPeople(frame.people || []);
  }

  // Without WebGL there is a still picture, and a word why.
  standStill() {
    this.still = true;
    document.querySelector(".stage").classList.add("no-webgl");
    document.querySelector("[data-still]").textContent =
      "A still picture: this browser has no WebGL, so it cannot draw the robots. All numbers are live. " +
      "Turn hardware acceleration on in the browser's settings, or choose Camera.";
  }

  place(side, pose) {
    if (side !== "preview" && isSame(pose, this.poses[side])) return;
    let missing = false;
    for (const [name, q] of Object.entries(pose)) {
      const joint = this.told.joints[side]?.[name];
      const mesh = joint && this.mesh(joint.id);
      if (joint && !mesh) missing = true;
      if (!mesh) continue;
      const [x, y, z] = joint.axis;
      if (joint.slides) mesh.position.set(x * q, y * q, z * q);
      else mesh.setRotationFromAxisAngle({ x, y, z }, q);
    }
    // Groups come one after the other: until all are there the pose is put again.
    this.poses[side] = missing ? null : pose;
    this.pace?.change();
  }

  // Parts come before the scene is there, or after: the newest ones are put when it is.
  showParts(parts) {
    this.waiting = parts;
  }

  putParts(sides) {
    this.waiting = null;
    this.pace.change();
    const there = new Set();
    for (const [side, parts] of Object.entries(sides)) {
      parts.forEach(([name, position, orientation, diameter, height, colour], index) => {
        const key = `${side} ${index} ${diameter} ${height}`;
        there.add(key);
        if (!this.parts.has(key)) this.parts.set(key, this.part(side, diameter, height));
        const mesh = this.parts.get(key);
        mesh.position.set(...position);
        mesh.quaternion.set(...orientation);
        if (side === "twin") mesh.material.color.set(colour);
        mesh.name = name;
      });
    }
    for (const [key, mesh] of this.parts) {
      if (there.has(key)) continue;
      this.view.scene.remove(mesh);
      this.parts.delete(key);
    }
  }

  // Where sensors see people: a body that can be seen through, and the place itself.
  putPeople(places) {
    const told = JSON.stringify(places);
    if (told === this.people.told) return;
    while (this.people.bodies.length > places.length) this.view.scene.remove(this.people.bodies.pop());
    while (this.people.bodies.length < places.length) this.people.bodies.push(this.person());
    places.forEach(([x, y, z], k) => {
      const body = this.people.bodies[k];
      body.position.set(x, y, 0);
      body.children[0].position.set(0, 0, z);
    });
    this.people.told = told;
    this.pace.change();
  }

  person() {
    const colour = css("--warn");
    const surface = { color: colour, transparent: true, opacity: 0.22, depthWrite: false };
    const height = PERSON.high - PERSON.low;
    const shape = new THREE.CylinderGeometry(PERSON.radius, PERSON.radius, height, PART_EDGES)
      .rotateX(Math.PI / 2)
      .translate(0, 0, PERSON.low + height / 2);
    const body = new THREE.Mesh(shape, new THREE.MeshPhongMaterial(surface));
    body.add(new THREE.Mesh(new THREE.SphereGeometry(PERSON.place), new THREE.MeshPhongMaterial({ color: colour })));
    body.add(new THREE.LineSegments(new THREE.EdgesGeometry(shape, EDGE_ANGLE_DEG), new THREE.LineBasicMaterial({ color: colour })));
    body.name = "person";
    body.renderOrder = 1;
    this.view.scene.add(body);
    return body;
  }

  // A cylinder along z; the real robot's is a ghost.
  part(side, diameter, height) {
    const geometry = new THREE.CylinderGeometry(diameter / 2, diameter / 2, height, PART_EDGES).rotateX(Math.PI / 2);
    const ghost = side === "real";
    const colour = ghost ? css("--real") : "#ffffff";
    const material = new THREE.MeshPhongMaterial({ color: colour, transparent: ghost, opacity: ghost ? 0.38 : 1, depthWrite: !ghost });
    const mesh = new THREE.Mesh(geometry, material);
    const edge = new THREE.LineBasicMaterial({ color: ghost ? colour : 0x10161d, transparent: true, opacity: ghost ? 0.9 : 0.4 });
    mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, EDGE_ANGLE_DEG), edge));
    mesh.renderOrder = ghost ? 1 : 0;
    this.view.scene.add(mesh);
    return mesh;
  }

  preview(pose) {
    const root = this.mesh(this.told.joints.preview.root.id);
    if (root) root.visible = pose !== null;
    this.pace?.change();
    if (pose !== null) this.place("preview", pose);
  }

  // Follow the size of the page; nicegui itself only follows the window.
  fit() {
    const { clientWidth, clientHeight } = this.view.$el;
    const size = `${clientWidth}x${clientHeight}`;
    if (size === this.size || !clientWidth || !this.view.renderer) return;
    this.size = size;
    this.view.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.view.renderer.setClearColor(0x000000, 0);
    this.view.resize();
    this.pace.change();
  }

  // Give new meshes their edges, and what is of glass a surface that hides nothing. A mesh can be here
  // before its material: glass is known by what the page was told.
  finish() {
    for (const [id, { mesh }] of this.view.objects) {
      if (!mesh?.isMesh || this.finished.has(id)) continue;
      this.finished.add(id);
      this.pace.change();
      const [colour, opacity] = this.told.glass[id] || [0x10161d, 1];
      const edges = new THREE.LineSegments(
        new THREE.EdgesGeometry(mesh.geometry, EDGE_ANGLE_DEG),
        new THREE.LineBasicMaterial({ color: colour, transparent: true, opacity: opacity < 1 ? 0.9 : 0.28 }),
      );
      mesh.add(edges);
      if (opacity === 1) {
        mesh.material.transparent = false;
        continue;
      }
      mesh.material.color.set(colour);
      Object.assign(mesh.material, { transparent: true, opacity, depthWrite: false });
      Object.assign(mesh.material, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
      mesh.renderOrder = 1;
    }
  }

  trace(side, tool) {
    this.trails ||= { real: this.trail("--real"), twin: this.trail("--twin") };
    const trail = this.trails[side];
    const last = trail.points.at(-1);
    if (last && Math.hypot(tool[0] - last[0], tool[1] - last[1], tool[2] - last[2]) < TRAIL_STEP_M) return;
    trail.points.push(tool);
    this.pace.change();
    if (trail.points.length > TRAIL_POINTS) trail.points.shift();
    trail.points.forEach((point, k) => trail.positions.set(point, 3 * k));
    trail.line.geometry.attributes.position.needsUpdate = true;
    trail.line.geometry.setDrawRange(0, trail.points.length);
    trail.line.material.color.set(css(trail.colour));
  }

  trail(colour) {
    const positions = new Float32Array(3 * TRAIL_POINTS);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    const line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: css(colour) }));
    line.frustumCulled = false;
    this.view.scene.add(line);
    return { points: [], positions, line, colour };
  }
}

function isSame(pose, shown) {
  return shown && Object.entries(pose).every(([name, q]) => Math.abs(q - shown[name]) < SEEN);
}

function css(variable) {
  return getComputedStyle(document.body).getPropertyValue(variable).trim();
}
