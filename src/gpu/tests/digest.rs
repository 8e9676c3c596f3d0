use crate::gpu::testing::{Sketch, gpu, run};
use crate::gpu::{DIGEST, digests};
use crate::plan::{Desc, ResourceId, Tiles};
use std::collections::BTreeSet;
use wgpu::TextureFormat as F;

/// Tiles of 5x5 texels: two alike, one with another bit, one whose first two texels have changed places, one that is all 0.
fn atlas(format: F, storage: &str, value: &str) -> Vec<Vec<u8>> {
    let text = format!(
        "var atlas: texture_storage_2d<{storage}, write>;
        fn texel(at: u32) -> u32 {{ return (at + 1u) * 2654435761u & 0x3fffffffu; }}
        @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) id: vec3u) {{
            let tile = id.y / 5u * 3u + id.x / 5u;
            var at = id.y % 5u * 5u + id.x % 5u;
            if tile == 3u && at < 2u {{ at = 1u - at; }}
            var word = texel(at);
            if tile == 2u && at == 24u {{ word ^= 1u; }}
            if tile == 4u {{ word = 0u; }}
            textureStore(atlas, id.xy, {value});
        }}"
    );
    let mut s = Sketch::new();
    s.image("atlas", format, 15, 10);
    let fill = s.compute("fill", &text, [15, 10, 1]);
    let mut ran = run(s.order([fill]));
    if let Desc::Texture(t) = &mut ran.plan.resources[0].desc {
        t.tiles = Some(Tiles { edge: 5, columns: 3, count: 5 });
    }
    let asked = [0, 1, 2, 3, 4, 2];
    let found = digests(gpu(), &ran.prepared, &ran.plan, ResourceId(0), &asked).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(found.len(), asked.len() * DIGEST);
    assert_eq!(digests(gpu(), &ran.prepared, &ran.plan, ResourceId(0), &[]), Ok(vec![]));
    found.chunks_exact(DIGEST).map(<[u8]>::to_vec).collect()
}

#[test]
fn tiles_have_the_same_digest_when_they_hold_the_same() {
    for (format, storage, value) in [
        (F::Rgba32Uint, "rgba32uint", "vec4u(word, at, 7u, 0u)"),
        (F::Rgba32Sint, "rgba32sint", "bitcast<vec4i>(vec4u(word, 0u, 0u, 0u))"),
        (F::Rgba32Float, "rgba32float", "vec4f(0.5, 0.0, bitcast<f32>(word), 1.0)"),
        (F::R32Float, "r32float", "vec4f(bitcast<f32>(word))"),
    ] {
        let found = atlas(format, storage, value);
        assert_eq!(found[0], found[1], "{format:?}");
        assert_eq!(found[2], found[5], "{format:?}: the order in which they are asked for is nothing to them");
        assert_eq!(found[..5].iter().collect::<BTreeSet<_>>().len(), 4, "{format:?}: {found:?}");
        assert!(found.iter().all(|digest| digest.iter().any(|byte| *byte != 0)), "{format:?}");
    }
}
