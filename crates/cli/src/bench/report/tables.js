// What stands below a plot: bars of where the time goes, tables, pictures. A part is made when it is first opened.

/// Parts that are open, by scene and kind, so that they stay so when the page is drawn anew.
const opened = {};
function part(scene, kind, summary, make, open = false) {
  const key = `${scene.label}|${kind}`, node = el("details", {}, el("summary", {}, summary));
  let made = false;
  const fill = () => { if (node.open && !made) { made = true; node.append(...make()); } };
  node.open = opened[key] ?? open;
  fill();
  node.addEventListener("toggle", () => { opened[key] = node.open; fill(); });
  return node;
}

/// Columns sort by a click, first upwards; what has no value comes last either way. `counts`: columns of whole numbers.
function table(columns, rows, best, start, counts = []) {
  const body = el("tbody"), head = el("tr");
  let by = start ?? columns.length - 1, up = true;
  const none = v => v === null || v === undefined, text = columns.map((_, i) => rows.some(r => typeof r.cells[i] === "string"));
  const fill = () => {
    const order = [...rows].sort((a, b) => {
      const [x, y] = [a.cells[by], b.cells[by]];
      if (none(x) || none(y)) return none(x) - none(y);
      return (up ? 1 : -1) * (text[by] ? x.localeCompare(y, "en", { numeric: true }) : x - y);
    });
    const cell = (r, c, i) => text[i] ? el("td", { class: "text" }, c ?? "–") : el("td", {}, (r.near?.has(i) ? "≈ " : "") + (counts.includes(i) ? c : digits(c)));
    body.replaceChildren(...order.map(r => el("tr", { class: best.has(r.index) ? "best" : null }, ...r.cells.map((c, i) => cell(r, c, i)))));
    [...head.children].forEach((th, i) => th.setAttribute("aria-sort", i !== by ? "none" : up ? "ascending" : "descending"));
  };
  columns.forEach((c, i) => head.append(el("th", { class: text[i] ? "text" : null }, el("button", { onclick: () => { up = by === i ? !up : true; by = i; fill(); } }, c))));
  fill();
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, head), body));
}

/// Names and device times of an entry's passes: headings first, then passes without one.
function sums(e) {
  const { groups, others } = e.passes[state.phase] ?? {};
  return [groups, others].flatMap(s => (s?.names ?? []).map((name, i) => [name, s.ms?.[i] ?? 0]));
}

function bars(scene) {
  const seen = new Map(), worst = Infinity;
  for (const e of scene.entries) {
    if (!e.passes[state.phase] || !time(e) || hidden.has(e.graph)) continue;
    if (!seen.has(e.graph) || (error(e) ?? worst) < (error(seen.get(e.graph)) ?? worst)) seen.set(e.graph, e);
  }
  if (!seen.size) return null;
  return part(scene, "bars", `Where the time goes: ${phases[state.phase]}`, () => {
    const all = [...seen.values()].sort((a, b) => time(a).ms - time(b).ms).map(e => {
      const found = {};
      for (const [name, ms] of sums(e)) found[name] = (found[name] ?? 0) + ms;
      return { e, wall: time(e).ms, parts: Object.entries(found).filter(([, ms]) => ms > 0.005 * time(e).ms) };
    });
    const passes = [...new Set(all.flatMap(a => a.parts.map(([name]) => name)))];
    const color = Object.fromEntries(passes.map((p, i) => [p, `hsl(${(i * 137.5 + 20) % 360} 55% ${[52, 66, 40][i % 3]}%)`]));
    const rows = all.flatMap(({ e, wall, parts }) => {
      const spans = parts.map(([n, ms]) => el("span", { title: `${n}: ${digits(ms)} ms`, style: `width:${Math.min(100, 100 * ms / wall)}%;background:${color[n]}` }));
      return [el("span", { class: "name" }, title(e)), el("div", { class: "bar" }, ...spans), el("span", { class: "ms" }, `${digits(wall)} ms`)];
    });
    const swatch = p => el("span", {}, el("span", { class: "swatch", style: `background:${color[p]}` }), " " + p);
    return [
      el("p", {}, "Each graph at its most accurate setting; a bar is its whole frame. Coloured: device time of passes, summed by group; grey: the rest of the wall time, and work that a driver does after its timestamps, as software drivers do with compute passes."),
      el("div", { class: "bars" }, ...rows), el("div", { class: "legend" }, ...passes.map(swatch)),
    ];
  }, true);
}

function groups(scene) {
  const of = e => e.passes[state.phase]?.groups ?? null;
  const heads = [...new Set(scene.entries.flatMap(e => of(e)?.names ?? []))];
  if (!heads.length) return null;
  return part(scene, "groups", `Steps as a table: ${phases[state.phase]}, ms`, () => {
    const published = data.published.filter(p => p.scene === scene.name && p.phase === state.phase);
    const rows = scene.entries.map((e, index) => ({ e, index })).filter(({ e }) => of(e)?.names?.length && time(e)).map(({ e, index }) => {
      const { names, ms } = of(e), parts = heads.map(h => ms[names.indexOf(h)] ?? 0), wall = time(e).ms;
      return { index, cells: [title(e), ...parts, Math.max(0, wall - parts.reduce((a, b) => a + b, 0)), wall] };
    });
    for (const p of published) rows.push({ index: -1, cells: [`${p.source} (published, other hardware)`, ...heads.map(h => p.group === h ? p.ms : null), null, p.group ? null : p.ms] });
    return [table(["setting", ...heads, "overhead", "total"], rows, new Set())];
  });
}

function ran(scene) {
  // A frame in which everything moves leaves nothing out but what no output needs; failing that, the first frame.
  const whole = e => e.times.everything ?? e.times.first ?? null;
  const those = scene.entries.map((e, index) => ({ e, index })).filter(({ e }) => e.peer === null && e.steps[state.phase] && time(e));
  if (!those.length) return null;
  return part(scene, "ran", `What ran, and what was left out: ${phases[state.phase]}`, () => {
    const rows = those.map(({ e, index }) => {
      const { run, left, causes } = e.steps[state.phase], ms = time(e).ms, full = whole(e)?.ms ?? null;
      return { index, cells: [title(e), run, left, ms, full, full ? 100 * (1 - ms / full) : null, causes.join(", ")] };
    });
    const columns = ["setting", "steps run", "left out", "wall ms", "in full, ms", "saved %", "set off by"];
    return [el("p", {}, "Steps of the last such frame, what set them off, and how much of a frame in which everything moves it saved."), table(columns, rows, new Set(), 3, [1, 2])];
  });
}

function pictures(scene) {
  if (!scene.pictures.length) return null;
  const shot = p => el("figure", {}, el("img", { src: p.color, alt: p.label, loading: "lazy" }), p.difference ? el("img", { src: p.difference, alt: `difference of ${p.label}`, loading: "lazy" }) : null, p.label);
  return part(scene, "pictures", "Images", () => [
    el("p", {}, "Each at its most accurate setting; below it the difference from the reference: red is too bright, blue too dark, full colour at half the reference's mean."),
    el("div", { class: "pictures" }, ...scene.pictures.map(shot)),
  ], true);
}

function numbers(scene, best) {
  return part(scene, "numbers", `All ${scene.entries.length} entries`, () => {
    const rows = scene.entries.map((e, index) => {
      const t = time(e) ?? {}, s = errors(e) ?? {}, noise = scene.noise[state.output] ?? 0;
      // Means of 8 × 8 pixels have an eighth of a pixel's noise.
      const near = new Set([[4, s.rmse, noise], [5, s.block, noise / 8]].filter(([, value, noise]) => value < 10 * noise).map(([column]) => column));
      const name = e.graph + (e.peer === null ? "" : " " + e.peer);
      return { index, near, cells: [name, e.setting ?? "", t.ms, t.device, s.rmse, s.block, s.fine, s.bias, s.relmse, s.p95, s.max, s.flip, e.change[state.phase], e.leak, e.mib] };
    });
    const columns = ["graph", "setting", "wall ms", "device ms", "rmse %", "structural %", "fine %", "bias %", "relMSE", "95th", "max", "FLIP", "change %", "leak", "MiB"];
    const about = `Errors of “${state.output}”; bold: on the front; ≈: less than ten times the reference's own standard error (an eighth of it in structural error), which is part of it. “change” is how much color changed in the first frame that moved. A column's name sorts by it.`;
    return [el("p", {}, about), table(columns, rows, best, 4)];
  });
}

function bounded(scene) {
  const rows = scene.entries.flatMap((e, index) => Object.entries(e.bounded).map(([what, s]) => ({ index, cells: [e.graph, e.setting ?? "", what, s.rmse, s.block, s.bias] })));
  return rows.length ? part(scene, "bounded", "Against references of the same parameters", () => [table(["graph", "setting", "reference", "rmse %", "structural %", "bias %"], rows, new Set(), 3)]) : null;
}

/// What has no numbers, each by name.
function faults(scene) {
  const those = scene.entries.filter(e => e.fault !== null);
  if (!those.length) return null;
  return part(scene, "faults", `${those.length} without numbers`, () => [el("ul", { class: "note" }, ...those.map(e => el("li", {}, `${title(e)}: ${e.fault}`)))], those.length < 4);
}
