//! What only some scenes' vertices have, by `vertex_index`.
#define_import_path lightgraph::vertices

struct More {
#ifdef SECOND_UVS
    second_uv: vec2f,
#endif
#ifdef VERTEX_COLORS
    color: vec4f,
#endif
#ifdef NORMAL_MAPS
    tangent: vec4f,
#endif
}
#ifdef MORE_AT_VERTICES
var<storage, read> vertices: array<More>;
#endif
