// Colours for RON and WGSL: comments, strings, numbers, words.
import { StreamLanguage } from "@codemirror/language";

const words = (text) => new Set(text.split(" "));
const WGSL = words("alias break case const const_assert continue continuing default diagnostic discard else enable fn for if let loop override requires return struct switch var while true false");
const TYPES = words("array atomic bool f16 f32 i32 u32 ptr sampler sampler_comparison vec2 vec3 vec4 vec2f vec3f vec4f vec2u vec3u vec4u vec2i vec3i vec4i mat2x2f mat3x3f mat4x4f texture_2d texture_2d_array texture_3d texture_cube texture_storage_2d texture_depth_2d");

function comment(stream, state) {
  if (state.depth > 0 || stream.match("/*")) {
    if (state.depth === 0) state.depth = 1;
    while (!stream.eol()) {
      if (stream.match("*/")) {
        state.depth -= 1;
        if (state.depth === 0) break;
      } else if (stream.match("/*")) state.depth += 1;
      else stream.next();
    }
    return true;
  }
  if (stream.match("//")) {
    stream.skipToEnd();
    return true;
  }
  return false;
}

const NUMBER = /^(0[xX][0-9a-fA-F]+[iu]?|\d+\.?\d*([eE][+-]?\d+)?[iufh]?|\.\d+([eE][+-]?\d+)?[fh]?)/;
const data = { commentTokens: { line: "//" }, closeBrackets: { brackets: ["(", "[", "{", '"'] } };

export const ron = StreamLanguage.define({
  name: "ron",
  languageData: data,
  startState: () => ({ depth: 0 }),
  token(stream, state) {
    if (comment(stream, state)) return "comment";
    if (stream.eatSpace()) return null;
    if (stream.match(/^"(\\.|[^"\\])*"?/)) return stream.match(/^\s*:/, false) ? "propertyName" : "string";
    if (stream.match(NUMBER)) return "number";
    if (stream.match(/^[A-Za-z_]\w*/)) {
      if (stream.match(/^\s*:/, false)) return "propertyName";
      return /^[A-Z]/.test(stream.current()) ? "typeName" : "keyword";
    }
    stream.next();
    return null;
  },
});

export const wgsl = StreamLanguage.define({
  name: "wgsl",
  languageData: data,
  startState: () => ({ depth: 0 }),
  token(stream, state) {
    if (comment(stream, state)) return "comment";
    if (stream.eatSpace()) return null;
    if (stream.match(/^[@#]\w+/)) return "meta";
    if (stream.match(NUMBER)) return "number";
    if (stream.match(/^[A-Za-z_]\w*/)) {
      const word = stream.current();
      if (WGSL.has(word)) return "keyword";
      if (TYPES.has(word)) return "typeName";
      return stream.match(/^\s*\(/, false) ? "propertyName" : "variableName";
    }
    stream.next();
    return null;
  },
});
