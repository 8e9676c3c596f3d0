//! Gives the engine a stack as deep as the longest shader needs: in a browser it has one thread, and no other to work
//! on.

fn main() {
    if std::env::var("CARGO_CFG_TARGET_ARCH").as_deref() == Ok("wasm32") {
        println!("cargo::rustc-link-arg-cdylib=-zstack-size={}", 16 << 20);
    }
}
