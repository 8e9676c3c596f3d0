// An image of floats as an EXR file: single part, scan lines, not compressed.

export function exr([width, height, channels, ...data]) {
  const text = (t) => Buffer.from(`${t}\0`);
  const int = (...all) => Buffer.from(new Int32Array(all).buffer);
  const attribute = (name, type, bytes) => Buffer.concat([text(name), text(type), int(bytes.length), bytes]);
  const names = ["B", "G", "R"];
  const list = Buffer.concat([...names.map((n) => Buffer.concat([text(n), int(2, 0, 1, 1)])), Buffer.from([0])]);
  const float = (...all) => Buffer.from(new Float32Array(all).buffer);
  const header = Buffer.concat([
    int(20000630, 2),
    attribute("channels", "chlist", list),
    attribute("compression", "compression", Buffer.from([0])),
    attribute("dataWindow", "box2i", int(0, 0, width - 1, height - 1)),
    attribute("displayWindow", "box2i", int(0, 0, width - 1, height - 1)),
    attribute("lineOrder", "lineOrder", Buffer.from([0])),
    attribute("pixelAspectRatio", "float", float(1)),
    attribute("screenWindowCenter", "v2f", float(0, 0)),
    attribute("screenWindowWidth", "float", float(1)),
    Buffer.from([0]),
  ]);
  const row = 8 + 4 * names.length * width;
  const offsets = Buffer.alloc(8 * height);
  const rows = [];
  for (let y = 0; y < height; y++) {
    offsets.writeBigUInt64LE(BigInt(header.length + 8 * height + y * row), 8 * y);
    const line = [2, 1, 0].flatMap((c) => Array.from({ length: width }, (_, x) => data[(y * width + x) * channels + Math.min(c, channels - 1)]));
    rows.push(int(y, row - 8), float(...line));
  }
  return Buffer.concat([header, offsets, ...rows]);
}
