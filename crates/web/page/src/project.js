// A project as a zip: graphs, shaders, the scene, what it is held against, and what was chosen. Unpacked it is a folder that
// the command renders.
import { strFromU8, strToU8, unzipSync, zipSync } from "fflate";

/// Of a zip that is opened: bytes of all files unpacked, of one text, and files at most.
const MOST_BYTES = 512 << 20;
const MOST_TEXT = 4 << 20;
const MOST_FILES = 4096;
const FILE = /^(graphs|shaders|scenes|references)(\/[\w][\w. -]*)+$/;
const CHOICE = "project.json";

export const isText = (path) => /\.(ron|wgsl)$/.test(path);

/// `files`: bytes by path.
export function packed(choice, files) {
  // Geometry and images are compressed already, or soon too much for one go.
  const entry = (path, bytes) => [bytes, { level: isText(path) ? 6 : 0 }];
  const all = Object.fromEntries([...files].map(([path, bytes]) => [path, entry(path, bytes)]));
  return zipSync({ ...all, [CHOICE]: strToU8(JSON.stringify(choice, null, 1)) });
}

/// What a zip holds: the choice, and bytes by path. Throws what is wrong with it.
export function unpacked(bytes) {
  let [count, sum] = [0, 0];
  const wanted = ({ name, originalSize }) => {
    if (name !== CHOICE && !FILE.test(name)) return false;
    count += 1;
    sum += originalSize;
    const most = name === CHOICE || isText(name) ? MOST_TEXT : MOST_BYTES;
    if (count > MOST_FILES || sum > MOST_BYTES || originalSize > most) throw new Error(`it holds too much: ${name}`);
    return true;
  };
  const files = new Map(Object.entries(unzipSync(bytes, { filter: wanted })));
  const text = files.get(CHOICE);
  if (!text) throw new Error(`it has no ${CHOICE}: it was not saved by this page`);
  files.delete(CHOICE);
  return { choice: checked(JSON.parse(strFromU8(text))), files };
}

/// Only what a choice has, each of its kind.
function checked(given) {
  const text = (v, path) => typeof v === "string" && v.length < 300 && (!path || FILE.test(v));
  const numbers = (v, count) => Array.isArray(v) && v.length === count && v.every(Number.isFinite);
  if (!text(given?.graph, true) || !text(given.scene, true)) throw new Error(`its ${CHOICE} names no graph and scene`);
  const choice = { graph: given.graph, scene: given.scene, params: {}, output: null, place: [], exposure: 0, against: null };
  for (const [name, value] of Object.entries(given.params ?? {}).slice(0, 256)) if (text(value)) choice.params[name] = value;
  if (text(given.output)) choice.output = given.output;
  if (numbers(given.size, 2)) choice.size = given.size.map((side) => Math.min(Math.max(1, Math.round(side)), 4096));
  if (numbers(given.place, 9)) choice.place = given.place;
  if (Number.isFinite(given.exposure)) choice.exposure = Math.min(Math.max(given.exposure, -6), 6);
  for (const kind of ["graph", "image"]) if (text(given.against?.[kind], true)) choice.against = { [kind]: given.against[kind] };
  return choice;
}
