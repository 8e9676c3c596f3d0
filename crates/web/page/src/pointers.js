// Pointers, fingers and files that are dropped.

/// Turns, slides and nears the view by what is done on the stage, and opens what is dropped on the page.
export function pointers(engine, stage, open) {
  /// Where each button or finger that is down was last.
  const down = new Map();
  stage.onpointerdown = (event) => {
    down.set(event.pointerId, [event.clientX, event.clientY]);
    stage.setPointerCapture(event.pointerId);
  };
  stage.onpointermove = (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const to = [event.clientX, event.clientY];
    down.set(event.pointerId, to);
    const height = stage.clientHeight || 1;
    const [x, y] = [(to[0] - from[0]) / height, (to[1] - from[1]) / height];
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    if (!other) return engine.call("drag", [event.shiftKey || event.buttons & 4 ? "pan" : "orbit", x, y]);
    // Two fingers slide by their middle, and go nearer as they part.
    const apart = (at) => Math.max(Math.hypot(at[0] - other[0], at[1] - other[1]), 1);
    engine.call("drag", ["pan", x / 2, y / 2]);
    engine.call("drag", ["zoom", 0, Math.log(apart(from) / apart(to)) / Math.log(0.9)]);
  };
  stage.onpointerup = stage.onpointercancel = (event) => down.delete(event.pointerId);
  stage.onwheel = (event) => {
    event.preventDefault();
    engine.call("drag", ["zoom", 0, -event.deltaY / 100]);
  };
  document.body.ondragover = (event) => {
    event.preventDefault();
    stage.classList.add("over");
  };
  document.body.ondragleave = () => stage.classList.remove("over");
  document.body.ondrop = (event) => {
    event.preventDefault();
    stage.classList.remove("over");
    if (event.dataTransfer.files[0]) open(event.dataTransfer.files[0]);
  };
}
