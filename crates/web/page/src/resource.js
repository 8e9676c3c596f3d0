// What a resource holds: a plane of a texture as colours, or the first words of a buffer.
import { options } from "./widgets.js";

const byId = (id) => document.getElementById(id);
const FACES = ["+X", "−X", "+Y", "−Y", "+Z", "−Z"];
const short = (v) => (v === 0 || (Math.abs(v) >= 1e-3 && Math.abs(v) < 1e5) || !Number.isFinite(v) ? v.toFixed(4) : v.toExponential(3));

export class Resources {
  constructor(engine) {
    this.engine = engine;
    this.all = [];
    for (const id of ["resource", "mip", "layer", "channel", "low", "high", "false-color"]) {
      byId(id).onchange = () => {
        if (id === "resource") byId("mip").value = byId("layer").value = 0;
        this.ask();
      };
    }
    const canvas = byId("plane");
    canvas.onpointermove = async (event) => {
      const [x, y] = [event.offsetX / canvas.clientWidth, event.offsetY / canvas.clientHeight];
      const at = [Math.floor(x * canvas.width), Math.floor(y * canvas.height)];
      const values = [...(await this.engine.call("texel", at))];
      if (values.length) byId("texel").textContent = `(${at.join(", ")})  ${values.map(short).join("  ")}`;
    };
  }

  get open() {
    return byId("resource-open").open;
  }

  /// The resources of the graph that is made.
  list(all) {
    this.all = all;
    const chosen = all.some((r) => r.name === byId("resource").value) ? byId("resource").value : all[0]?.name;
    options(byId("resource"), all.map((r) => r.name), chosen);
    this.ask();
  }

  /// Tells the engine what to look into.
  ask() {
    const resource = this.open && this.all.find((r) => r.name === byId("resource").value);
    if (!resource) return this.engine.call("inspect", [""]).catch(() => {});
    const { mips = 1, layers = 1, kind = "layer", bytes } = resource;
    const part = (id, count, label) => {
      byId(id).max = count - 1;
      byId(id).value = Math.min(Math.max(0, Number(byId(id).value) | 0), count - 1);
      byId(id).parentElement.hidden = count < 2;
      byId(id).previousElementSibling.textContent = label;
    };
    part("mip", mips, "mip");
    part("layer", layers, kind === "face" ? `face ${FACES[byId("layer").value % 6]}` : kind);
    byId("texture-look").hidden = bytes !== undefined;
    const [low, high] = [byId("low"), byId("high")].map((input) => (input.value === "" ? NaN : Number(input.value)));
    const wanted = {
      resource: resource.name, mip: Number(byId("mip").value), layer: Number(byId("layer").value), channel: byId("channel").value,
      range: Number.isFinite(low) && Number.isFinite(high) ? [low, high] : null, false_color: byId("false-color").checked,
    };
    byId("resource-line").textContent = "reading it back…";
    this.engine.call("inspect", [JSON.stringify(wanted)]).catch((error) => (byId("resource-line").textContent = error.message));
  }

  /// What came: numbers of the whole, and its texels as colours or its words.
  show(told, pixels) {
    byId("plane").hidden = !pixels?.length;
    byId("words").hidden = !told.words;
    if (told.fault) byId("resource-line").textContent = told.fault;
    else if (told.words) {
      byId("resource-line").textContent = `${told.bytes} bytes; each word as f32 and as u32`;
      byId("words").textContent = words(told.words);
    } else {
      const { width, height, least, most, mean } = told;
      const odd = [[told.not_a_number, "NaN"], [told.infinite, "infinite"]].filter(([n]) => n).map(([n, what]) => `, ${n} ${what}`);
      byId("resource-line").textContent = `${width} × ${height}: ${short(least)} … ${short(most)}, mean ${short(mean)}${odd.join("")}`;
      Object.assign(byId("plane"), { width, height });
      byId("plane").getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(pixels), width, height), 0, 0);
    }
  }
}

function words(all) {
  const [bits, float] = [new Uint32Array(1), new Float32Array(1)];
  const number = (word) => {
    bits[0] = word;
    float[0] = new Float32Array(bits.buffer)[0];
    return `${short(float[0]).padStart(12)} ${String(word).padStart(10)}`;
  };
  const lines = [];
  for (let at = 0; at < all.length; at += 4) lines.push(`${String(4 * at).padStart(6)}  ${all.slice(at, at + 4).map(number).join("   ")}`);
  return lines.join("\n");
}
