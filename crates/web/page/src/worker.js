// The engine by itself: neither a long plan nor a fault of the engine stops the page.
import init, { Engine, last_panic } from "./engine.js";

let engine;
const start = performance.now();
// Both begin before the page asks for them.
const [adapter, loaded] = [navigator.gpu?.requestAdapter(), init({ module_or_path: new URL("engine_bg.wasm", import.meta.url) })];
// The page is told of a failure when it asks.
for (const begun of [adapter, loaded]) begun?.catch(() => {});

function post(message) {
  self.postMessage(message);
}

// What the engine throws that is no text is its end: its memory may be in any state.
function fatal(error) {
  if (typeof error === "string") return false;
  let why = String(error);
  try {
    why = last_panic() || why;
  } catch {}
  post({ dead: why });
  engine = undefined;
  return true;
}

function turn() {
  if (!engine) return;
  try {
    const told = JSON.parse(engine.advance((performance.now() - start) / 1000));
    const image = engine.take_image();
    if (image.length) post({ image });
    const plane = told.inspected ? engine.take_plane() : undefined;
    if (told.swapped || told.faults || told.report || told.score || told.inspected || told.times || told.noticed || told.host_ms !== undefined) post({ told, plane });
  } catch (error) {
    if (fatal(error)) return;
  }
  if (self.requestAnimationFrame) self.requestAnimationFrame(turn);
  else setTimeout(turn, 16);
}

self.onmessage = async ({ data: { id, call, args } }) => {
  try {
    if (call === "open") {
      const [found] = await Promise.all([adapter, loaded]);
      const { vendor, architecture, description } = found?.info ?? {};
      const name = description || [vendor, architecture].filter(Boolean).join(" ") || "this device";
      engine = await Engine.open(args[0], name, navigator.userAgent);
      post({ id, result: { device: JSON.parse(engine.device()), files: JSON.parse(engine.files()), times: engine.times() } });
      turn();
    } else if (call === "ping") {
      post({ id, result: true });
    } else if (engine) {
      post({ id, result: engine[call](...args) });
    }
  } catch (error) {
    post({ id, error: String(error) });
    if (call !== "open") fatal(error);
  }
};
