// How often web/pace.js lets the picture be drawn: while it changes all the time, and while nothing changes.
async ({ renderer, file }) => {
  const { Pace } = await import(file);
  let drawn = 0;
  // A camera that rests, as the controls compute it: not the same to the last bit.
  const matrix = () => ({ elements: [1 + 1e-12 * Math.random(), 0, 0], copy: () => 0, clone: matrix });
  const gl = { getExtension: () => ({ UNMASKED_RENDERER_WEBGL: 1 }), getParameter: () => renderer };
  const made = () => ({ render: () => { drawn += 1; }, getContext: () => gl });
  const camera = { get matrixWorld() { return matrix(); }, updateMatrixWorld: () => 0 };
  const view = { renderer: made(), text_renderer: made(), text3d_renderer: made(), camera };
  const pace = new Pace(view);
  const round = () => {
    for (const one of [view.renderer, view.text_renderer, view.text3d_renderer]) one.render(0, camera);
  };
  const turn = async (ms, changes) => {
    const begun = performance.now();
    while (performance.now() - begun < ms) {
      if (changes) pace.change();
      round();
      await new Promise((resolve) => setTimeout(resolve, 5));
    }
    return drawn / 3;
  };
  const moving = await turn(1000, true);
  let last = await turn(150, false);
  // A page that stood still has not drawn the last change yet.
  for (let k = 0; k < 100 && pace.changed; k += 1) last = await turn(20, false);
  return { moving, resting: (await turn(500, false)) - last };
}
