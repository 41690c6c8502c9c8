//! Lists the files below `dialects`, so that a new file needs no line of code.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=dialects");
    let root = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR")?).join("dialects");
    let mut files = Vec::new();
    collect(&root, &mut files)?;
    files.sort();
    let mut code = "&[\n".to_string();
    for file in &files {
        let name = file.strip_prefix(&root)?.to_string_lossy().replace('\\', "/");
        let (dialect, path) = name.split_once('/').ok_or("a file beside the folders of dialects")?;
        writeln!(code, "({dialect:?}, {path:?}, include_str!({:?})),", file.display().to_string())?;
    }
    code.push_str("]\n");
    std::fs::write(PathBuf::from(std::env::var("OUT_DIR")?).join("files.rs"), code)?;
    Ok(())
}

/// Adds the text files below a folder.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|ending| ending == "h" || ending == "toml") {
            files.push(path);
        }
    }
    Ok(())
}
