// Small parts of the page. Names and texts are set as text, never as markup.

export function make(tag, set = {}, ...children) {
  const made = Object.assign(document.createElement(tag), set);
  made.append(...children);
  return made;
}

export function options(select, list, chosen, name = (x) => x) {
  select.replaceChildren(...list.map((value) => make("option", { value, textContent: name(value), selected: value === chosen })));
}

/// A row of a table.
export function row(texts) {
  return make("tr", {}, ...texts.map((textContent) => make("td", { textContent })));
}
