// Imports from a module that isn't there, and what a module doesn't have.
#import bad::haf::half_of
#import bad::half::haf_of

@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(half_of(haf_of(1.0)));
}
