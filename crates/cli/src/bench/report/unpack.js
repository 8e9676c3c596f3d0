"use strict";
// The page's data as `pack.rs` writes it: letters, compressed, texts once, each scene's entries as columns.

async function inflated(letters) {
  const bytes = Uint8Array.from(atob(letters), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return JSON.parse(await new Response(stream).text());
}

/// A function from a row's number to its value; null where there is none.
function column([kind, content], words) {
  if (kind === "values") return i => content[i];
  if (kind === "words") return i => content[i] === null ? null : words[content[i]];
  const parts = Object.entries(content).map(([key, part]) => [key, column(part, words)]);
  return i => {
    const found = parts.map(([key, at]) => [key, at(i)]).filter(([, value]) => value !== null);
    return found.length ? Object.fromEntries(found) : null;
  };
}

/// What an entry has even where the results say nothing.
const blank = () => ({ peer: null, rest: [], mib: null, leak: null, fault: null, times: {}, errors: {}, own: {}, change: {}, passes: {}, steps: {}, bounded: {} });

async function unpacked(letters) {
  const data = await inflated(letters);
  for (const scene of data.scenes) {
    const at = column(scene.entries.columns, data.words);
    scene.entries = Array.from({ length: scene.entries.count }, (_, i) => ({ ...blank(), ...at(i) }));
  }
  return data;
}
