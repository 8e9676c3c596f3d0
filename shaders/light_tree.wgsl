//! Builds the tree over the lights: they are sorted along a curve that keeps neighbours together (Morton, "A Computer
//! Oriented Geodetic Data Base", 1966), then neighbours are paired, and pairs of them, up to one.
#import lightgraph::lights::{Light, lights}
#import lightgraph::light_tree::{Node, place}

struct Params {
    lights: u32,
    light_leaves: u32,
}
var<uniform> params: Params;
/// Place along the curve and row in `lights`.
var<storage, read_write> light_order: array<vec2u>;
var<storage, read_write> light_groups: array<Node>;
var light_nodes: texture_storage_2d<rgba32float, write>;

const LANES: u32 = 256u;
/// Steps along each axis of the curve.
const STEPS: f32 = 1024.0;
/// Past the curve's end: directional lights, then what fills up the power of two.
const NOWHERE: u32 = 0x40000000u;
const NO_LIGHT: u32 = 0x40000001u;
/// Metres: farther than any light.
const FAR: f32 = 1e30;

var<workgroup> lowest: array<vec3f, LANES>;
var<workgroup> highest: array<vec3f, LANES>;

/// The ten bits of a step, two apart.
fn spread(step: u32) -> u32 {
    var bits = step;
    bits = (bits | bits << 16u) & 0x030000ffu;
    bits = (bits | bits << 8u) & 0x0300f00fu;
    bits = (bits | bits << 4u) & 0x030c30c3u;
    return (bits | bits << 2u) & 0x09249249u;
}

fn along_curve(position: vec3f, low: vec3f, extent: f32) -> u32 {
    let steps = vec3u(clamp((position - low) / extent * STEPS, vec3f(0.0), vec3f(STEPS - 1.0)));
    return spread(steps.x) | spread(steps.y) << 1u | spread(steps.z) << 2u;
}

fn keep(row: u32, node: Node) {
    light_groups[row] = node;
    let at = place(row);
    let l = node.light;
    textureStore(light_nodes, at, vec4f(l.position, l.range));
    textureStore(light_nodes, at + vec2u(1u, 0u), vec4f(l.direction, l.cos_inner));
    textureStore(light_nodes, at + vec2u(2u, 0u), vec4f(l.intensity, l.cos_outer));
    textureStore(light_nodes, at + vec2u(3u, 0u), vec4f(node.representative, f32(l.kind)));
    textureStore(light_nodes, at + vec2u(4u, 0u), vec4f(node.lower, 0.0));
    textureStore(light_nodes, at + vec2u(5u, 0u), vec4f(node.upper, 0.0));
}

/// A single light, or none.
fn leaf(place: vec2u) -> Node {
    var node: Node;
    node.lower = vec3f(FAR);
    node.upper = vec3f(-FAR);
    if place.x != NO_LIGHT {
        node.light = lights[place.y];
        node.representative = node.light.position;
        if place.x != NOWHERE {
            node.lower = node.light.position;
            node.upper = node.light.position;
        }
    }
    return node;
}

fn power(node: Node) -> f32 {
    return select(dot(node.light.intensity, vec3f(1.0)), 0.0, any(node.lower > node.upper));
}

/// Two groups as one. The light nearest to the middle stands for all.
fn joined(a: Node, b: Node) -> Node {
    let total = power(a) + power(b);
    let share = select(vec2f(0.0), vec2f(power(a), power(b)) / total, total > 0.0);
    let middle = select(vec3f(0.0), share.x * a.light.position, share.x > 0.0)
        + select(vec3f(0.0), share.y * b.light.position, share.y > 0.0);
    let nearer = share.y == 0.0
        || share.x > 0.0 && distance(middle, a.representative) <= distance(middle, b.representative);
    var node = b;
    if nearer {
        node = a;
    }
    node.light.position = middle;
    node.light.intensity = select(vec3f(0.0), a.light.intensity, share.x > 0.0)
        + select(vec3f(0.0), b.light.intensity, share.y > 0.0);
    node.lower = min(a.lower, b.lower);
    node.upper = max(a.upper, b.upper);
    return node;
}

/// One workgroup.
@compute @workgroup_size(LANES)
fn build(@builtin(local_invocation_index) lane: u32) {
    var low = vec3f(FAR);
    var high = vec3f(-FAR);
    for (var i = lane; i < params.lights; i += LANES) {
        if lights[i].kind != 2u {
            low = min(low, lights[i].position);
            high = max(high, lights[i].position);
        }
    }
    lowest[lane] = low;
    highest[lane] = high;
    for (var half = LANES / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if lane < half {
            lowest[lane] = min(lowest[lane], lowest[lane + half]);
            highest[lane] = max(highest[lane], highest[lane + half]);
        }
    }
    workgroupBarrier();
    low = lowest[0];
    let size = highest[0] - low;
    let extent = max(max(size.x, max(size.y, size.z)), 1e-20);

    let leaves = params.light_leaves;
    for (var i = lane; i < leaves; i += LANES) {
        var along = NO_LIGHT;
        if i < params.lights {
            along = NOWHERE;
            if lights[i].kind != 2u {
                along = along_curve(lights[i].position, low, extent);
            }
        }
        light_order[i] = vec2u(along, i);
    }
    // Batcher's bitonic sort; equal places keep the order of the table.
    for (var size = 2u; size <= leaves; size *= 2u) {
        for (var step = size / 2u; step > 0u; step /= 2u) {
            storageBarrier();
            for (var i = lane; i < leaves / 2u; i += LANES) {
                let first = i / step * 2u * step + i % step;
                let a = light_order[first];
                let b = light_order[first + step];
                let later = a.x > b.x || a.x == b.x && a.y > b.y;
                if later == ((first & size) == 0u) {
                    light_order[first] = b;
                    light_order[first + step] = a;
                }
            }
        }
    }
    storageBarrier();
    for (var i = lane; i < leaves; i += LANES) {
        keep(leaves + i, leaf(light_order[i]));
    }
    for (var rows = leaves / 2u; rows > 0u; rows /= 2u) {
        storageBarrier();
        for (var row = rows + lane; row < 2u * rows; row += LANES) {
            keep(row, joined(light_groups[2u * row], light_groups[2u * row + 1u]));
        }
    }
}
