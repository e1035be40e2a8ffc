//! Writes the generated files of `scenes/`: the knot's OBJ and the textures. Run in the repository's root:
//! `cargo run --release --example generate_scenes`. The result is always the same; a test compares it with what is
//! checked in.

mod knot;
mod textures;

use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let scenes = Path::new("scenes");
    fs::write(scenes.join("knot.obj"), knot::obj())?;
    textures::tiles().save(scenes.join("tiles.png"))?;
    textures::bricks().save(scenes.join("bricks.png"))?;
    Ok(())
}
