// A function's name is misspelt.
#import bad::half::half_of

@fragment
fn fragment() -> @location(0) vec4f {
    let x = half_of(2.0);
    return vec4f(haf_of(x));
}
