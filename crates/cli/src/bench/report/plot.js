// The plot of a scene: error against time, a mark for each entry.

/// Read on white and on black alike. With the shapes, 28 graphs can be told apart.
const hues = ["#3a7fdc", "#d9620f", "#2f9a48", "#a45bd0", "#a98500", "#1698a6", "#d83f6c"];
const shapes = [
  r => `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`,
  r => `M0 ${-1.25 * r}L${1.15 * r} ${0.8 * r}H${-1.15 * r}Z`,
  r => `M0 ${-1.35 * r}L${1.35 * r} 0L0 ${1.35 * r}L${-1.35 * r} 0Z`,
  r => `M0 ${1.25 * r}L${1.15 * r} ${-0.8 * r}H${-1.15 * r}Z`,
];
/// Of other renderers.
const square = r => `M${-r} ${-r}H${r}V${r}H${-r}Z`;

/// Colour and shape of each graph; squares for other renderers, counted for themselves.
function looks(entries) {
  const found = {}, count = { own: 0, peer: 0 };
  for (const e of entries) {
    if (found[e.graph]) continue;
    const i = count[e.peer === null ? "own" : "peer"]++;
    const shape = e.peer === null ? shapes[Math.floor(i / hues.length) % shapes.length] : square;
    found[e.graph] = { color: hues[i % hues.length], shape, peer: e.peer };
  }
  return found;
}

function el(name, attributes = {}, ...children) {
  const svg = ["svg", "g", "line", "path", "text"].includes(name);
  const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
  for (const [k, v] of Object.entries(attributes)) {
    if (k.startsWith("on")) node.addEventListener(k.slice(2), v); else if (v !== null) node.setAttribute(k, v);
  }
  node.append(...children.filter(c => c !== null && c !== undefined));
  return node;
}

/// At most three digits, but all of a whole number.
function digits(x) {
  if (x === null || x === undefined) return "–";
  const size = Math.abs(x);
  if (x === 0) return "0";
  return size >= 100 ? x.toFixed(0) : size >= 10 ? x.toFixed(1) : size >= 0.1 ? x.toFixed(2) : x.toPrecision(2);
}

const tip = document.getElementById("tip");
function showTip(text, target) {
  const box = target.getBoundingClientRect();
  tip.textContent = text; tip.hidden = false;
  const [w, h] = [tip.offsetWidth, tip.offsetHeight];
  // Beside the mark; above it where there is no room below.
  const x = Math.min(box.right + 10, innerWidth - w - 6), y = box.bottom + 6 + h <= innerHeight ? box.bottom + 6 : box.top - 6 - h;
  tip.style.left = Math.max(6, x) + "px"; tip.style.top = Math.max(6, y) + "px";
}
const hideTip = () => { tip.hidden = true; };

/// Only this graph's marks in full, or all for null.
function spotlight(section, graph) {
  for (const mark of section.querySelectorAll("[data-graph]")) mark.classList.toggle("dim", graph !== null && mark.dataset.graph !== graph);
}

/// Places and numbers along a logarithmic axis: 1, 2 and 5 of each decade; more if they are few, less if they are many.
function ticks(low, high, most) {
  const of = steps => {
    const all = [];
    for (let d = Math.floor(low); d <= Math.ceil(high); d++) for (const m of steps) {
      const v = Math.log10(m) + d;
      if (v >= low - 1e-9 && v <= high + 1e-9) all.push([v, m * 10 ** d]);
    }
    return all;
  };
  const some = of([1, 2, 5]);
  const more = some.length < 4 ? of([1, 1.2, 1.5, 2, 3, 4, 5, 6, 7, 8]) : some;
  return [more, some, of([1, 3]), of([1])].find(t => t.length <= most) ?? [];
}
const short = x => String(+x.toPrecision(x >= 1 ? 3 : 2));

/// Names of graphs below the front: each once, where there is room beside the marks.
function labels(best, corners, marks, place, size) {
  const taken = marks.map(([x, y]) => [x - 6, y - 6, x + 6, y + 6]), out = [], named = new Set();
  best.forEach((e, i) => {
    if (named.has(e.graph)) return;
    const [x, y] = corners[i], w = e.graph.length * size * 0.56, top = y + 4;
    for (const [anchor, left, tx] of [["end", x - 9 - w, x - 9], ["start", x + 9, x + 9]]) {
      const box = [left, top, left + w, top + size + 2];
      const clash = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
      // The front's own lines: across from each corner, then down to the next.
      const lines = corners.flatMap(([cx, cy], j) => {
        const [nx, ny] = corners[j + 1] ?? [place.right, cy];
        return [[cx, cy - 1, nx, cy + 1], [nx - 1, cy, nx + 1, ny]];
      });
      const inside = box[0] > place.left + 2 && box[2] < place.right && box[3] < place.bottom - 2;
      if (!inside || [...taken, ...lines].some(b => clash(b, box))) continue;
      taken.push(box); named.add(e.graph);
      out.push(el("text", { class: "name", x: tx, y: top + size, "text-anchor": anchor, "data-graph": e.graph }, e.graph));
      return;
    }
  });
  return out;
}

function plot(scene) {
  const least = 1e-4;  // An error below this is drawn there: a logarithm has no 0.
  const leak = leaky(scene), height = e => leak ? e.leak : error(e);
  const points = scene.entries.map((e, i) => ({ e, i, t: time(e), y: height(e) })).filter(p => p.t && p.y !== null && !hidden.has(p.e.graph));
  if (!points.length) return el("p", {}, `Nothing to show: no entry has both a time for “${phases[state.phase]}” and this error of “${state.output}”.`);
  const narrow = innerWidth < 560, [w, h] = narrow ? [600, 560] : [1000, 430], size = narrow ? 19 : 12;
  const place = narrow ? { left: 76, right: 588, top: 12, bottom: 496 } : { left: 62, right: 986, top: 12, bottom: 382 };
  const log = (v, low) => Math.log10(Math.max(v, low));
  const xs = points.flatMap(p => [p.t.min, p.t.max]).map(x => log(x, 1e-3)), ys = points.map(p => log(p.y, least));
  const span = (v, pad) => { const lo = Math.min(...v), hi = Math.max(...v), p = Math.max((hi - lo) * pad, 0.12); return [lo - p, hi + p]; };
  const [x0, x1] = span(xs, 0.06), [y0, y1] = span(ys, 0.1);
  const px = v => place.left + (log(v, 1e-3) - x0) / (x1 - x0) * (place.right - place.left);
  const py = v => place.bottom - (log(v, least) - y0) / (y1 - y0) * (place.bottom - place.top);
  const svg = el("svg", { viewBox: `0 0 ${w} ${h}`, role: "img", "aria-label": `Error against time, ${scene.label}` });
  for (const [v, n] of ticks(x0, x1, narrow ? 7 : 14)) {
    const x = px(10 ** v);
    svg.append(el("line", { class: "grid", x1: x, x2: x, y1: place.top, y2: place.bottom }), el("text", { x, y: place.bottom + size + 6, "text-anchor": "middle" }, short(n)));
  }
  for (const [v, n] of ticks(y0, y1, 12)) {
    const y = py(10 ** v);
    svg.append(el("line", { class: "grid", x1: place.left, x2: place.right, y1: y, y2: y }), el("text", { x: place.left - 8, y: y + size / 3, "text-anchor": "end" }, short(n)));
  }
  const middle = (place.top + place.bottom) / 2;
  svg.append(
    el("text", { x: (place.left + place.right) / 2, y: h - 8, "text-anchor": "middle" }, `frame, ms wall: ${phases[state.phase]}`),
    el("text", { x: size, y: middle, "text-anchor": "middle", transform: `rotate(-90 ${size} ${middle})` }, leak ? "leak: dark relative to lit" : metrics[state.metric][0]));
  const noise = scene.noise[state.output];
  if (noise && state.metric === "rmse" && Math.log10(noise) > y0 && Math.log10(noise) < y1) {
    const y = py(noise);
    svg.append(el("line", { class: "floor", x1: place.left, x2: place.right, y1: y, y2: y }), el("text", { x: place.right - 4, y: y - 5, "text-anchor": "end" }, "noise of the reference"));
  }
  for (const name of names.filter(n => look[n].peer !== null)) {
    const line = points.filter(p => p.e.graph === name).sort((a, b) => a.t.ms - b.t.ms);
    if (line.length > 1) svg.append(el("path", { d: "M" + line.map(p => `${px(p.t.ms)} ${py(p.y)}`).join("L"), class: "curve", stroke: look[name].color, "data-graph": name }));
  }
  const front = frontOf(scene).filter(i => !hidden.has(scene.entries[i].graph)), best = front.map(i => scene.entries[i]);
  const corners = best.map(e => [px(time(e).ms), py(height(e))]);
  if (corners.length) svg.append(el("path", { class: "front", d: `M${corners[0]}` + corners.slice(1).map(c => `H${c[0]}V${c[1]}`).join("") + `H${place.right}` }));
  // Marks of the front lie over the others.
  for (const p of points.sort((a, b) => front.includes(a.i) - front.includes(b.i))) {
    const [x, y] = [px(p.t.ms), py(p.y)], { color, shape } = look[p.e.graph];
    if (px(p.t.max) - px(p.t.min) > 9) svg.append(el("line", { x1: px(p.t.min), x2: px(p.t.max), y1: y, y2: y, stroke: color, opacity: 0.45, "data-graph": p.e.graph }));
    const on = v => { showTip(describe(p.e), v.target); spotlight(svg, p.e.graph); }, off = () => { hideTip(); spotlight(svg, null); };
    svg.append(el("path", {
      d: shape(narrow ? 7 : 5.5), transform: `translate(${x} ${y})`, fill: color, class: "dot" + (front.includes(p.i) ? " best" : ""),
      onmouseenter: on, onmouseleave: off, onfocus: on, onblur: off, tabindex: 0, "data-graph": p.e.graph, "aria-label": describe(p.e),
    }));
  }
  svg.append(...labels(best, corners, points.map(p => [px(p.t.ms), py(p.y)]), place, size));
  return svg;
}

function legend(scene) {
  const swatch = n => el("svg", { class: "mark", viewBox: "-8 -8 16 16" }, el("path", { d: look[n].shape(5), fill: look[n].color }));
  const here = names.filter(n => scene.entries.some(e => e.graph === n));
  const light = (v, n) => spotlight(v.target.closest("section"), n);
  return el("div", { class: "legend" }, ...here.map(n => el("button", {
    "aria-pressed": String(!hidden.has(n)), title: "click to hide or show",
    onmouseenter: v => light(v, n), onmouseleave: v => light(v, null),
    onclick: () => { hidden.has(n) ? hidden.delete(n) : hidden.add(n); draw(); },
  }, swatch(n), look[n].peer === null ? n : `${n} ${look[n].peer}`)));
}
