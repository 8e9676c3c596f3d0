// The playground in a real browser: `node test/run.mjs LIGHTGRAPH PAGE OUT [PATTERN]`. Images of the desktop are rendered
// by LIGHTGRAPH, and everything is written to OUT. PATTERN chooses tests by name.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { unzipSync, zipSync } from "fflate";
import { launch, serve, shown } from "./browser.mjs";
import { exr } from "./exr.mjs";

const [lightgraph, site, out, pattern = ""] = process.argv.slice(2);
mkdirSync(out, { recursive: true });
const SIZE = [128, 128];
/// Root mean square of what the browser's image may differ by, of the mean of the desktop's.
const MOST_RMSE = 0.01;
const SHADER = "shaders/play/march.wgsl";

const server = await serve(lightgraph, site);
const browser = await launch();
const said = [];
let failed = 0;

async function test(name, run) {
  if (!new RegExp(pattern).test(name)) return;
  const start = performance.now();
  try {
    const note = await run();
    console.log(`ok    ${name}${note ? `: ${note}` : ""} (${((performance.now() - start) / 1000).toFixed(1)} s)`);
  } catch (error) {
    failed += 1;
    console.log(`FAIL  ${name}: ${error.stack}`);
    await page.screenshot({ path: join(out, `failed_${failed}.png`) });
  }
}

async function open(url, view = { width: 1280, height: 800 }) {
  const context = await browser.newContext({ viewport: view, hasTouch: view.width < 600, isMobile: view.width < 600 });
  const page = await context.newPage();
  page.on("pageerror", (error) => said.push(String(error)));
  page.on("console", (m) => m.type() === "error" && said.push(m.text()));
  await page.goto(url);
  return page;
}

/// Chooses, waits until it is shown, and says how it went.
async function choose(page, choice) {
  await page.evaluate(async (choice) => {
    Object.assign(window.lightgraph.state, choice);
    await window.lightgraph.wish();
  }, choice);
  return shown(page, ["shown", "fault"]);
}

const image = (page) => page.evaluate(async () => Array.from(await window.lightgraph.image()));
const faults = (page) => page.evaluate(() => document.getElementById("faults").innerText);
const rest = (page) => page.waitForFunction(() => document.body.dataset.rest === "true", { timeout: 60_000 });

function difference(a, b) {
  return JSON.parse(execFileSync(lightgraph, ["compare", a, b, "--json"], { encoding: "utf8" })).rmse_percent / 100;
}

let page;
const from = performance.now();
page = await open(server.url);

await test("the first frame is there within 3 s", async () => {
  assert.equal(await shown(page, ["shown", "fault", "none"]), "shown", await faults(page));
  await page.waitForFunction(() => Number(document.body.dataset.frames) > 0);
  const seconds = (performance.now() - from) / 1000;
  await page.screenshot({ path: join(out, "playground.png") });
  assert.ok(seconds < 3, `${seconds.toFixed(2)} s`);
  return `${seconds.toFixed(2)} s after the page was asked for`;
});

/// The driver that the browser has, for the desktop: another draws edges of triangles by other rules.
const DRIVER = ["/usr/lib/chromium/vk_swiftshader_icd.json"].find(existsSync);

for (const [graph, size] of [["gi/direct", 128], ["gi/fast_grid", 128], ["gi/final_gather", 48]]) {
  for (const scene of ["cornell.glb", "hall.glb"]) {
    await test(`${graph} on ${scene} is the desktop's`, async () => {
      const [a, same, other] = ["web", "swiftshader", "llvmpipe"].map((where) => join(out, `${graph.replace("/", "_")}_${scene}_${where}.exr`));
      const render = (to, env) =>
        execFileSync(lightgraph, ["render", `graphs/${graph}.ron`, "--scene", `scenes/${scene}`, "--size", `${size}x${size}`, "--fastest", "first", "--out", to], { env: { ...process.env, ...env }, stdio: "ignore" });
      render(other, {});
      if (DRIVER) render(same, { VK_DRIVER_FILES: DRIVER, VK_ICD_FILENAMES: DRIVER });
      const image = page.evaluate(() => window.lightgraph.first().then((image) => Array.from(image)));
      assert.equal(await choose(page, { graph: `graphs/${graph}.ron`, scene: `scenes/${scene}`, size: [size, size], params: {}, output: null }), "shown", await faults(page));
      writeFileSync(a, exr(await image));
      const rmse = DRIVER ? difference(a, same) : difference(a, other);
      assert.ok(rmse <= MOST_RMSE, `rmse ${(100 * rmse).toFixed(3)} %`);
      return `rmse ${(100 * rmse).toFixed(4)} % on the same driver, ${(100 * difference(a, other)).toFixed(2)} % to the default one`;
    });
  }
}

await test("a frame at rest takes the host less than 1 ms", async () => {
  assert.equal(await choose(page, { graph: "graphs/gi/direct.ron", scene: "scenes/cornell.glb", size: SIZE, params: {}, output: null }), "shown");
  await rest(page);
  await page.evaluate(() => (document.body.dataset.frames = 0));
  await page.waitForTimeout(4000);
  const ms = Number(await page.evaluate(() => document.body.dataset.hostMs));
  assert.ok(ms <= 1, `${ms} ms`);
  return `${ms} ms, the median`;
});

await test("a fault stands at its place, the last frame stays, and mending takes half a second", async () => {
  const path = "graphs/gi/direct.ron";
  const text = await page.evaluate((p) => window.lightgraph.text(p), path);
  const bad = text.replace("passes:", "pases:");
  assert.notEqual(text, bad);
  const before = await image(page);
  await page.evaluate(([p, t]) => window.lightgraph.edit(p, t), [path, bad]);
  assert.equal(await shown(page, ["fault"]), "fault");
  assert.match(await faults(page), /pases/);
  assert.ok((await page.locator(".cm-lintRange-error").count()) > 0, "a mark in the text");
  await page.screenshot({ path: join(out, "fault.png") });
  assert.deepEqual(await image(page), before);
  const start = performance.now();
  await page.evaluate(([p, t]) => window.lightgraph.edit(p, t), [path, text]);
  await shown(page);
  const ms = performance.now() - start;
  assert.equal(await page.locator(".cm-lintRange-error").count(), 0);
  return `${ms.toFixed(0)} ms`;
});

await test("an edited shader is seen within half a second", async () => {
  const sources = await page.evaluate(() => window.lightgraph.state.sources);
  const path = sources.find((s) => s.endsWith(".wgsl") && !s.includes("/lib/"));
  const text = await page.evaluate((p) => window.lightgraph.text(p), path);
  const bad = `${text}\nfn spoilt() -> f32 { return nothing; }\n`;
  await page.evaluate(([p, t]) => window.lightgraph.edit(p, t), [path, bad]);
  assert.equal(await shown(page, ["fault"]), "fault");
  assert.match(await faults(page), /nothing/);
  const start = performance.now();
  await page.evaluate(([p, t]) => window.lightgraph.edit(p, t), [path, `${text}\n// edited\nfn sound() -> f32 { return 1.0; }\n`]);
  await shown(page);
  const ms = performance.now() - start;
  assert.ok(ms <= 500, `${ms.toFixed(0)} ms`);
  return `${path}, ${ms.toFixed(0)} ms with the pause after typing`;
});

await test("a slider changes the image", async () => {
  assert.equal(await choose(page, { graph: "graphs/gi/fast_grid.ron", scene: "scenes/cornell.glb", size: SIZE, params: {}, output: null }), "shown");
  const before = await image(page);
  const slider = page.locator("#params input[type=range]").first();
  const name = await slider.locator("xpath=..").locator("span").innerText();
  await slider.evaluate((s) => {
    s.value = s.value > 0.5 ? 0.1 : 0.9;
    s.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await page.waitForFunction(() => Object.keys(window.lightgraph.state.params).length > 0);
  await shown(page, ["shown", "fault"]);
  assert.notDeepEqual(await image(page), before);
  return name;
});

await test("a link opens what was shared", async () => {
  await choose(page, { graph: "graphs/gi/direct.ron", scene: "scenes/cornell.glb", size: SIZE, params: {}, output: null });
  const stage = await page.locator("#stage canvas").boundingBox();
  await page.mouse.move(stage.x + 60, stage.y + 60);
  await page.mouse.down();
  await page.mouse.move(stage.x + 75, stage.y + 64, { steps: 3 });
  await page.mouse.up();
  await page.waitForTimeout(500);
  const here = await image(page);
  await page.click("#share");
  await page.waitForFunction(() => location.hash.startsWith("#s="));
  const other = await open(page.url());
  assert.equal(await shown(other, ["shown", "fault", "none"]), "shown");
  await choose(other, { size: SIZE });
  await other.waitForTimeout(500);
  const there = await image(other);
  const edits = await other.evaluate(() => document.querySelectorAll("#tabs .edited").length);
  assert.ok(edits > 0, "the edits came along");
  assert.deepEqual(there, here);
  await other.context().close();
  return `${page.url().length} characters`;
});

await test("a link of somebody else runs nothing", async () => {
  const evil = { graph: "graphs/<img src=x onerror=alert(1)>.ron", scene: "scenes/cornell.glb", exposure: 0 };
  const raw = (await import("node:zlib")).deflateRawSync(JSON.stringify(evil)).toString("base64url");
  for (const letters of [raw, "AAAA", "%00", "x".repeat(100_000)]) {
    const other = await open(`${server.url}#s=${letters}`);
    let asked = false;
    other.on("dialog", () => (asked = true));
    assert.equal(await shown(other, ["shown", "fault", "none"]), "shown");
    assert.match(await other.locator("#said").innerText(), /can't be followed/);
    assert.ok(!asked);
    await other.context().close();
  }
});

const drop = (page, name, bytes) =>
  page.evaluate(([name, bytes]) => {
    const data = new DataTransfer();
    data.items.add(new File([new Uint8Array(bytes)], name));
    document.body.dataset.state = "making";
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: data, bubbles: true, cancelable: true }));
  }, [name, [...bytes]]);

await test("a dropped .glb is shown, and a broken one is told", async () => {
  const glb = readFileSync("scenes/two_rooms.glb");
  await drop(page, "<b>mine</b>.glb", glb);
  assert.equal(await shown(page, ["shown", "fault"]), "shown", await faults(page));
  assert.match(await page.evaluate(() => window.lightgraph.state.scene), /^scenes\/[\w-]+\.glb$/);
  await drop(page, "broken.glb", glb.subarray(0, 300));
  assert.equal(await shown(page, ["shown", "fault"]), "fault");
  await choose(page, { scene: "scenes/cornell.glb" });
});

await test("A is held against a file and against another graph", async () => {
  const rmse = async (test) => {
    await page.waitForFunction(test, { timeout: 60_000 });
    return Number(await page.evaluate(() => document.body.dataset.rmse));
  };
  assert.equal(await choose(page, { graph: "graphs/gi/direct.ron", scene: "scenes/cornell.glb", size: SIZE, params: {}, output: null }), "shown");
  await rest(page);
  await drop(page, "mine.exr", exr(await image(page)));
  assert.equal(await shown(page, ["shown", "fault"]), "shown", await faults(page));
  const same = await rmse(() => document.body.dataset.rmse !== "");
  assert.equal(same, 0, "its own image");
  await page.selectOption("#against", "graph:graphs/gi/fast_grid.ron");
  const other = await rmse(() => Number(document.body.dataset.rmse) > 1);
  await page.selectOption("#arrangement", "difference");
  await page.evaluate(() => window.scrollTo(0, 0));
  await page.waitForTimeout(500);
  await page.screenshot({ path: join(out, "compare.png") });
  // Another size than the file's is told, not shown.
  await page.selectOption("#against", "image:references/mine.exr");
  await choose(page, { size: [64, 64] });
  await page.waitForFunction(() => / but /.test(document.getElementById("score").innerText), { timeout: 60_000 });
  await page.selectOption("#against", "");
  await choose(page, { size: SIZE });
  return `fast_grid is ${other.toFixed(1)} % off`;
});

await test("resources can be looked into", async () => {
  assert.equal(await choose(page, { graph: "graphs/gi/direct.ron", scene: "scenes/cornell.glb", size: SIZE, params: {}, output: null }), "shown");
  await page.click("#resource-open summary");
  const line = (what) => page.waitForFunction((w) => new RegExp(w).test(document.getElementById("resource-line").textContent), what, { timeout: 60_000 });
  const kinds = await page.evaluate(() => [...document.querySelectorAll("#resource option")].map((o) => o.value));
  await page.selectOption("#resource", "surface_normal");
  await line("128 × 128: .* mean");
  await page.selectOption("#channel", "Red");
  await page.check("#false-color");
  await line("128 × 128: .* mean");
  await page.locator("#plane").scrollIntoViewIfNeeded();
  await page.locator("#plane").hover({ position: { x: 60, y: 60 } });
  await page.waitForFunction(() => /^\(\d+, \d+\)  /.test(document.getElementById("texel").textContent));
  await page.screenshot({ path: join(out, "resource.png") });
  for (const name of kinds) {
    await page.selectOption("#resource", name);
    await line("mean|bytes|can't be read back");
  }
  await page.click("#resource-open summary");
  return `${kinds.length} of them`;
});

await test("a saved project opens again, and the command renders it", async () => {
  assert.equal(await choose(page, { graph: "graphs/gi/direct.ron", scene: "scenes/hall.glb", size: SIZE, params: {}, output: null }), "shown");
  const path = "graphs/gi/direct.ron";
  const text = await page.evaluate((p) => window.lightgraph.text(p), path);
  await page.evaluate(([p, t]) => window.lightgraph.edit(p, t), [path, `// mine\n${text}`]);
  await shown(page);
  await rest(page);
  const here = await image(page);
  const [download] = await Promise.all([page.waitForEvent("download"), page.click("#save")]);
  const zip = readFileSync(await download.path());
  const folder = join(out, "project");
  rmSync(folder, { recursive: true, force: true });
  for (const [name, bytes] of Object.entries(unzipSync(zip))) {
    mkdirSync(dirname(join(folder, name)), { recursive: true });
    writeFileSync(join(folder, name), bytes);
  }
  const [a, b] = ["page.exr", "command.exr"].map((name) => resolve(join(folder, name)));
  writeFileSync(a, exr(here));
  const env = DRIVER ? { VK_DRIVER_FILES: DRIVER, VK_ICD_FILENAMES: DRIVER } : {};
  const what = ["render", path, "--scene", "scenes/hall.glb", "--size", SIZE.join("x"), "--out", b];
  execFileSync(resolve(lightgraph), what, { cwd: folder, env: { ...process.env, ...env }, stdio: "ignore" });
  if (DRIVER) assert.ok(difference(a, b) <= MOST_RMSE);
  const other = await open(server.url);
  assert.equal(await shown(other, ["shown", "fault", "none"]), "shown");
  await drop(other, "mine.zip", zip);
  assert.equal(await shown(other, ["shown", "fault"]), "shown", await faults(other));
  await rest(other);
  assert.deepEqual(await image(other), here);
  assert.equal(await other.evaluate(() => document.querySelectorAll("#tabs .edited").length), 1);
  for (const broken of [Buffer.from("PK"), zip.subarray(0, 1000), Buffer.from(zipSync({ "../evil.ron": new Uint8Array(9) }))]) {
    await other.evaluate(() => (document.getElementById("said").textContent = ""));
    await drop(other, "broken.zip", broken);
    await other.waitForFunction(() => /can't be opened/.test(document.getElementById("said").textContent));
  }
  await other.context().close();
  return `${(zip.length / 1024).toFixed(0)} KiB`;
});

await test("an exported page shows the desktop's image", async () => {
  const folder = join(out, "site");
  rmSync(folder, { recursive: true, force: true });
  const env = DRIVER ? { VK_DRIVER_FILES: DRIVER, VK_ICD_FILENAMES: DRIVER } : {};
  // Its light comes from an image that the graph names.
  const what = ["export", "web", "graphs/play/image_lit.ron", "--scene", "scenes/cornell.glb", "--size", SIZE.join("x"), "--page", site, "--out", folder];
  execFileSync(lightgraph, what, { env: { ...process.env, ...env }, stdio: "ignore" });
  const exported = await serve(lightgraph, folder);
  const other = await open(exported.url);
  assert.equal(await shown(other, ["shown", "fault", "none"]), "shown", await faults(other));
  await other.waitForFunction(() => Number(document.body.dataset.frames) > 0);
  await other.waitForTimeout(500);
  await other.screenshot({ path: join(out, "exported.png") });
  // The canvas as it is seen, against the picture that the desktop rendered for browsers without WebGPU.
  const rmse = await other.evaluate(async () => {
    const pixels = (image) => {
      const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d");
      canvas.drawImage(image, 0, 0);
      return canvas.getImageData(0, 0, image.width, image.height).data;
    };
    const canvas = pixels(document.querySelector("#stage canvas"));
    const poster = pixels(await createImageBitmap(await (await fetch("poster.png")).blob()));
    if (canvas.length !== poster.length) return NaN;
    const squares = canvas.reduce((sum, v, i) => sum + (v - poster[i]) ** 2, 0);
    return Math.sqrt(squares / canvas.length) / (poster.reduce((sum, v) => sum + v, 0) / poster.length);
  });
  await other.context().close();
  exported.end();
  if (DRIVER) assert.ok(rmse <= MOST_RMSE, `rmse ${(100 * rmse).toFixed(3)} %`);
  assert.ok(rmse < 0.2, `rmse ${(100 * rmse).toFixed(3)} %`);
  return `rmse ${(100 * rmse).toFixed(4)} %`;
});

await test("the page opens again without the server", async () => {
  await page.goto(server.url);
  await shown(page);
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.reload();
  await shown(page);
  await page.context().setOffline(true);
  await page.reload();
  assert.equal(await shown(page, ["shown", "fault", "none"]), "shown");
  await page.context().setOffline(false);
});

await test("a phone shows the image first", async () => {
  const phone = await open(server.url, { width: 390, height: 844 });
  assert.equal(await shown(phone, ["shown", "fault", "none"]), "shown");
  await phone.waitForTimeout(1000);
  await phone.screenshot({ path: join(out, "phone.png") });
  const wide = await phone.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(wide <= 390, `${wide} pixels wide`);
  await phone.context().close();
});

await test("nothing was said to the console", () => {
  assert.deepEqual(said.filter((s) => !/ERR_INTERNET_DISCONNECTED|service worker/i.test(s)), []);
});

await browser.close();
server.end();
console.log(failed ? `${failed} failed; pictures are in ${out}` : "all passed");
process.exit(failed ? 1 : 0);
