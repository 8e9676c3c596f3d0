// Bundles the page and lists the scenes: `node build.mjs OUT SCENES`. The engine stands in OUT already.
import { build } from "esbuild";
import { cp, mkdir, readFile, readdir, writeFile } from "node:fs/promises";
import { join } from "node:path";

const [out, from] = process.argv.slice(2);
const common = { bundle: true, minify: true, format: "esm", target: "es2022", external: ["./engine.js", "./editor.js"], legalComments: "linked" };
await build({ ...common, entryPoints: { start: "src/start.js", page: "src/main.js", editor: "src/editor.js", worker: "src/worker.js", offline: "src/offline.js" }, outdir: out });
for (const file of ["index.html", "style.css"]) await cp(file, join(out, file));

// By scene: the files that it is made of. A scene RON names its glTF, or has one of its stem beside it.
const names = (await readdir(from)).filter((name) => /\.(glb|gltf|ron)$/.test(name)).sort();
const scenes = {};
await mkdir(join(out, "scenes"), { recursive: true });
for (const name of names) {
  await cp(join(from, name), join(out, "scenes", name));
  const stem = name.replace(/\.\w+$/, "");
  const beside = names.filter((other) => other.replace(/\.\w+$/, "") === stem);
  if (name.endsWith(".ron")) {
    const named = /gltf:\s*"([^"]+)"/.exec(await readFile(join(from, name), "utf8"))?.[1];
    if (beside.length > 1 && (!named || beside.includes(named))) continue;
    if (named && names.includes(named)) scenes[`scenes/${name}`] = [`scenes/${name}`, `scenes/${named}`];
  } else scenes[`scenes/${name}`] = beside.map((other) => `scenes/${other}`);
}
await writeFile(join(out, "scenes.json"), JSON.stringify(scenes, null, 1));
