//! Where in the lights' beams photons leave: mostly where rays ended that are lit, and beside. Of each light squares of
//! 1, 4, 16, … parts, one after the other; a part holds the mean of the four below it.
#import lightgraph::lights::{light_count, lights}
#import lightgraph::marks::{first_part, last_square, marked_part}

var<storage, read> marks: array<u32>;
var<storage, read_write> beams: array<f32>;

const LANES: u32 = 128u;
/// Photons that leave where no ray ended, by those that leave where one did: chance may have led none there.
const ELSEWHERE: f32 = 0.05;

/// Whether light is wanted in a part of the finest square or beside it. Beams of points and spots close round their
/// axis.
fn wanted(light: u32, at: vec2i, edge: i32) -> bool {
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            var beside = at + vec2i(x, y);
            if lights[light].kind != 2u {
                beside.y = (beside.y + edge) % edge;
            }
            let part = vec2u(clamp(beside, vec2i(0), vec2i(edge - 1)));
            if marks[marked_part(light, part)] != 0u {
                return true;
            }
        }
    }
    return false;
}

@compute @workgroup_size(LANES)
fn find_beams(@builtin(local_invocation_id) id: vec3u) {
    let last = last_square();
    for (var down = 0u; down <= last; down++) {
        let square = last - down;
        let edge = 1u << square;
        for (var i = id.x; i < light_count() * edge * edge; i += LANES) {
            let light = i / (edge * edge);
            let at = vec2u(i % edge, i / edge % edge);
            var weight = 0.0;
            if down == 0u {
                weight = select(ELSEWHERE, 1.0, wanted(light, vec2i(at), i32(edge)));
            } else {
                let below = first_part(light, square + 1u) + 4u * at.y * edge + 2u * at.x;
                weight = 0.25 * (beams[below] + beams[below + 1u] + beams[below + 2u * edge] + beams[below + 2u * edge + 1u]);
            }
            beams[first_part(light, square) + at.y * edge + at.x] = weight;
        }
        storageBarrier();
    }
}
