// Moves the groups of the 3-D scene; draws edges, ghosts and the trails of both tools.
import { THREE } from "nicegui-scene";
import { Pace } from "./pace.js";
import { Apart, Trail } from "./picture/marks.js";

const WHOLE_ASPECT = 1.5; // width by height of a picture in which the views show the whole robot; our choice
const SOFTWARE_PIXELS = 250_000; // a processor draws no more in a tenth of a second; our choice
const EDGE_ANGLE_DEG = 30;
const PART_EDGES = 32;
const PERSON = { radius: 0.25, low: -0.4, high: 1.3, place: 0.05 }; // m: a body on the floor, and what was seen
const SEEN = 3e-4; // rad or m: less is no change of the picture, a resting encoder's noise least of all
const SIDES = ["twin", "real"];

export class Scene {
  constructor(told) {
    this.told = told;
    this.finished = new Set();
    this.trails = null;
    this.apart = null;
    this.followed = null;
    this.pose = {};
    this.size = "";
    this.parts = new Map();
    this.people = { told: "[]", bodies: [] };
    this.waiting = null;
    this.pace = null;
    this.poses = {};
    this.still = false;
    this.tool = null; // where the twin's is [m]
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
    for (const side of SIDES) this.putRobot(side, frame.pose?.[side]);
    this.trace(frame.tool || {});
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

  // A side that is not known is nowhere in the picture: where it stood before is not of this moment.
  putRobot(side, pose) {
    if (pose) this.place(side, pose);
    for (const { id } of Object.values(this.told.joints[side])) {
      const group = this.mesh(id);
      if (!group || group.visible === Boolean(pose)) continue;
      group.visible = Boolean(pose);
      this.pace.change();
    }
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

  // From above, and no pointer turns the picture while it drags the tool.
  guide(on) {
    if (on) document.querySelector("[data-view=Top]").click();
    this.view.controls.enabled = !on;
  }

  // Where a pointer is on the level of the twin's tool: x, y [m]; null where it meets that nowhere.
  placeUnder({ clientX, clientY }) {
    const { camera, renderer } = this.view;
    const { left, top, width, height } = renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height);
    const caster = new THREE.Raycaster();
    caster.setFromCamera(at, camera);
    const level = new THREE.Plane(new THREE.Vector3(0, 0, 1), -(this.tool?.[2] ?? NaN));
    const place = caster.ray.intersectPlane(level, new THREE.Vector3());
    return place && Number.isFinite(place.x + place.y) ? [place.x, place.y] : null;
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
    const finest = Math.min(window.devicePixelRatio, 2);
    const coarse = Math.sqrt(SOFTWARE_PIXELS / (clientWidth * clientHeight));
    this.view.renderer.setPixelRatio(this.software ? Math.min(finest, coarse) : finest);
    this.view.renderer.setClearColor(0x000000, 0);
    this.view.resize();
    // On a high picture the eye sees as far to both sides as on a wide one: no arm leaves it.
    const { camera } = this.view;
    camera.zoom = Math.min(1, clientWidth / clientHeight / WHOLE_ASPECT);
    camera.updateProjectionMatrix();
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

  // Where the tools were, how far they are apart, and the eye if it follows the tool.
  trace(tools) {
    this.tool = tools.twin ?? this.tool;
    const { scene, camera, controls } = this.view;
    this.trails ||= { real: new Trail(scene, () => css("--real")), twin: new Trail(scene, () => css("--twin")) };
    this.apart ||= new Apart(scene, document.querySelector("[data-magnified]"), () => css("--deviation"));
    const now = performance.now();
    let changed = this.apart.show(tools.real, tools.twin);
    for (const [side, trail] of Object.entries(this.trails)) changed = trail.show(tools[side], now) || changed;
    const tool = document.querySelector("[data-follow][aria-pressed=true]") ? tools.twin : null;
    if (tool && this.followed) {
      const step = tool.map((value, k) => value - this.followed[k]);
      for (const place of [camera.position, controls.target]) place.set(place.x + step[0], place.y + step[1], place.z + step[2]);
      controls.update();
    }
    this.followed = tool;
    if (changed) this.pace.change();
  }
}

function isSame(pose, shown) {
  return shown && Object.entries(pose).every(([name, q]) => Math.abs(q - shown[name]) < SEEN);
}

function css(variable) {
  return getComputedStyle(document.body).getPropertyValue(variable).trim();
}
