//! Lets symbols of the interpreter be found when the module is loaded, where linkers ask to be told so.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
