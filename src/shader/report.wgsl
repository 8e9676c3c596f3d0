// What shaders find wrong. `check(holds, invocation, #{HERE})` notes, where it does not hold, the place, how often that
// happened there, and the first invocation to say so.
#define_import_path lightgraph::report

const LINES = 16u;
// Of a line: place (0: free), count, invocation.
const WORDS = 5u;

var<storage, read_write> shader_report: array<atomic<u32>, 80>;

fn check(holds: bool, invocation: vec3u, here: u32) {
    if holds {
        return;
    }
    for (var line = 0u; line < LINES * WORDS; line += WORDS) {
        var owner = 0u;
        // A weak exchange may fail for no reason.
        while owner == 0u {
            let seen = atomicCompareExchangeWeak(&shader_report[line], 0u, here);
            owner = select(seen.old_value, here, seen.exchanged);
        }
        if owner == here {
            if atomicAdd(&shader_report[line + 1u], 1u) == 0u {
                atomicStore(&shader_report[line + 2u], invocation.x);
                atomicStore(&shader_report[line + 3u], invocation.y);
                atomicStore(&shader_report[line + 4u], invocation.z);
            }
            return;
        }
    }
}
