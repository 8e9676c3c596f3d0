// The page: what is chosen, and all scenes drawn by it.

const letters = document.getElementById("data").textContent, older = typeof DecompressionStream === "undefined";
if (older) document.getElementById("about").textContent = "This page's data is compressed, and this browser lacks DecompressionStream, which all have had since 2023. results.json and results.csv, which lightgraph bench writes too, hold the same figures and more.";
const data = older ? null : await unpacked(letters);
const all = data?.scenes.flatMap(s => s.entries) ?? [], look = looks(all), names = Object.keys(look);
const hidden = new Set();
const metrics = {
  rmse: ["rmse, % of the mean", e => e.rmse], block: ["structural: rmse of 8 × 8 means, %", e => e.block],
  fine: ["noise and fine detail, %", e => e.fine], flip: ["HDR-FLIP", e => e.flip],
};
const phases = {
  everything: "everything moves", lights: "the lights move", object: "one object moves", camera: "the camera moves",
  still: "nothing moves", first: "first frame",
};
const outputs = [...new Set(all.flatMap(e => Object.keys(e.errors)))].sort();
const timed = Object.entries(phases).filter(([p]) => all.some(e => e.times[p] ?? e.times.whole));
const state = { output: outputs.includes(data?.main) ? data.main : outputs[0], metric: "rmse", phase: timed[0]?.[0] ?? "first" };

const time = e => e.times[state.phase] ?? e.times.whole ?? null;
const errors = e => (e.own[state.phase] ?? e.errors)[state.output];
const leaky = scene => !scene.entries.some(e => errors(e)) && scene.entries.some(e => e.leak !== null);
const error = e => { const s = errors(e); return s ? metrics[state.metric][1](s) ?? null : null; };
const frontOf = scene => scene.fronts[leaky(scene) ? `leak|${state.phase}` : `${state.output}|${state.metric}|${state.phase}`] ?? [];
const title = e => `${e.graph}${e.peer ? " " + e.peer : ""}${e.setting ? ", " + e.setting : ""}`;

function describe(e) {
  const t = time(e), s = errors(e);
  const lines = [title(e)];
  if (t) lines.push(`${digits(t.ms)} ms wall (${digits(t.min)} to ${digits(t.max)} in ${t.repeats})${t.device === undefined ? "" : `, ${digits(t.device)} ms on the device`}`);
  if (s) lines.push(`rmse ${digits(s.rmse)} %, structural ${digits(s.block)} %, fine ${digits(s.fine)} %`, `bias ${s.bias >= 0 ? "+" : ""}${digits(s.bias)} %, FLIP ${digits(s.flip)}`);
  if (e.leak !== null) lines.push(`leak ${digits(e.leak)}`);
  if (e.mib !== null) lines.push(`${digits(e.mib)} MiB`);
  return [...lines, e.rest.join(", ")].join("\n");
}

function about(scene) {
  const noise = scene.noise[state.output];
  if (scene.origin) return `${scene.origin}${noise ? `, standard error ${digits(noise)} %` : ""}.`;
  return leaky(scene) ? "What is seen of a sealed dark room, relative to the lit one: it should be nothing." : "No reference: times alone.";
}

function draw() {
  const top = scrollY;
  hideTip();
  document.getElementById("scenes").replaceChildren(...data.scenes.map((scene, i) => {
    const best = new Set(frontOf(scene)), parts = [pictures, bars, groups, ran, numbers, bounded, faults];
    return el("section", { id: `scene-${i}` }, el("h2", {}, scene.label), el("p", {}, about(scene)), plot(scene), legend(scene), ...parts.map(part => part(scene, best)));
  }));
  scrollTo(0, top);
}

function choice(label, key, options) {
  const select = el("select", { onchange: v => { state[key] = v.target.value; draw(); } }, ...options.map(([v, text]) => el("option", { value: v }, text)));
  select.value = state[key];
  return el("label", {}, label, select);
}

function start() {
  const m = data.machine, place = document.getElementById("about");
  place.append(
    "Each point is a graph at one setting: time of a frame against error, both better when smaller. The dotted line joins what no other setting of a graph beats. Rest on a point, or on a name below the plot, to find its graph; click a name to hide it.");
  if (names.some(n => look[n].peer !== null)) place.append(" Squares are other renderers, all of whose work is one “frame”.");
  const notes = document.getElementById("notes");
  notes.append(
    el("p", {}, "Errors without noise are structural: 8 × 8 means keep them, and average a path tracer's noise away. Errors are those of the first frame; for graphs that keep something from frame to frame, of a frame at rest right after the motion, and with nothing moving after ", String(data.repeat + 1), " frames."),
    el("p", {}, `lightgraph ${data.version}${data.commit ? `, ${data.commit}` : ""}; ${m.adapter}, ${m.driver}${m.software ? " (a software driver: times say nothing about a GPU)" : ""}; ${m.cpu}, ${m.cores} cores; median of up to ${data.repeat} frames, ${data.size.join(" × ")} pixels.`),
    ...data.absent.map(a => el("p", { class: "note" }, `${a.name} is absent: ${a.why}`)));
  document.getElementById("jump").append(...data.scenes.map((s, i) => el("a", { href: `#scene-${i}` }, s.label)));
  document.getElementById("controls").append(
    choice("output", "output", outputs.map(o => [o, o])), choice("error", "metric", Object.entries(metrics).map(([k, v]) => [k, v[0]])),
    choice("time", "phase", timed));
  let narrow = innerWidth < 560;
  addEventListener("resize", () => { if (narrow !== innerWidth < 560) { narrow = !narrow; draw(); } });
  draw();
}
if (!older) start();
