// When the picture is drawn: only after a change, and no more often than the machine draws easily.
const FAST_HZ = 25;
const SLOW_HZ = 8; // drawn by the processor, which the cell needs too
const SEEN = 1e-6;
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

export class Pace {
  constructor(view) {
    this.view = view;
    this.drawn = 0;
    this.changed = true;
    this.due = 0;
    this.software = drawsInSoftware(view.renderer);
    this.period = 1000 / (this.software ? SLOW_HZ : FAST_HZ);
    // nicegui draws all the time: its renderers get a gate in front.
    this.gate(view.renderer, true);
    this.gate(view.text_renderer, false);
    this.gate(view.text3d_renderer, false);
    this.place = view.camera.matrixWorld.clone();
    new MutationObserver(() => this.change()).observe(document.body, { attributeFilter: ["class"] });
  }

  change() {
    this.changed = true;
  }

  // The first renderer of a round decides for all three.
  gate(renderer, decides) {
    const draw = renderer.render.bind(renderer);
    renderer.render = (scene, camera) => {
      if (decides) this.draws = this.isDue(camera);
      if (!this.draws) return;
      if (decides) this.drawn += 1;
      draw(scene, camera);
    };
  }

  isDue(camera) {
    camera.updateMatrixWorld();
    if (hasMoved(camera.matrixWorld.elements, this.place.elements)) this.changed = true;
    const now = performance.now();
    if (!this.changed || document.hidden || now < this.due) return false;
    this.place.copy(camera.matrixWorld);
    this.changed = false;
    // Deadlines: a round that comes a little late does not slow all that follow.
    this.due = Math.max(this.due + this.period, now + this.period / 2);
    return true;
  }
}

// The controls compute the camera's place anew each time: its last bits are never the same.
function hasMoved(elements, before) {
  return elements.some((value, k) => Math.abs(value - before[k]) > SEEN);
}

function drawsInSoftware(renderer) {
  const gl = renderer.getContext();
  const named = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  return SOFTWARE.test(String(name));
}
