"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const hues = ["#2f7ed8", "#d9480f", "#2b9348", "#9c36b5", "#c99700", "#0b9aa8", "#d6336c", "#7a5230", "#5c6bc0", "#7f8c2d", "#e07b91", "#546e7a", "#00695c", "#ff8f00", "#4527a0", "#9e9d24", "#ad1457", "#0277bd", "#5d4037"];
const names = [...new Set(data.scenes.flatMap(s => s.entries.map(e => e.graph)))];
const hue = Object.fromEntries(names.map((n, i) => [n, hues[i % hues.length]]));
const hidden = new Set();
const metrics = {
  rmse: ["rmse, % of the mean", e => e.rmse], block: ["structural: rmse of 8 × 8 means, %", e => e.block],
  fine: ["noise and fine detail, %", e => e.fine], hit: ["rmse where a surface is seen, %", e => e.hit],
  flip: ["HDR-FLIP", e => e.flip],
};
const phases = {
  everything: "everything moves", lights: "the lights move", object: "one object moves", camera: "the camera moves",
  still: "nothing moves", first: "first frame",
};
const outputs = [...new Set(data.scenes.flatMap(s => s.entries.flatMap(e => Object.keys(e.errors))))].sort();
const state = { output: outputs.includes(data.main) ? data.main : outputs[0], metric: "rmse", phase: "everything" };

function el(name, attributes = {}, ...children) {
  const svg = ["svg", "g", "line", "path", "circle", "text", "rect"].includes(name);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [k, v] of Object.entries(attributes)) {
    if (k.startsWith("on")) node.addEventListener(k.slice(2), v); else if (v !== null) node.setAttribute(k, v);
  }
  node.append(...children.filter(c => c !== null && c !== undefined));
  return node;
}
const digits = x => x === null || x === undefined ? "–" : x === 0 ? "0" : Math.abs(x) >= 100 ? x.toFixed(0) : Math.abs(x) >= 10 ? x.toFixed(1) : Math.abs(x) >= 0.1 ? x.toFixed(2) : x.toPrecision(2);
const time = e => e.times[state.phase] ?? e.times.whole ?? null;
const errors = e => (e.own[state.phase] ?? e.errors)[state.output];
const leaky = scene => !scene.entries.some(e => errors(e)) && scene.entries.some(e => e.leak !== null);
const error = e => { const s = errors(e); const v = s && metrics[state.metric][1](s); return v === undefined || v === null ? null : v; };
const frontOf = scene => scene.fronts[leaky(scene) ? `leak|${state.phase}` : `${state.output}|${state.metric}|${state.phase}`] ?? [];
const title = e => `${e.graph}${e.peer ? " " + e.peer : ""}${e.setting ? ", " + e.setting : ""}`;

function describe(e) {
  const t = time(e), s = errors(e);
  const lines = [title(e)];
  if (t) lines.push(`${digits(t[0])} ms wall (${digits(t[1])} to ${digits(t[2])} in ${t[4]})${t[3] === null ? "" : `, ${digits(t[3])} ms on the device`}`);
  if (s) lines.push(`rmse ${digits(s.rmse)} %, structural ${digits(s.block)} %, fine ${digits(s.fine)} %`, `bias ${s.bias >= 0 ? "+" : ""}${digits(s.bias)} %, FLIP ${digits(s.flip)}`);
  if (e.leak !== null) lines.push(`leak ${digits(e.leak)}`);
  if (e.bytes) lines.push(`${(e.bytes / 1048576).toFixed(1)} MiB`);
  for (const [k, v] of Object.entries(e.params)) if (!e.setting.includes(k + "=")) lines.push(`${k} = ${v}`);
  return lines.join("\n");
}
const tip = document.getElementById("tip");
function showTip(text, target) {
  const box = target.getBoundingClientRect();
  tip.textContent = text; tip.hidden = false;
  const x = Math.min(box.right + 10, innerWidth - tip.offsetWidth - 6), y = Math.min(box.bottom + 6, innerHeight - tip.offsetHeight - 6);
  tip.style.left = Math.max(6, x) + "px"; tip.style.top = Math.max(6, y) + "px";
}
const hideTip = () => { tip.hidden = true; };

function ticks(low, high) {
  const all = [];
  for (let d = Math.floor(low); d <= Math.ceil(high); d++) for (const m of [1, 2, 5]) {
    const v = Math.log10(m) + d;
    if (v >= low - 1e-9 && v <= high + 1e-9) all.push([v, m * 10 ** d, m]);
  }
  if (all.length < 4) for (let d = Math.floor(low); d <= Math.ceil(high); d++) for (const m of [1.2, 1.5, 3, 4, 6, 7, 8]) {
    const v = Math.log10(m) + d;
    if (v >= low && v <= high) all.push([v, m * 10 ** d, m]);
  }
  return high - low > 3.2 ? all.filter(t => t[2] === 1) : all;
}
const short = x => String(+x.toPrecision(x >= 1 ? 3 : 2));

function plot(scene) {
  const least = 1e-4;  // An error below this is drawn there: a logarithm has no 0.
  const leak = leaky(scene), height = e => leak ? e.leak : error(e);
  const points = scene.entries.map((e, i) => ({ e, i, t: time(e), y: height(e) })).filter(p => p.t && p.y !== null && !hidden.has(p.e.graph));
  if (!points.length) return el("p", {}, `Nothing to show: no entry has both a time for “${phases[state.phase]}” and this error of “${state.output}”.`);
  const narrow = innerWidth < 560, [w, h] = narrow ? [600, 520] : [1000, 430], [l, r, t, b] = [62, 14, 12, 48];
  const xs = points.flatMap(p => [p.t[1], p.t[2]]).map(x => Math.log10(Math.max(x, 1e-3))), ys = points.map(p => Math.log10(Math.max(p.y, least)));
  const span = (v, pad) => { const lo = Math.min(...v), hi = Math.max(...v), p = Math.max((hi - lo) * pad, 0.12); return [lo - p, hi + p]; };
  const [x0, x1] = span(xs, 0.06), [y0, y1] = span(ys, 0.1);
  const px = v => l + (Math.log10(Math.max(v, 1e-3)) - x0) / (x1 - x0) * (w - l - r), py = v => h - b - (Math.log10(Math.max(v, least)) - y0) / (y1 - y0) * (h - t - b);
  const svg = el("svg", { viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": `Error against time, ${scene.label}` });
  for (const [v, n] of ticks(x0, x1)) svg.append(el("line", { class: "grid", x1: px(10 ** v), x2: px(10 ** v), y1: t, y2: h - b }), el("text", { x: px(10 ** v), y: h - b + 18, "text-anchor": "middle" }, short(n)));
  for (const [v, n] of ticks(y0, y1)) svg.append(el("line", { class: "grid", x1: l, x2: w - r, y1: py(10 ** v), y2: py(10 ** v) }), el("text", { x: l - 8, y: py(10 ** v) + 4, "text-anchor": "end" }, short(n)));
  svg.append(el("text", { x: (l + w - r) / 2, y: h - 8, "text-anchor": "middle" }, `frame, ms wall: ${phases[state.phase]}`));
  svg.append(el("text", { x: 14, y: (t + h - b) / 2, "text-anchor": "middle", transform: `rotate(-90 14 ${(t + h - b) / 2})` }, leak ? "leak: dark relative to lit" : narrow ? state.metric : metrics[state.metric][0]));
  const noise = scene.noise[state.output];
  if (noise && state.metric === "rmse" && Math.log10(noise) > y0 && Math.log10(noise) < y1) svg.append(el("line", { class: "floor", x1: l, x2: w - r, y1: py(noise), y2: py(noise) }), el("text", { x: w - r - 4, y: py(noise) - 5, "text-anchor": "end" }, "noise of the reference"));
  for (const name of names) {
    const line = points.filter(p => p.e.peer && p.e.graph === name).sort((a, b) => a.t[0] - b.t[0]);
    if (line.length > 1) svg.append(el("path", { d: "M" + line.map(p => `${px(p.t[0])} ${py(p.y)}`).join("L"), fill: "none", stroke: hue[name], "stroke-width": 1.5, opacity: 0.6 }));
  }
  const best = frontOf(scene).filter(i => !hidden.has(scene.entries[i].graph));
  const corner = best.map(i => [px(time(scene.entries[i])[0]), py(height(scene.entries[i]))]);
  if (corner.length) svg.append(el("path", { class: "front", d: `M${corner[0]}` + corner.slice(1).map(c => `H${c[0]}V${c[1]}`).join("") + `H${w - r}` }));
  for (const p of points) {
    const [x, y] = [px(p.t[0]), py(p.y)];
    if (px(p.t[2]) - px(p.t[1]) > 9) svg.append(el("line", { x1: px(p.t[1]), x2: px(p.t[2]), y1: y, y2: y, stroke: hue[p.e.graph], opacity: 0.45 }));
    const on = { onmouseenter: v => showTip(describe(p.e), v.target), onmouseleave: hideTip, onfocus: v => showTip(describe(p.e), v.target), onblur: hideTip, tabindex: 0, class: "dot" + (best.includes(p.i) ? " best" : ""), "aria-label": describe(p.e) };
    svg.append(p.e.peer ? el("rect", { ...on, x: x - 5, y: y - 5, width: 10, height: 10, fill: hue[p.e.graph] }) : el("circle", { ...on, cx: x, cy: y, r: narrow ? 8 : 6, fill: hue[p.e.graph] }));
  }
  return svg;
}

function legend(scene) {
  const own = names.filter(n => scene.entries.some(e => e.graph === n));
  return el("div", { class: "legend" }, ...own.map(n => el("button", { "aria-pressed": String(!hidden.has(n)), onclick: () => { hidden.has(n) ? hidden.delete(n) : hidden.add(n); draw(); } }, el("span", { class: "swatch", style: `background:${hue[n]}` }), n)));
}

function table(columns, rows, best, start) {
  const body = el("tbody"), head = el("tr");
  let by = start ?? columns.length - 1, up = true;
  const fill = () => {
    const key = r => { const v = r.cells[by]; return v === null || v === undefined ? Infinity : v; };
    const order = [...rows].sort((a, b) => { const [x, y] = [key(a), key(b)]; const c = typeof x === "string" ? String(x).localeCompare(String(y), "en", { numeric: true }) : x - y; return (up ? 1 : -1) * (c || 0); });
    body.replaceChildren(...order.map(r => el("tr", { class: best.has(r.index) ? "best" : null }, ...r.cells.map((c, i) => el("td", { class: typeof c === "string" ? "text" : null }, typeof c === "string" ? c : (r.near?.has(i) ? "≈ " : "") + digits(c))))));
    [...head.children].forEach((th, i) => th.setAttribute("aria-sort", i !== by ? "none" : up ? "ascending" : "descending"));
  };
  columns.forEach((c, i) => head.append(el("th", { class: typeof rows[0]?.cells[i] === "string" ? "text" : null }, el("button", { onclick: () => { up = by === i ? !up : true; by = i; fill(); } }, c))));
  fill();
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, head), body));
}

function bars(scene) {
  const seen = new Map();
  for (const e of scene.entries) if (e.passes[state.phase]?.length && !hidden.has(e.graph) && (!seen.has(e.graph) || (error(e) ?? Infinity) < (error(seen.get(e.graph)) ?? Infinity))) seen.set(e.graph, e);
  if (!seen.size) return null;
  const most = Math.max(...[...seen.values()].map(e => time(e)[0]));
  const passes = [...new Set([...seen.values()].flatMap(e => e.passes[state.phase].map(p => p[1] ?? p[0])))];
  const color = Object.fromEntries(passes.map((p, i) => [p, `hsl(${(i * 137.5 + 20) % 360} 55% 55%)`]));
  const rows = [...seen.values()].flatMap(e => {
    const wall = time(e)[0], sums = {};
    for (const [name, group, ms] of e.passes[state.phase]) sums[group ?? name] = (sums[group ?? name] ?? 0) + (ms ?? 0);
    const parts = Object.entries(sums).filter(([, ms]) => ms / most > 0.002);
    const bar = el("div", { class: "bar", style: `width:${100 * wall / most}%;background:var(--line)` }, ...parts.map(([n, ms]) => el("span", { title: `${n}: ${digits(ms)} ms`, style: `width:${Math.min(100, 100 * ms / wall)}%;background:${color[n]}` })));
    return [el("span", { class: "name" }, title(e)), bar, el("span", {}, `${digits(wall)} ms`)];
  });
  return el("details", { open: "" }, el("summary", {}, `Where the time goes: ${phases[state.phase]}`), el("p", {}, "Each graph at its most accurate setting. Coloured: device time of passes, summed by group; grey: the rest of the wall time, and work that a driver does after its timestamps, as software drivers do with compute passes."), el("div", { class: "bars" }, ...rows), el("div", { class: "legend" }, ...passes.map(p => el("span", {}, el("span", { class: "swatch", style: `background:${color[p]}` }), " " + p))));
}

function groups(scene) {
  const phase = state.phase, of = e => e.passes[phase] ?? [];
  const heads = [...new Set(scene.entries.flatMap(e => of(e).map(p => p[1]).filter(Boolean)))];
  const published = data.published.filter(p => p.scene === scene.name && p.phase === phase);
  if (!heads.length) return null;
  const rows = scene.entries.map((e, index) => ({ e, index })).filter(({ e }) => of(e).some(p => p[1]) && time(e)).map(({ e, index }) => {
    const sum = g => of(e).filter(p => p[1] === g).reduce((s, p) => s + (p[2] ?? 0), 0);
    const parts = heads.map(sum), wall = time(e)[0];
    return { index, cells: [title(e), ...parts, Math.max(0, wall - parts.reduce((a, b) => a + b, 0)), wall] };
  });
  for (const p of published) rows.push({ index: -1, cells: [`${p.source} (published, other hardware)`, ...heads.map(h => p.group === h ? p.ms : null), null, p.group ? null : p.ms] });
  return el("details", {}, el("summary", {}, `Steps as a table: ${phases[phase]}, ms`), table(["setting", ...heads, "overhead", "total"], rows, new Set()));
}

function ran(scene) {
  // A frame in which everything moves leaves nothing out but what no output needs; failing that, the first frame.
  const whole = e => e.times.everything ?? e.times.first ?? null;
  const rows = scene.entries.map((e, index) => ({ e, index })).filter(({ e }) => !e.peer && e.steps[state.phase] && time(e)).map(({ e, index }) => {
    const [run, skipped, causes] = e.steps[state.phase], ms = time(e)[0], full = whole(e)?.[0] ?? null;
    return { index, cells: [title(e), run, skipped, causes.join(", "), ms, full, full ? 100 * (1 - ms / full) : null] };
  });
  return rows.length ? el("details", {}, el("summary", {}, `What ran, and what was left out: ${phases[state.phase]}`), el("p", {}, "Steps of the last such frame, what set them off, and how much of a frame in which everything moves it saved."), table(["setting", "steps run", "left out", "set off by", "wall ms", "in full, ms", "saved %"], rows, new Set())) : null;
}

function pictures(scene) {
  if (!scene.pictures.length) return null;
  const shot = p => el("figure", {}, el("img", { src: p.color, alt: p.label, loading: "lazy" }), p.difference ? el("img", { src: p.difference, alt: `difference of ${p.label}`, loading: "lazy" }) : null, p.label);
  return el("details", { open: "" }, el("summary", {}, "Images"), el("p", {}, "Each at its most accurate setting; below it the difference from the reference: red is too bright, blue too dark, full colour at half the reference's mean."), el("div", { class: "pictures" }, ...scene.pictures.map(shot)));
}

function numbers(scene, best) {
  const rows = scene.entries.map((e, index) => {
    const t = time(e), s = errors(e) ?? {}, noise = scene.noise[state.output] ?? 0;
    // Means of 8 × 8 pixels have an eighth of a pixel's noise.
    const near = new Set([[4, s.rmse, noise], [5, s.block, noise / 8]].filter(([, value, noise]) => value < 10 * noise).map(([column]) => column));
    return { index, near, cells: [e.graph, e.setting, t ? t[0] : null, t ? t[3] : null, s.rmse ?? null, s.block ?? null, s.fine ?? null, s.bias ?? null, s.hit ?? null, s.relmse ?? null, s.p95 ?? null, s.max ?? null, s.flip ?? null, e.change[state.phase] ?? null, e.leak, e.bytes ? e.bytes / 1048576 : null] };
  });
  const columns = ["graph", "setting", "wall ms", "device ms", "rmse %", "structural %", "fine %", "bias %", "surfaces %", "relMSE", "95th", "max", "FLIP", "change %", "leak", "MiB"];
  return el("details", {}, el("summary", {}, `All ${rows.length} entries`), el("p", {}, `Errors of “${state.output}”; bold: on the front; ≈: less than ten times the reference's own standard error (an eighth of it in structural error), which is part of it. “change” is how much color changed in the first frame that moved.`), table(columns, rows, best, 4));
}

function bounded(scene) {
  const rows = scene.entries.flatMap((e, index) => e.bounded.map(s => ({ index, cells: [e.graph, e.setting, `${s.output}, ${s.when}`, s.rmse, s.block, s.bias] })));
  return rows.length ? el("details", {}, el("summary", {}, "Against references of the same parameters"), table(["graph", "setting", "reference", "rmse %", "structural %", "bias %"], rows, new Set(), 3)) : null;
}

function draw() {
  const open = [...document.querySelectorAll("details")].map(d => d.open), top = scrollY;
  hideTip();
  document.getElementById("scenes").replaceChildren(...data.scenes.map(scene => {
    const best = new Set(frontOf(scene));
    const noise = scene.noise[state.output], faults = scene.entries.filter(e => e.fault);
    return el("section", {}, el("h2", {}, scene.label), el("p", {}, `${scene.origin ? `Reference: ${scene.origin}${noise ? `, standard error ${digits(noise)} %` : ""}.` : leaky(scene) ? "What is seen of a sealed dark room, relative to the lit one: it should be nothing." : "No reference: times alone."}`), plot(scene), legend(scene), pictures(scene), bars(scene), groups(scene), ran(scene), numbers(scene, best), bounded(scene), ...faults.map(e => el("p", { class: "note" }, `${title(e)}: ${e.fault}`)));
  }));
  const now = [...document.querySelectorAll("details")];
  if (now.length === open.length) now.forEach((d, i) => { d.open = open[i]; });
  scrollTo(0, top);
}

function choice(label, key, options) {
  const select = el("select", { onchange: v => { state[key] = v.target.value; draw(); } }, ...options.map(([v, text]) => el("option", { value: v }, text)));
  select.value = state[key];
  return el("label", {}, label, select);
}
const m = data.machine;
document.getElementById("about").append(`Each point is a graph at one setting: time of a frame against error, both better when smaller. The dotted line joins what no other setting of a graph beats; squares are other renderers, all of whose work is one “frame”. Errors without noise are structural: 8 × 8 means keep them, and average a path tracer's noise away. Errors are those of the first frame; for graphs that keep something from frame to frame, of a frame at rest right after the motion, and with nothing moving after ${data.repeat + 1} frames. lightgraph ${data.version}${data.commit ? `, ${data.commit}` : ""}; ${m.adapter}, ${m.driver}${m.software ? " (a software driver: times say nothing about a GPU)" : ""}; ${m.cpu}, ${m.cores} cores; median of up to ${data.repeat} frames, ${data.size.join(" × ")} pixels.`);
for (const a of data.absent) document.getElementById("about").append(el("br"), el("span", { class: "note" }, `${a.name} is absent: ${a.why}`));
document.getElementById("controls").append(choice("output", "output", outputs.map(o => [o, o])), choice("error", "metric", Object.entries(metrics).map(([k, v]) => [k, v[0]])), choice("time", "phase", Object.entries(phases)));
let width = innerWidth;
addEventListener("resize", () => { if ((width < 560) !== (innerWidth < 560)) draw(); width = innerWidth; });
draw();
