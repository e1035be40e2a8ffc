//! `camlux render` on the devices that it is told to use, and on none.

use std::{fs, process::Command};

use crate::program::{assert_succeeds, program, run, scene_file, stdout};
use crate::render::{assert_fails, channels, read, render};
use crate::rows::assert_says;
use camlux::{Device, DeviceOptions};

#[test]
fn a_tracer_is_forced() {
    let folder = tempfile::tempdir().unwrap();
    let more = [
        "--estimator",
        "final-gather",
        "--plan",
        "--tracer",
        "kernel",
    ];
    let plan = assert_succeeds(&render(folder.path(), "cornell", &more));
    assert!(plan.contains("trace      by kernel, up to"), "{plan}");
}

#[test]
fn a_device_is_picked_by_index_or_part_of_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let info = run(folder.path(), &["info"]);
    assert_eq!(info.status.code(), Some(0));
    assert!(info.stderr.is_empty());
    let info = stdout(&info);
    assert_says(
        &info,
        &[
            "usable",
            "driver",
            "largest image",
            "storage buffer",
            "default: ",
        ],
    );
    let (_, chosen) = info.split_once("default: ").unwrap();
    let (index, name) = chosen.trim().split_once(' ').unwrap();
    let loud = name.to_uppercase();
    let (_, uuid) = info.split_once("UUID").unwrap();
    let uuid = uuid.split_whitespace().next().unwrap();
    for device in [index, name, &loud[..name.len() - 1], uuid] {
        let stderr = assert_succeeds(&render(
            folder.path(),
            "cornell",
            &["-v", "--device", device],
        ));
        assert!(stderr.contains(name), "{stderr}");
        fs::remove_file(folder.path().join("a.exr")).unwrap();
    }
    for (device, problem) in [
        ("99", "there is no device 99"),
        ("voodoo", "no device is called \"voodoo\""),
        ("ff:1f.7", "no device is at the PCI address ff:1f.7"),
    ] {
        let output = render(folder.path(), "cornell", &["--device", device]);
        assert_fails(
            folder.path(),
            &output,
            &[problem, "choose one of: 0 \"", name],
        );
    }
    let scene = scene_file("cornell");
    let arguments = ["render", scene.to_str().unwrap(), "-o", "a.exr"];
    let mut command = program(folder.path(), &arguments);
    command.env("CAMLUX_DEVICE", "voodoo");
    let says = "CAMLUX_DEVICE is \"voodoo\": no device is called";
    assert_fails(folder.path(), &command.output().unwrap(), &[says]);
}

#[test]
fn without_a_driver_it_says_what_to_install() {
    let folder = tempfile::tempdir().unwrap();
    let without_driver = |command: &mut Command| {
        // The newer and the older name of the loader's variable.
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(variable, folder.path().join("none.json"));
        }
        command.output().unwrap()
    };
    let says = ["no driver", "apt-get install", "mesa-vulkan-drivers"];
    let scene = scene_file("cornell");
    let arguments = ["render", scene.to_str().unwrap(), "-o", "a.exr"];
    let output = without_driver(&mut program(folder.path(), &arguments));
    assert_fails(folder.path(), &output, &says);
    assert!(output.stdout.is_empty());

    let output = without_driver(&mut program(folder.path(), &["info"]));
    assert_eq!(output.status.code(), Some(1));
    let stdout = stdout(&output);
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    for part in says {
        assert!(stdout.contains(part), "{part:?} is missing in: {stdout}");
    }
}

#[test]
fn an_image_over_the_devices_limits_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_file("cornell");
    let scene = scene.to_str().unwrap();
    let refused = |[width, height]: [&str; 2], says: &[&str]| {
        let arguments = ["render", scene, "-o", "a.exr", "--size", width, height];
        let output = run(folder.path(), &arguments);
        assert_fails(folder.path(), &output, says);
    };
    refused(
        ["300000", "4"],
        &["300000", "over the limit", "smaller image"],
    );
    // Images of 4 GiB are over the limit of one allocation, or do not fit in memory.
    let device = Device::open(&DeviceOptions::default()).unwrap();
    let limits = &device.info().limits;
    if limits.memory_bytes < 28 << 30 || limits.max_allocation_bytes < 4 << 30 {
        let says = ["(bytes) is", "over the limit of", "smaller image"];
        refused(["16384", "16384"], &says);
    }
}

/// The image does not depend on the number of threads. The driver reads that number when it is loaded.
#[test]
fn threads_do_not_show() {
    let ways: [(&str, &[&str]); 5] = [
        ("cornell", &["rsm-average"]),
        ("cornell", &["instant-radiosity"]),
        ("glossy", &["rsm-average"]),
        ("glossy", &["instant-radiosity"]),
        ("glossy", &["final-gather", "--target-error", "0.1"]),
    ];
    for (name, estimator) in ways {
        let folder = tempfile::tempdir().unwrap();
        // A CPU may have fewer cores than threads. The scheduler then interrupts the threads at different points in each run.
        let images = ["1", "2", "4"].map(|threads| {
            let scene = scene_file(name);
            let arguments = ["render", scene.to_str().unwrap(), "-o", "a.exr"];
            let output = program(folder.path(), &arguments)
                .args(["--size", "64", "64", "--rsm-size", "24", "--estimator"])
                .args(estimator)
                .env("LP_NUM_THREADS", threads)
                .output()
                .unwrap();
            assert_succeeds(&output);
            channels(&read(&folder.path().join("a.exr")))
        });
        let of_one_thread = &images[0];
        let is_lit = of_one_thread.iter().any(|(name, samples)| {
            name == "indirect.G" && samples.values_as_f32().any(|value| value > 0.0)
        });
        assert!(is_lit, "a black image proves nothing");
        assert!(
            images.iter().all(|image| image == of_one_thread),
            "{name}, {estimator:?}"
        );
    }
}
