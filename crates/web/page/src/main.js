// The playground: what is chosen, edited and shared, and what the engine says of it.
import { EngineLink } from "./caller.js";
import * as compare from "./compare.js";
import { show as showParams } from "./params.js";
import { pointers } from "./pointers.js";
import { isText, packed, unpacked } from "./project.js";
import { Resources } from "./resource.js";
import * as times from "./times.js";
import { options, row } from "./widgets.js";

const byId = (id) => document.getElementById(id);
/// Bytes of a dropped file at most.
const MOST_DROPPED = 256 << 20;
/// A pause while typing, after which the graph is made again.
const PAUSE_MS = 120;

const viewer = document.body.classList.contains("viewer");
const state = {
  graph: "graphs/gi/direct.ron", scene: "scenes/cornell.glb", params: {}, output: null, size: null, place: [], exposure: 0,
  /// {graph: PATH}, {image: PATH} or null.
  against: null,
  /// Which alternatives of a graph run: those that measure fastest here, or the first, the same everywhere.
  fastest: "measure",
};
/// Texts by path that differ from what the page comes with; and those that were shown last without a fault.
let edits = new Map();
let good = new Map();
let scenes = {};
const fetched = new Set();
/// Bytes by path of scenes and references that were opened here.
const own = new Map();
let files = [];
let device = { software: false };
let faults = [];
let wishing = false;
let again = false;
let timer;

const engine = new EngineLink(byId("stage"), listen);
const resources = new Resources(engine);
const arrange = compare.controls(state, {
  wish: () => (choices(), wish()),
  arrange: (kind, at) => engine.call("set_arrangement", [kind, at]).catch(() => {}),
});

/// The editor is most of the page's script, and is read while the first image is made.
let editor;
let reading;

/// Reads the editor, once; says so where it can't be read.
function readEditor() {
  const made = ({ Editor }) => {
    editor = new Editor(byId("editor"), edited);
    editor.setFaults(faults);
  };
  const failed = (error) => {
    reading = undefined;
    say(`The editor can't be read: ${error.message}`);
  };
  return (reading ??= import("./editor.js").then(made).catch(failed));
}

function edited(path, text) {
  edits.set(path, text);
  tabs();
  clearTimeout(timer);
  timer = setTimeout(async () => {
    await engine.call("hold", [path, new TextEncoder().encode(text)]);
    wish();
  }, PAUSE_MS);
}

function say(text) {
  byId("said").textContent = text;
}

function none(why) {
  byId("none").hidden = false;
  byId("why").textContent = why;
  document.body.dataset.state = "none";
}

async function begin() {
  if (!navigator.gpu) return none("navigator.gpu is missing.");
  const opening = engine.open();
  opening.catch(() => {});
  scenes = await (await fetch("scenes.json")).json();
  if (viewer) Object.assign(state, (await (await fetch("project.json")).json()));
  try {
    await open(opening);
  } catch (error) {
    return none(error.message);
  }
  await follow();
  choices();
  const wished = wish();
  if (!viewer) readEditor();
  await wished;
  if ("serviceWorker" in navigator) navigator.serviceWorker.register("offline.js").catch(() => {});
}

async function open(opening = engine.open()) {
  const opened = await opening;
  device = opened.device;
  files = opened.files;
  await times.restore(engine, opened.times);
  fetched.clear();
  for (const [path, bytes] of own) {
    await hold(path, bytes);
    fetched.add(path);
  }
  if (viewer) for (const path of state.files ?? []) await hold(path, await bytesOf(path));
  state.size ??= device.software ? [256, 256] : [640, 480];
}

async function bytesOf(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return new Uint8Array(await answer.arrayBuffer());
}

async function hold(path, bytes) {
  if (!files.includes(path)) files.push(path);
  await engine.call("hold", [path, bytes]);
}

/// Opens what a shared link holds.
async function follow() {
  const link = /^#s=(.+)$/.exec(location.hash);
  if (!link) return;
  try {
    const shared = JSON.parse(await engine.call("decode_link", [link[1]]));
    Object.assign(state, { graph: shared.graph, scene: shared.scene, params: shared.params ?? {}, exposure: shared.exposure });
    state.place = (shared.place ?? []).flat();
    await revert();
    for (const [path, text] of Object.entries(shared.files ?? {})) {
      edits.set(path, text);
      await hold(path, new TextEncoder().encode(text));
    }
    exposed();
  } catch (error) {
    say(`The link can't be followed: ${error.message}`);
  }
}

async function share() {
  const place = await engine.call("place");
  const v = [...place];
  const shared = { graph: state.graph, scene: state.scene, params: state.params, exposure: state.exposure, files: Object.fromEntries(edits) };
  if (v.length === 9) shared.place = [v.slice(0, 3), v.slice(3, 6), v.slice(6, 9)];
  try {
    history.replaceState(null, "", `#s=${await engine.call("encode_link", [JSON.stringify(shared)])}`);
    await navigator.clipboard?.writeText(location.href).catch(() => {});
    say(state.scene in scenes ? "The link stands in the address bar." : "The link stands in the address bar. Your scene is not in it.");
  } catch (error) {
    say(error.message);
  }
}

function choices() {
  const graphs = files.filter((f) => f.startsWith("graphs/") && f.endsWith(".ron"));
  options(byId("graph"), graphs, state.graph, (path) => path.replace(/^graphs\/|\.ron$/g, ""));
  const opened = [...own.keys()].filter((f) => f.startsWith("scenes/") && (f === state.scene || f.endsWith(".glb")) && !(f in scenes));
  options(byId("scene"), [...Object.keys(scenes), ...opened], state.scene, (path) => path.replace(/^scenes\/|\.(glb|gltf|ron)$/g, ""));
  const sizes = [[128, 128], [256, 256], [320, 240], [480, 360], [640, 480], [800, 600], [1024, 768], [1280, 960]];
  if (!sizes.some((s) => s.join() === state.size.join())) sizes.push(state.size);
  options(byId("size"), sizes.map((s) => s.join("×")), state.size.join("×"));
  compare.list(state, graphs, [...own.keys()].filter((f) => f.startsWith("references/")));
}

/// Makes what is chosen; of wishes that come while one is under way, the last.
async function wish() {
  if (wishing) return (again = true);
  wishing = true;
  document.body.dataset.state = "making";
  try {
    for (const path of scenes[state.scene] ?? []) {
      if (fetched.has(path)) continue;
      await hold(path, await bytesOf(path));
      fetched.add(path);
    }
    const { graph, scene, camera = null, params, output, size, against, fastest } = state;
    const [timed, inspect] = [byId("times-open").open, resources.open];
    const told = JSON.parse(await engine.call("wish", [JSON.stringify({ graph, scene, camera, params, output, size, timed, inspect, against, fastest })]));
    if (told.faults) {
      setFaults(told.faults);
      document.body.dataset.state = "fault";
    } else {
      setFaults(told.notices);
      made(told);
    }
  } catch (error) {
    setFaults([{ severity: "error", message: error.message, help: [], places: [] }]);
    document.body.dataset.state = "fault";
  }
  wishing = false;
  if (again) {
    again = false;
    await wish();
  }
}

async function made(told) {
  byId("about").textContent = told.about;
  options(byId("output"), told.outputs, told.output);
  showParams(byId("params"), told.params, (name, value) => {
    state.params[name] = value;
    wish();
  });
  state.sources = [...new Set([...told.files, ...told.shaders])];
  state.made_ms = told.make_ms;
  resources.list(told.resources);
  arrange();
  if (!state.against) compare.showScore(null);
  if (!viewer && (!editor?.path || !state.sources.includes(editor.path))) await openFile(state.graph);
  tabs();
}

async function openFile(path) {
  await readEditor();
  if (!editor) return;
  if (!editor.has(path)) {
    const text = edits.get(path) ?? (await engine.call("text", [path]));
    if (text === undefined) return say(`${path} is not there`);
    editor.show(path, text);
  } else editor.show(path);
  tabs();
}

function tabs() {
  const nav = byId("tabs");
  const faulty = new Set(faults.filter((f) => f.severity === "error").flatMap((f) => f.places.slice(0, 1).map((p) => p.path)));
  const shown = [...new Set([...(state.sources ?? []), ...edits.keys(), ...(editor?.path ? [editor.path] : [])])];
  const buttons = shown.slice(0, 24).map((path) => {
    const button = document.createElement("button");
    button.textContent = path.replace(/^(graphs|shaders)\//, "");
    button.title = path;
    button.role = "tab";
    button.ariaSelected = String(path === editor?.path);
    button.classList.toggle("edited", edits.has(path));
    button.classList.toggle("faulty", faulty.has(path));
    button.onclick = () => openFile(path);
    return button;
  });
  const more = document.createElement("select");
  more.ariaLabel = "Open a file";
  const texts = files.filter((f) => /\.(ron|wgsl)$/.test(f));
  options(more, ["", ...texts], "", (path) => path || "open…");
  more.onchange = () => more.value && openFile(more.value);
  nav.replaceChildren(...buttons, more);
}

function setFaults(list) {
  faults = list;
  editor?.setFaults(list);
  byId("faults").replaceChildren(
    ...list.map((fault) => {
      const box = document.createElement("div");
      box.className = fault.severity;
      const place = fault.places[0];
      box.textContent = (place ? `${place.path}: ` : "") + fault.message;
      for (const help of fault.help) {
        const line = document.createElement("div");
        line.className = "help";
        line.textContent = `help: ${help}`;
        box.append(line);
      }
      if (place && !viewer && files.includes(place.path)) {
        box.tabIndex = 0;
        const go = () => openFile(place.path).then(() => editor?.go(place.from));
        box.onclick = go;
        box.onkeydown = (event) => event.key === "Enter" && go();
      }
      return box;
    }),
  );
  tabs();
}

let frames = 0;
let host = [];

async function listen(data) {
  if (data.dead !== undefined) return restart(data.dead);
  if (data.image) return images.splice(0).forEach((take) => take(data.image));
  const { told } = data;
  if (told.swapped) {
    good = new Map(edits);
    frames = 0;
    Object.assign(document.body.dataset, { state: "shown", rest: "false" });
    if (state.place?.length) engine.call("set_place", [new Float32Array(state.place)]);
    state.place = [];
    engine.call("set_exposure", [state.exposure]);
    if (byId("plan-open").open) showPlan();
  }
  if (told.faults) {
    setFaults(told.faults);
    document.body.dataset.state = "fault";
    if (told.lost) restart(told.faults[0].message);
  }
  if (told.host_ms !== undefined) {
    frames += 1;
    host = [...host.slice(-15), told.host_ms];
    document.body.dataset.frames = frames;
    document.body.dataset.hostMs = host.toSorted((a, b) => a - b)[host.length >> 1].toFixed(3);
  }
  if (told.report) report(told.report);
  if (told.times) times.keep(engine, told.times);
  if (told.made) {
    setFaults(told.made.notices);
    made(told.made);
  }
  if (told.noticed?.length) setFaults([...faults, ...told.noticed]);
  if (told.times && byId("plan-open").open) showPlan();
  if (told.score) compare.showScore(told.score);
  if (told.inspected) resources.show(told.inspected, data.plane);
}

function report(report) {
  const ran = report.steps.length;
  const ms = report.device_ms ?? report.wall_ms;
  const device_ms = report.device_ms === null ? "from call to end" : "on the device";
  byId("line").textContent = ran === 0 ? `at rest; frame ${frames}, host ${document.body.dataset.hostMs} ms` : `frame ${frames}: ${ms.toFixed(1)} ms ${device_ms}, ${ran} steps, host ${document.body.dataset.hostMs} ms`;
  document.body.dataset.rest = String(ran === 0);
  if (byId("times-open").open && ran) {
    const rows = report.steps.slice().sort((a, b) => (b.gpu_ms ?? b.cpu_ms) - (a.gpu_ms ?? a.cpu_ms));
    byId("times").replaceChildren(
      ...rows.map((step) => {
        const time = step.gpu_ms === null ? "—" : `${step.gpu_ms.toFixed(3)} ms`;
        return row([step.name, `${step.runs} ×`, time]);
      }),
    );
  }
  if (report.checks.length) setFaults(report.checks);
}

async function showPlan() {
  byId("plan").textContent = await engine.call("plan");
}

let restarts = 0;

/// Begins anew with the files that were shown last; what was edited since stays in the editor.
async function restart(why) {
  restarts += 1;
  setFaults([{ severity: "error", message: `The engine stopped: ${why}`, help: ["it has begun anew with the last files that worked; your edits stand in the editor and are tried again when you type"], places: [] }]);
  if (restarts > 5) return none(`The engine stopped ${restarts} times: ${why}`);
  const kept = faults;
  // What stopped it may be an alternative.
  state.fastest = "first";
  await open();
  for (const [path, text] of good) await hold(path, new TextEncoder().encode(text));
  await wish();
  setFaults([...kept, ...faults]);
}

async function revert() {
  for (const path of edits.keys()) await engine.call("release", [path]);
  edits.clear();
  editor?.clear();
}

const images = [];
/// For tests: the image that is shown, in linear light: width, height, channels, numbers.
window.lightgraph = {
  image: () => new Promise((take) => (images.push(take), engine.call("want_image", [false]))),
  /// Of the first frame of what is wished for next.
  first: () => new Promise((take) => (images.push(take), engine.call("want_image", [true]))),
  edit: async (path, text) => {
    await openFile(path);
    editor.view.dispatch({ changes: { from: 0, to: editor.view.state.doc.length, insert: text } });
  },
  text: (path) => engine.call("text", [path]),
  state,
  wish,
};

/// Opens a file that was dropped or chosen: a scene, an image to hold the shown one against, or a saved project.
async function openAny(file) {
  const kind = /\.(glb|exr|zip)$/i.exec(file.name)?.[1].toLowerCase();
  if (!kind) return say("Open a scene (.glb), an image to compare with (.exr) or a saved project (.zip).");
  if (file.size > MOST_DROPPED) return say(`The file is larger than ${MOST_DROPPED >> 20} MiB.`);
  const bytes = new Uint8Array(await file.arrayBuffer());
  if (kind === "zip") return load(bytes);
  const stem = file.name.slice(0, -4).replace(/[^\w-]/g, "_").slice(0, 60);
  const path = `${kind === "glb" ? "scenes" : "references"}/${stem}.${kind}`;
  own.set(path, bytes);
  await hold(path, bytes);
  if (kind === "glb") {
    fetched.add(path);
    state.scene = path;
  } else {
    state.against = { image: path };
    byId("against-open").open = true;
  }
  choices();
  await wish();
}

/// Saves what the image is made of, as a folder that the command renders.
async function save() {
  const all = new Map();
  const paths = [...(state.sources ?? []), ...edits.keys(), ...files.filter((path) => path.startsWith("shaders/"))];
  for (const path of new Set(paths)) {
    const text = edits.get(path) ?? (await engine.call("text", [path]));
    if (text !== undefined) all.set(path, new TextEncoder().encode(text));
  }
  for (const path of scenes[state.scene] ?? [state.scene]) all.set(path, own.get(path) ?? (await bytesOf(path)));
  const reference = state.against?.image;
  if (reference) all.set(reference, own.get(reference));
  const { graph, scene, params, output, size, exposure, against } = state;
  const place = [...(await engine.call("place"))];
  const zip = packed({ graph, scene, params, output, size, exposure, against, place }, all);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([zip], { type: "application/zip" }));
  link.download = `${graph.replace(/^.*\/|\.ron$/g, "")}.zip`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

async function load(bytes) {
  let project;
  try {
    project = unpacked(bytes);
  } catch (error) {
    return say(`The project can't be opened: ${error.message}`);
  }
  await revert();
  for (const [path, content] of project.files) {
    if (/^(graphs|shaders)\//.test(path) && isText(path)) {
      const text = new TextDecoder().decode(content);
      if (text === (await engine.call("text", [path]))) continue;
      edits.set(path, text);
    } else {
      own.set(path, content);
      fetched.add(path);
    }
    await hold(path, content);
  }
  Object.assign(state, project.choice);
  exposed();
  choices();
  await wish();
  await openFile(state.graph);
}

function exposed() {
  byId("exposure").value = state.exposure;
  byId("exposure-shown").textContent = state.exposure;
}

function controls() {
  const choose = (id, set) => (byId(id).onchange = () => (set(byId(id).value), wish()));
  choose("graph", (v) => ((state.graph = v), (state.output = null), choices()));
  choose("scene", (v) => (state.scene = v));
  choose("output", (v) => (state.output = v));
  choose("size", (v) => (state.size = v.split("×").map(Number)));
  byId("exposure").oninput = () => {
    state.exposure = Number(byId("exposure").value);
    byId("exposure-shown").textContent = state.exposure;
    engine.call("set_exposure", [state.exposure]);
  };
  byId("share").onclick = share;
  byId("revert").onclick = async () => {
    await revert();
    await openFile(state.graph);
    history.replaceState(null, "", location.pathname);
    await wish();
  };
  byId("save").onclick = () => save().catch((error) => say(error.message));
  for (const id of ["open", "open-reference"]) byId(id).onclick = () => byId("file").click();
  byId("file").onchange = async () => {
    const [file] = byId("file").files;
    if (file) await openAny(file);
    // The same file again is a change, too.
    byId("file").value = "";
  };
  byId("resource-open").ontoggle = () => (resources.ask(), wish());
  byId("times-open").ontoggle = () => wish();
  byId("plan-open").ontoggle = () => byId("plan-open").open && showPlan();
  window.onhashchange = async () => {
    await follow();
    choices();
    await wish();
  };
}

controls();
pointers(engine, byId("stage"), openAny);
begin();
