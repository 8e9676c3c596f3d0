// A widget for each parameter, as its type and range ask for. Names and texts are set as text, never as markup.

export function show(parent, params, changed) {
  const names = params.map((p) => p.name).join();
  if (parent.dataset.names === names) {
    // While one is dragged the others are what they were.
    return;
  }
  parent.dataset.names = names;
  parent.replaceChildren(...params.map((param) => row(param, changed)));
}

function row(param, changed) {
  const label = document.createElement("label");
  label.className = "param";
  label.title = `${param.about}\n${param.default} by default`;
  const name = document.createElement("span");
  name.textContent = param.name;
  label.append(name, ...widget(param, (value) => changed(param.name, String(value))));
  return label;
}

function input(type, set = {}) {
  const made = document.createElement("input");
  made.type = type;
  return Object.assign(made, set);
}

function widget(param, changed) {
  const { type, value, min, max } = param;
  if (type === "bool") {
    const box = input("checkbox", { checked: value });
    box.oninput = () => changed(box.checked);
    return [box];
  }
  if (typeof value !== "number") {
    const text = input("text", { value });
    text.className = "wide";
    text.onchange = () => changed(text.value);
    return [text];
  }
  const whole = type !== "f32";
  const number = input("number", { value: shown(value), step: whole ? 1 : "any" });
  if (min !== null) number.min = min;
  if (max !== null) number.max = max;
  number.onchange = () => number.value !== "" && changed(number.value);
  if (min === null || max === null) {
    number.className = "wide";
    return [number];
  }
  // What spans orders of magnitude is dragged by its logarithm.
  const least = min > 0 ? min : Math.max(param.default, 1e-6) * 1e-3;
  const log = min >= 0 && param.default > 0 && max / Math.max(param.default, 1e-9) >= 100;
  const to = (v) => (log ? (v <= least ? 0 : Math.log(v / least) / Math.log(max / least)) : (v - min) / (max - min));
  const from = (t) => (t === 0 ? min : log ? least * (max / least) ** t : min + t * (max - min));
  const slider = input("range", { min: 0, max: 1, step: whole && !log ? 1 / Math.max(max - min, 1) : 0.001 });
  slider.value = to(value);
  slider.oninput = () => {
    const v = from(Number(slider.value));
    number.value = shown(whole ? Math.round(v) : v);
    changed(number.value);
  };
  number.addEventListener("change", () => (slider.value = to(Number(number.value))));
  return [slider, number];
}

function shown(value) {
  return String(Number(value.toPrecision(5)));
}
