// What was measured of alternatives, kept by the browser for the next visit. Where it keeps nothing, it is measured anew.

export async function keep(engine, path) {
  const text = await engine.call("text", [path]);
  if (text === undefined) return;
  try {
    localStorage.setItem(path, text);
  } catch {}
}

export async function restore(engine, path) {
  let text = null;
  try {
    text = localStorage.getItem(path);
  } catch {}
  if (text !== null) await engine.call("hold", [path, new TextEncoder().encode(text)]);
}
