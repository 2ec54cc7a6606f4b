//! Lets the symbols of Python stay open where the linker has to be told so.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
