//! `bindgen ENGINE.wasm FOLDER`: what a page loads, from what the compiler made.

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args_os().skip(1);
    let (Some(engine), Some(folder)) = (args.next(), args.next()) else {
        return Err("usage: bindgen ENGINE.wasm FOLDER".into());
    };
    let mut bindgen = wasm_bindgen_cli_support::Bindgen::new();
    bindgen
        .input_path(engine)
        .out_name("engine")
        .web(true)?
        .typescript(false)
        .remove_producers_section(true)
        .remove_name_section(true);
    bindgen.generate(folder)?;
    Ok(())
}
