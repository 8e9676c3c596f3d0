// The editor: a state for each file, faults at their places.
import { autocompletion, closeBrackets, closeBracketsKeymap, completeAnyWord, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history, historyKeymap, indentWithTab } from "@codemirror/commands";
import { bracketMatching, indentOnInput, indentUnit } from "@codemirror/language";
import { lintGutter, lintKeymap, setDiagnostics } from "@codemirror/lint";
import { highlightSelectionMatches, searchKeymap } from "@codemirror/search";
import { EditorState } from "@codemirror/state";
import { oneDark } from "@codemirror/theme-one-dark";
import { drawSelection, EditorView, highlightActiveLine, highlightActiveLineGutter, keymap, lineNumbers } from "@codemirror/view";
import { ron, wgsl } from "./language.js";

export class Editor {
  /// `edited` is called with a path and its text.
  constructor(parent, edited) {
    this.edited = edited;
    this.states = new Map();
    this.faults = [];
    this.view = new EditorView({ parent, state: EditorState.create({ doc: "" }) });
  }

  has(path) {
    return this.states.has(path);
  }

  /// Shows a file; `text` is what it holds when it is opened for the first time.
  show(path, text) {
    if (this.path) this.states.set(this.path, this.view.state);
    if (!this.states.has(path)) this.states.set(path, this.state(path, text));
    this.path = path;
    this.view.setState(this.states.get(path));
    this.mark();
  }

  /// Forgets what the files were, edits included.
  clear() {
    this.states.clear();
    this.path = undefined;
  }

  state(path, text) {
    return EditorState.create({
      doc: text,
      extensions: [
        lineNumbers(), highlightActiveLineGutter(), lintGutter(), history(), drawSelection(), indentOnInput(),
        indentUnit.of("    "), bracketMatching(), closeBrackets(), autocompletion({ override: [completeAnyWord] }),
        highlightActiveLine(), highlightSelectionMatches(),
        keymap.of([...closeBracketsKeymap, ...defaultKeymap, ...searchKeymap, ...historyKeymap, ...completionKeymap, ...lintKeymap, indentWithTab]),
        path.endsWith(".ron") ? ron : wgsl,
        oneDark,
        EditorView.contentAttributes.of({ "aria-label": path }),
        EditorView.updateListener.of((update) => {
          if (update.docChanged) this.edited(path, update.state.doc.toString());
        }),
      ],
    });
  }

  /// Shows these faults in the files that they are of.
  setFaults(faults) {
    this.faults = faults;
    this.mark();
  }

  mark() {
    const length = this.view.state.doc.length;
    const inside = (place) => {
      const from = Math.min(place.from, length);
      const to = Math.min(Math.max(place.to, from), length);
      // Of a fault that is of many lines, as one of the whole graph, the first is marked.
      return { from, to: Math.min(to, this.view.state.doc.lineAt(from).to) };
    };
    const here = this.faults.flatMap((fault) =>
      fault.places
        .filter((place) => place.path === this.path)
        .map((place, i) => ({
          ...inside(place),
          severity: i === 0 ? fault.severity : "info",
          message: [fault.message, place.text, ...fault.help.map((h) => `help: ${h}`)].filter(Boolean).join("\n"),
        })),
    );
    this.view.dispatch(setDiagnostics(this.view.state, here));
  }

  go(from) {
    const at = Math.min(from, this.view.state.doc.length);
    this.view.dispatch({ selection: { anchor: at }, effects: EditorView.scrollIntoView(at, { y: "center" }) });
    this.view.focus();
  }
}
