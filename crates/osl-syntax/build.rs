//! Generates the LR tables of the parser from `src/grammar.lalrpop`, only when the grammar changes.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=src/grammar.lalrpop");
    lalrpop::Configuration::new().use_cargo_dir_conventions().process()
}
