//! Generates scene files, meshes and textures. Every run writes the same files.
//!
//! - `cargo run --release --example generate_scenes`, in the repository's root: the OBJ files of knot and leaves, and the textures of `scenes/`; a
//!   test compares them with what is checked in.
//! - `cargo run --release --example generate_scenes -- meshes FOLDER`: the mesh scenes, which are not checked in
//!   ([docs/mesh-scenes.md](../../docs/mesh-scenes.md)).
//! - `cargo run --release --example generate_scenes -- knot TRIANGLES FOLDER`: the knot with about TRIANGLES triangles.
//! - `cargo run --release --example generate_scenes -- knots COUNT TRIANGLES FOLDER`: COUNT instances of it.

mod gray_code;
mod knot;
mod leaves;
mod meshes;
mod textures;

use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [] => checked_in_files(),
        ["meshes", folder] => {
            fs::create_dir_all(folder)?;
            for scene in meshes::SCENES {
                scene.write(Path::new(folder))?;
                println!("{folder}/{}.toml", scene.name);
            }
            Ok(())
        }
        ["knot", triangle_count, folder] => {
            fs::create_dir_all(folder)?;
            meshes::write_knot(triangle_count.parse()?, Path::new(folder))?;
            println!("{folder}/knot_{triangle_count}.toml");
            Ok(())
        }
        ["knots", count, triangle_count, folder] => {
            fs::create_dir_all(folder)?;
            let (count, triangle_count) = (count.parse()?, triangle_count.parse()?);
            meshes::write_knots(count, triangle_count, Path::new(folder))?;
            println!("{folder}/knots_{count}.toml");
            Ok(())
        }
        _ => Err("usage: generate_scenes [meshes FOLDER | knot TRIANGLES FOLDER | knots COUNT TRIANGLES FOLDER]".into()),
    }
}

fn checked_in_files() -> Result<(), Box<dyn Error>> {
    let scenes = Path::new("scenes");
    fs::write(scenes.join("knot.obj"), knot::obj())?;
    fs::write(scenes.join("leaves.obj"), leaves::obj())?;
    textures::tiles().save(scenes.join("tiles.png"))?;
    textures::bricks().save(scenes.join("bricks.png"))?;
    textures::brick_heights().save(scenes.join("brick_heights.png"))?;
    textures::leaf().save(scenes.join("leaf.png"))?;
    textures::stripes().save(scenes.join("stripes.png"))?;
    let patterns = Path::new("examples/structured_light/patterns");
    fs::create_dir_all(patterns)?;
    gray_code::white().save(patterns.join("white.png"))?;
    for bit in 0..8 {
        gray_code::bit(bit, false).save(patterns.join(format!("{bit}.png")))?;
        gray_code::bit(bit, true).save(patterns.join(format!("{bit}_inverse.png")))?;
    }
    Ok(())
}
