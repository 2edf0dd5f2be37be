//! Writes the generated references of the rig file: `docs/rig.md` and `docs/rig.schema.json`.

use grey_box::rig::reference;
use std::path::Path;

fn main() -> std::io::Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    std::fs::write(docs.join("rig.md"), reference::page())?;
    std::fs::write(docs.join("rig.schema.json"), reference::schema())
}
