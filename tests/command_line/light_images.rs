//! `camlux batch`: the images that a projector shows, one a frame.

use crate::jobs::{Jobs, SCENE};
use crate::rows::{assert_says, rows};
use camlux::output::{Layer, LayeredImage};

const PROJECTOR: &str = r#"
kind = "projector"
image = "white.png"
position = [0.0, 0.0, 3.0]
direction = [0.0, 0.0, -1.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 30.0
power_w = 50.0
"#;

/// A job with a projector and images of 2 × 1 pixels: both lit, the left one, neither, and the right one at a quarter.
fn shown(light: &str) -> Jobs {
    let jobs = Jobs::new(&format!(
        "[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\n{light}\n"
    ));
    let (camera, rest) = SCENE.split_once("[[light]]").unwrap();
    let (_, mesh) = rest.split_once("[[mesh]]").unwrap();
    jobs.write(
        "scene.toml",
        &format!("{camera}[[light]]{PROJECTOR}[[mesh]]{mesh}"),
    );
    for (name, pixels) in [
        ("white", &[255, 255][..]),
        ("left", &[255, 0]),
        ("black", &[0, 0]),
        ("right", &[0, 64]),
        ("long", &[255, 0, 255]),
    ] {
        let image = image::GrayImage::from_raw(pixels.len() as u32, 1, pixels.to_vec()).unwrap();
        image.save(jobs.path(&format!("{name}.png"))).unwrap();
    }
    jobs
}

#[test]
fn a_pixel_of_one_value_emits_the_same_in_each_image() {
    let images = r#"images = ["white.png", "left.png", "black.png", "right.png"]"#;
    let jobs = shown(&format!("{images}\nencoding = \"linear\""));
    jobs.succeed("set", &[]);
    let direct = |frame: usize| {
        let image = LayeredImage::read(jobs.path(&format!("set/frames/{frame:06}.exr"))).unwrap();
        // Of a pixel on each side of the middle.
        [7, 8].map(|x| f64::from(image.values(Layer::Direct).unwrap()[3 * (8 * 16 + x)]))
    };
    let [left, right] = direct(0);
    assert!(left > 0.0 && right > 0.0);
    let share = 64.0 / 255.0;
    for (frame, due) in [(1, [left, 0.0]), (2, [0.0, 0.0]), (3, [0.0, share * right])] {
        for (found, due) in direct(frame).into_iter().zip(due) {
            assert!(
                (found - due).abs() <= 1e-5 * due,
                "frame {frame}: {found} for {due}"
            );
        }
    }
    // Another image under the same name is another input.
    std::fs::copy(jobs.path("right.png"), jobs.path("left.png")).unwrap();
    let again = jobs.succeed("set", &[]);
    assert_says(&again, &["rendered 4 frames"]);
}

#[test]
fn images_that_cannot_be_shown_are_refused() {
    let refused = |light: &&str, said: &[&str]| {
        let failed = shown(light).fail("set", &[]);
        assert_says(&failed, said);
    };
    rows! { refused;
        "images = [\"white.png\", \"none.png\"]" => "job.toml:5";
        "images = []" => "list one per frame";
        "images = [\"long.png\"]" =>
            "job.toml:5: image 0 has 3 x 1 pixels, but that of the scene's projector 2 x 1";
        "encoding = \"linear\"\npower_factors = [1.0]" => "there are no images";
    }
    let jobs =
        Jobs::new("[job]\nscene = \"scene.toml\"\n[[light]]\nindex = 0\nimages = [\"a.png\"]\n");
    image::GrayImage::new(2, 2)
        .save(jobs.path("a.png"))
        .unwrap();
    assert_says(
        &jobs.fail("set", &[]),
        &[
            "job.toml:5: images are given for light 0, which is no projector but of the kind \"point\"",
        ],
    );
}
