//! Bad calibrations, and matrices that are no cameras: each is refused with a message that states what is wrong, where, and how to mend it.

use crate::common::rows::rows;
use crate::common::scene_folder::{LIGHT, MESH, SceneFolder, assert_says};

const PLACE: &str = "position = [0, 1, 3]\nlook_at = [0, 1, 0]\n";

#[track_caller]
fn refuses_keys(keys: &str, parts: &[&str]) {
    let folder = SceneFolder::new();
    let scene = folder.load(&format!("[camera]\n{keys}{LIGHT}{MESH}"));
    assert_says(&folder.error(scene), parts);
}

#[test]
fn matrices_that_are_no_pose() {
    let lens = "resolution = [8, 6]\nfov_x_deg = 50\n";
    let pose = |rows: &str| format!("{lens}axes = \"opencv\"\ncamera_to_world = [{rows}]\n");
    rows! { refuses_keys;
        format!("{lens}camera_to_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n") =>
            "scene.toml:1: [camera] has no \"axes\"; add axes = \"opencv\" (x right, y down, z forward) or \"opengl\"";
        pose("[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]").replace("opencv", "blender") =>
            "scene.toml:4: unknown axes \"blender\"", "opencv, opengl";
        pose("[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0]") =>
            "scene.toml:5: \"camera_to_world\" in [camera] does not begin with a rotation", "[2.0, 2.0, 2.0]";
        pose("[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0]") => "mirrors space", "without scale and mirror";
        pose("[1, 0.001, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]") => "not at right angles";
        pose("[1.000001, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]") => "does not begin with a rotation";
        pose("[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]") => "has the last row";
        pose("[1, 0, 0, 0], [0, 1, 0, 0]") => "has 2 rows instead of 3 or 4";
        pose("[1, 0, 0], [0, 1, 0], [0, 0, 1]") => "give a list of rows, each of 4 finite numbers";
        pose("[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]") + "up = [0, 1, 0]\n" =>
            "\"up\" in [camera] is given beside \"camera_to_world\"";
        format!("{lens}{PLACE}axes = \"opengl\"\n") => "tells the axes of a matrix, but there is none";
    }
}

#[test]
fn lenses_by_matrix_and_vector() {
    let of = |lens: &str| format!("resolution = [8, 6]\n{PLACE}{lens}\n");
    let k = "camera_matrix = [[8, 0, 4], [0, 8, 3], [0, 0, 1]]";
    rows! { refuses_keys;
        of("camera_matrix = [[8, 0, 4], [1, 8, 3], [0, 0, 1]]") =>
            "scene.toml:5: \"camera_matrix\" in [camera] has the rows", "give [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]";
        of(&format!("{k}\nfov_x_deg = 50")) => "conflicts with \"fov_x_deg\"";
        of("fov_x_deg = 50\nfov_y_deg = 50") => "conflicts with \"fov_x_deg\"";
        of("fov_x_deg = 180") => "fov_x_deg is 180";
        of(&format!("{k}\ndistortion = [1, 2, 3]")) => "has 3 coefficients; give OpenCV's 4, 5, 8, 12 or 14";
        of(&format!("{k}\nfisheye = [1, 2, 3]")) => "an array of 4 finite numbers";
        of(&format!("{k}\ndistortion = [0, \"b\"]")) => "give an array of finite numbers";
        of("fov_x_deg = 50\ndistortion = [0, 0, 0, 0]") => "give intrinsics_px";
        of("projection = \"parallel\"") => "scene.toml:5", "unknown projection \"parallel\"", "equirectangular, orthographic";
        of("projection = \"orthographic\"") => "[camera] has no \"height_m\"; add height_m = 2.0";
        of("projection = \"orthographic\"\nheight_m = 0") => "scene.toml:6", "height_m of the image is 0; give a finite value above 0";
        of("projection = \"orthographic\"\nheight_m = -2") => "height_m of the image is -2";
        of("projection = \"orthographic\"\nheight_m = inf") => "height_m";
        of("projection = \"orthographic\"\nheight_m = 2\nfov_y_deg = 50") => "conflicts with \"fov_y_deg\"";
        of("projection = \"orthographic\"\nheight_m = 2\nfisheye = [0, 0, 0, 0]") => "is given with a distortion";
        of("projection = \"equirectangular\"\nheight_m = 2") => "scene.toml:6: \"height_m\" in [camera] is the height of the image of an orthographic camera";
        of("fov_y_deg = 50\nheight_m = 2") => "add projection = \"orthographic\" in place of the lens, or remove it";
    }
}

/// Loads a scene whose camera is of a file with this content.
#[track_caller]
fn refuses_file<T: AsRef<str>>((name, content): &(&str, T), parts: &[&str]) {
    let folder = SceneFolder::new();
    folder.write(name, content.as_ref());
    let keys = format!("path = \"{name}\"\n{PLACE}");
    let scene = folder.load(&format!("[camera]\n{keys}{LIGHT}{MESH}"));
    assert_says(&folder.error(scene), parts);
}

#[test]
fn calibrations_in_yaml_and_xml() {
    let k = "K: [8, 0, 4, 0, 8, 3, 0, 0, 1]\n";
    let kalibr = "resolution: [8, 6]\nintrinsics: [8, 8, 4, 3]\n";
    rows! { refuses_file;
        ("cam.yaml", "") => "cam.yaml:1: holds nothing";
        ("cam.yaml", "a: [1\n") => "cam.yaml:", "not valid YAML", "correct this line";
        ("cam.yaml", "%YAML:1.0\n---\nK: [8, 0, 4, 0, 8, 3, 0, 0]\n") =>
            "cam.yaml:3: \"K\" has 8 numbers; give 3 rows of 3 numbers";
        ("cam.yaml", "K: [8, 0, 4, 0, 8, 3, 0, 0, x]\n") => "cam.yaml:1: \"K\" holds \"x\"; give finite numbers";
        ("cam.yaml", "K: [8, 0, 4, 0, 8, 3, 0, 0, .nan]\n") => "holds \".nan\"";
        ("cam.yaml", "K: [8, 0, 4, 1, 8, 3, 0, 0, 1]\n") => "\"K\" is no camera matrix";
        ("cam.yaml", "width: 8\nheight: 6\n") => "cam.yaml has no camera matrix; add camera_matrix";
        ("cam.yaml", &format!("{k}{k}")) => "cam.yaml:2: \"K\" is there twice";
        ("cam.yaml", &format!("{k}D: &a [0, 0, 0, 0]\nE: *a\n")) => "cam.yaml:3: an alias";
        ("cam.yaml", &format!("{k}D: [0, 0, 0]\n")) => "cam.yaml:2: \"D\" has 3 numbers", "4, 5, 8, 12 or 14";
        ("cam.yaml", &format!("{k}distortion_model: fov\nD: [0]\n")) =>
            "cam.yaml:2: \"distortion_model\" is \"fov\", which camlux does not know";
        ("cam.yaml", &format!("{k}distortion_model: equidistant\nD: [0, 0, 0, 0, 0]\n")) => "give 4";
        ("cam.yaml", &format!("{k}image_width: 8.5\nimage_height: 6\n")) =>
            "cam.yaml:2: \"image_width\" is 8.5; give a whole number of pixels";
        ("cam.yaml", "K:\n  rows: 3\n  cols: 3\n  data: [1, 2]\n") => "cam.yaml:2: \"K\" has 2 numbers instead of 9";
        ("cam.yaml", "K1: [0]\nK2: [0]\n") => "cam.yaml has 2 cameras; give the name of one: K1, K2";
        ("cam.yaml", &format!("{k}k1: 0.1\nk2: 0.2\n")) => "cam.yaml:2: \"k1\" is a coefficient with a key of its own";
        ("cam.yaml", k) => "scene.toml:1: [camera] has no \"resolution\"";
        ("cam.yaml", &format!("{kalibr}camera_model: omni\n")) => "cam.yaml:3: \"camera_model\" is \"omni\"";
        ("cam.yaml", &format!("{kalibr}T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0]\n")) =>
            "cam.yaml:3: \"T_BS\" does not begin with a rotation";
        ("cam.xml", "<a>") => "cam.xml:1: not valid XML";
        ("cam.xml", "<a>\n</a>") => "cam.xml:1: the root is <a>", "opencv_storage";
        ("cam.xml", "<opencv_storage>\n<K>8 0 4 0 8 3 0 0 y</K></opencv_storage>") => "cam.xml:2: \"K\" holds \"y\"";
        ("cam.txt", "") => "cam.txt is no file of COLMAP by its name";
        ("cam.csv", "") => "is no file with a camera that camlux reads", "transforms.json";
    }
    let deep = "[".repeat(100_000);
    refuses_file(&("cam.yaml", deep), &["cam.yaml:1"]);
    let deep = "<a>".repeat(100_000);
    refuses_file(&("cam.xml", deep), &["cam.xml:1"]);
}

#[test]
fn keys_that_a_file_tells() {
    let folder = SceneFolder::new();
    folder.write("cam.yaml", "resolution: [8, 6]\nintrinsics: [8, 8, 4, 3]\n");
    for (key, says) in [
        (
            "resolution = [8, 6]",
            "\"resolution\" in [camera] comes from the file that path names",
        ),
        (
            "fov_x_deg = 50",
            "\"fov_x_deg\" in [camera] comes from the file",
        ),
        (
            "distortion = [0, 0, 0, 0]",
            "\"distortion\" in [camera] comes from the file",
        ),
        ("position = [0, 0, 0]", "[camera] has no \"look_at\""),
    ] {
        let scene = folder.load(&format!(
            "[camera]\npath = \"cam.yaml\"\n{key}\n{LIGHT}{MESH}"
        ));
        assert_says(&folder.error(scene), &["scene.toml", says]);
    }
}

/// Loads a scene whose camera is an image of these files.
#[track_caller]
fn refuses_colmap((cameras, images): &(&str, &str), parts: &[&str]) {
    let folder = SceneFolder::new();
    folder
        .write("cameras.txt", cameras)
        .write("images.txt", images);
    let scene = folder.load(&format!("[camera]\npath = \"images.txt\"\n{LIGHT}{MESH}"));
    assert_says(&folder.error(scene), parts);
}

#[test]
fn models_of_colmap() {
    let pinhole = "# comment\n1 PINHOLE 8 6 8 8 4 3\n";
    let image = "1 1 0 0 0 0 0 0 1 a.png\n\n";
    rows! { refuses_colmap;
        ("1 FOV 8 6 8 8 4 3 0.1\n", image) => "cameras.txt:1: a camera has the model FOV, which camlux does not know",
            "use one of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE, FULL_OPENCV";
        ("1 MINE 8 6 8\n", image) => "the model MINE";
        ("1 PINHOLE 8 6 8 8 4\n", image) => "cameras.txt:1: a camera has 3 parameters; give the 4 of PINHOLE";
        ("1 PINHOLE 8\n", image) => "cameras.txt:1: a camera is cut short; write CAMERA_ID MODEL";
        ("1 PINHOLE 8 6 8 8 4 nan\n", image) => "\"nan\" is no finite number";
        ("1 PINHOLE 8 -6 8 8 4 3\n", image) => "a camera has 8 x -6 pixels";
        (pinhole, "1 1 0 0 0 0 0 0 2 a.png\n\n") => "images.txt has the image \"a.png\" of camera 2";
        (pinhole, "1 2 0 0 0 0 0 0 1 a.png\n\n") => "images.txt:1: the image \"a.png\" has a quaternion of length 2";
        (pinhole, "#\n\n1 1 0 0 0 0 0 0 1\n") => "images.txt:3: an image is cut short";
        (pinhole, "") => "images.txt has no image";
        (pinhole, "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 0 0 0 1 b.png\n") =>
            "images.txt has 2 images; give the name of one: a.png, b.png";
    }
    let folder = SceneFolder::new();
    for bytes in [
        &[][..],
        &[1],
        &[9, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 7, 0, 0, 0],
    ] {
        folder.write("cameras.bin", bytes);
        let keys = format!("path = \"cameras.bin\"\n{PLACE}");
        let scene = folder.load(&format!("[camera]\n{keys}{LIGHT}{MESH}"));
        assert_says(
            &folder.error(scene),
            &["scene.toml:2: cameras.bin ends too early"],
        );
    }
}

#[test]
fn transforms() {
    let frame = |matrix: &str| {
        format!(
            "{{\"w\": 8, \"h\": 6, \"fl_x\": 8, \"frames\": [\n{{\"file_path\": \"a.png\", \"transform_matrix\": {matrix}}}]}}"
        )
    };
    let identity = "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]";
    #[track_caller]
    fn refuses<T: AsRef<str>>((content, name): &(T, &str), parts: &[&str]) {
        let folder = SceneFolder::new();
        folder.write("transforms.json", content.as_ref());
        let scene = folder.load(&format!(
            "[camera]\npath = \"transforms.json\"\n{name}{LIGHT}{MESH}"
        ));
        assert_says(&folder.error(scene), parts);
    }
    rows! { refuses;
        (frame("[[2,0,0,0],[0,2,0,0],[0,0,2,0]]"), "") =>
            "transforms.json:2: \"transform_matrix\" does not begin with a rotation", "without scale";
        (frame("[1, 2]"), "") => "transforms.json:2: \"transform_matrix\" has 2 numbers";
        (frame(identity), "name = \"b.png\"\n") => "transforms.json has no frame \"b.png\"", "a.png";
        (frame(identity), PLACE) => "\"position\" in [camera] comes from the file";
        (frame(identity).replace("\"fl_x\": 8", "\"k1\": 0.1"), "") => "transforms.json:1: there is no \"fl_x\"";
        (frame(identity).replace("\"fl_x\"", "\"k4\": 1, \"fl_x\""), "") => "\"k4\" is 1", "only a fisheye";
        (frame(identity).replace("\"fl_x\"", "\"camera_model\": \"EQUIRECTANGULAR\", \"fl_x\""), "") =>
            "\"camera_model\" is \"EQUIRECTANGULAR\"";
        ("{\"frames\": 3}", "") => "transforms.json:1: \"frames\" is no list";
    }
}
