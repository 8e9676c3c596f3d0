// A and B: the image beside another graph's or a file's, and how far it is from it.
import { options, row } from "./widgets.js";

const byId = (id) => document.getElementById(id);
const ROWS = [
  ["RMSE", "rmse_percent", (v) => `${v.toFixed(2)} %`, "root mean square error, relative to B's mean"],
  ["bias", "bias_percent", (v) => `${v >= 0 ? "+" : ""}${v.toFixed(2)} %`, "of the mean; too dark is negative"],
  ["relMSE", "relmse", (v) => v.toPrecision(3), "mean of squared errors over squared light (+ 0.01)"],
  ["8 × 8 RMSE", "block_rmse_percent", (v) => `${v.toFixed(2)} %`, "of means over blocks: noise averages out"],
  ["95 %", "p95_error", (v) => v.toPrecision(3), "95 % of the values are no further away, in radiance"],
  ["largest", "max_error", (v) => v.toPrecision(3), "the largest error, in radiance"],
];

/// What B is, as options name it: "graph:PATH", "image:PATH" or nothing.
export const chosen = (value) => {
  const [kind, ...path] = value.split(":");
  return path.length ? { [kind]: path.join(":") } : null;
};

export const named = (against) => (against ? Object.entries(against)[0].join(":") : "");

/// `wish` makes what is chosen anew, `arrange` is told how both are seen.
export function controls(state, { wish, arrange }) {
  const at = byId("arrangement-at");
  const seen = () => {
    const kind = byId("arrangement").value;
    at.hidden = kind === "second";
    // A share of the width; or light, from a ten-thousandth to ten.
    arrange(state.against ? kind : "first", kind === "difference" ? 10 ** (5 * Number(at.value) - 4) : Number(at.value));
  };
  byId("against").onchange = () => {
    state.against = chosen(byId("against").value);
    wish();
  };
  byId("arrangement").onchange = () => {
    at.value = byId("arrangement").value === "difference" ? 0.6 : 0.5;
    seen();
  };
  at.oninput = seen;
  return seen;
}

export function list(state, graphs, images) {
  const name = (value) => {
    const against = chosen(value);
    if (!against) return "nothing";
    return against.graph ? against.graph.replace(/^graphs\/|\.ron$/g, "") : against.image.replace(/^references\//, "");
  };
  const values = ["", ...graphs.filter((path) => path !== state.graph).map((path) => `graph:${path}`), ...images.map((path) => `image:${path}`)];
  options(byId("against"), values, named(state.against), name);
  byId("against-more").hidden = !state.against;
}

export function showScore(score) {
  const fault = score?.fault;
  const rows = !score || fault ? [] : ROWS.map(([name, key, text, about]) => Object.assign(row([name, text(score[key])]), { title: about }));
  byId("score").replaceChildren(...(fault ? [row([fault])] : rows));
  document.body.dataset.rmse = score && !fault ? score.rmse_percent : "";
}
