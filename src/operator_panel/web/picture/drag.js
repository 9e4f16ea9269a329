// A place of the tool is chosen in the picture: a marker is dragged, and where it is let go is told to the page.
import { THREE } from "nicegui-scene";

const SIZE = { radius: 0.012, height: 0.04 }; // m: the marker, a cone whose tip is the place
const GAP_MM = 0.5; // over a part: as near as a nozzle grips it; our choice

export class Drag {
  constructor(scene, button) {
    Object.assign(this, { scene, button, marker: null, pointer: null, guide: null });
    this.ray = new THREE.Raycaster();
    button.addEventListener("click", () => this.turn(!this.isOn));
    // A pointer in the picture means one thing: a place, or the robots' way.
    this.guide = document.querySelector("[data-guide]");
    this.guide?.addEventListener("click", () => this.turn(false));
    const on = (name, act) => document.addEventListener(name, act, { capture: true });
    on("pointerdown", (event) => this.begin(event));
    on("pointermove", (event) => event.pointerId === this.pointer && this.move(event));
    on("pointerup", (event) => event.pointerId === this.pointer && this.drop());
    on("pointercancel", () => this.end());
    on("keydown", (event) => event.key === "Escape" && this.isOn && this.turn(false));
  }

  get isOn() {
    return this.button.getAttribute("aria-pressed") === "true";
  }

  turn(on) {
    if (on && this.guide?.getAttribute("aria-pressed") === "true") this.guide.click();
    if (on && this.scene.still) emitEvent("dropped", []); // the page says that there is no picture
    this.button.setAttribute("aria-pressed", on && !this.scene.still);
    this.end();
  }

  begin(event) {
    const { view } = this.scene;
    const isPast = document.body.matches(".is-past"); // its parts may be elsewhere now
    if (!this.isOn || isPast || event.button !== 0 || !view?.$el.contains(event.target)) return;
    // The eye stays where it is meanwhile.
    event.preventDefault();
    event.stopPropagation();
    this.pointer = event.pointerId;
    this.marker ||= this.cone();
    if (!this.marker.visible) this.marker.position.set(0, 0, this.scene.tool?.[2] ?? 0);
    this.marker.visible = true;
    this.move(event);
  }

  // A point of the ray: above a part, if it meets one; with Shift straight up or down; else at the marker's height.
  move(event) {
    const { view } = this.scene;
    const box = view.renderer.domElement.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    this.ray.setFromCamera(new THREE.Vector2(x, y), view.camera);
    const at = this.marker.position;
    const parts = [...this.scene.parts].filter(([key]) => key.startsWith("twin ")).map(([, mesh]) => mesh);
    for (const part of parts) part.updateMatrixWorld(); // what was not drawn yet is where it was before
    const [hit] = this.ray.intersectObjects(parts, false);
    if (hit && !event.shiftKey) {
      const { position, geometry } = hit.object;
      at.set(position.x, position.y, position.z + geometry.parameters.height / 2 + GAP_MM * 1e-3);
    } else {
      const found = this.ray.ray.intersectPlane(this.plane(event.shiftKey, at), new THREE.Vector3());
      if (found && event.shiftKey) at.setZ(found.z);
      else if (found) at.copy(found);
    }
    this.scene.pace.change();
  }

  plane(upright, at) {
    const normal = new THREE.Vector3(0, 0, 1);
    if (upright) this.scene.view.camera.getWorldDirection(normal).setZ(0).normalize();
    return new THREE.Plane().setFromNormalAndCoplanarPoint(normal, at);
  }

  drop() {
    this.pointer = null;
    const { x, y, z } = this.marker.position;
    emitEvent("dropped", [x, y, z].map((value) => Math.round(value * 1e6) / 1e3));
  }

  end() {
    this.pointer = null;
    if (this.marker) this.marker.visible = false;
    this.scene.pace?.change();
  }

  cone() {
    const colour = getComputedStyle(document.body).getPropertyValue("--operator").trim();
    const shape = new THREE.ConeGeometry(SIZE.radius, SIZE.height, 24).rotateX(-Math.PI / 2).translate(0, 0, SIZE.height / 2);
    const marker = new THREE.Mesh(shape, new THREE.MeshPhongMaterial({ color: colour }));
    marker.name = "place";
    marker.visible = false;
    this.scene.view.scene.add(marker);
    return marker;
  }
}
