//! Holes of masked surfaces, for draws that record nothing of them but their depth.
#define_import_path lightgraph::holes
#import lightgraph::surface::{Point, Wide, base_color, is_hole, materials}
#ifdef MORE_AT_VERTICES
#import lightgraph::vertices::vertices
#endif

/// What of a vertex tells where holes are.
struct Cut {
    uv: vec2f,
    second_uv: vec2f,
    /// What vertices make of alpha.
    alpha: f32,
}

/// Of vertex number `index`.
fn cut_at(index: u32, uv: vec2f) -> Cut {
    var cut = Cut(uv, uv, 1.0);
#ifdef SECOND_UVS
    cut.second_uv = vertices[index].second_uv;
#endif
#ifdef VERTEX_COLORS
    cut.alpha = vertices[index].color.a;
#endif
    return cut;
}

/// Ends a fragment where nothing is there. Call it in uniform control flow of a fragment entry only.
fn end_in_hole(material: u32, cut: Cut) {
    var p: Point;
    var wide: Wide;
    p.uv = cut.uv;
    wide.uv = mat2x2f(dpdx(cut.uv), dpdy(cut.uv));
#ifdef SECOND_UVS
    p.second_uv = cut.second_uv;
    wide.second_uv = mat2x2f(dpdx(cut.second_uv), dpdy(cut.second_uv));
#endif
#ifdef VERTEX_COLORS
    p.color = vec4f(cut.alpha);
#endif
    let m = materials[material];
    if is_hole(m, base_color(m, p, wide).a) {
        discard;
    }
}
