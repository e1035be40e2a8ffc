//! Reads an input and asserts that there is no panic, no hang, and no more memory than its bound allows.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

use camlux::{DeviceInfo, DeviceKind, DeviceLimits, Error, Plan, Scene, output::Layer};
use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

/// A thousand times the duration of the slowest input on an idle machine. A longer read counts as a hang.
const TIME_LIMIT: Duration = Duration::from_secs(30);

/// The memory that an input may take.
#[derive(Clone, Copy)]
pub struct Bound {
    pub constant_bytes: usize,
    /// Bytes of memory per byte of input.
    pub factor: usize,
}

/// The bound of a text, twice the worst that was found. A bracket of TOML is a token and an event of 100 bytes together. An OBJ face with its
/// own group takes 74 bytes per byte.
pub const TEXT: Bound = Bound {
    constant_bytes: 1 << 20,
    factor: 200,
};

/// The allocator counts for the whole process, so only one input is read at a time.
static TURN: Mutex<()> = Mutex::new(());
static RUNNING: Mutex<Option<Running>> = Mutex::new(None);

struct Running {
    kind: &'static str,
    input: Vec<u8>,
    since: Instant,
}

/// Blocks the other tests while one measures.
pub fn take_turn() -> MutexGuard<'static, ()> {
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `read` on an input of this kind. If it fails, the input is kept in a file that the message names.
pub fn judge<T>(
    kind: &'static str,
    input: &[u8],
    bound: Bound,
    read: impl FnOnce(&[u8]) -> T,
) -> T {
    watch();
    // The names of layers are made once, whatever the input is.
    Layer::Radiance.name();
    let since = Instant::now();
    let running = Running {
        kind,
        input: input.to_vec(),
        since,
    };
    *lock_running() = Some(running);
    let before_bytes = ALLOCATOR.current_usage();
    ALLOCATOR.reset_peak_usage();
    let outcome = catch_unwind(AssertUnwindSafe(|| read(input)));
    let peak_bytes = ALLOCATOR.peak_usage().saturating_sub(before_bytes);
    *lock_running() = None;
    let outcome = outcome.unwrap_or_else(|_| fail(kind, input, "a panic, see above"));
    let most_bytes = bound.constant_bytes + bound.factor * input.len();
    if peak_bytes > most_bytes {
        let input_bytes = input.len();
        fail(
            kind,
            input,
            &format!("{peak_bytes} bytes for an input of {input_bytes}, {most_bytes} at most"),
        );
    }
    outcome
}

fn lock_running() -> MutexGuard<'static, Option<Running>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the process when an input takes too long: a thread that hangs cannot be stopped otherwise.
fn watch() {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        std::thread::spawn(|| {
            loop {
                std::thread::sleep(Duration::from_millis(500));
                if let Some(running) = &*lock_running()
                    && running.since.elapsed() > TIME_LIMIT
                {
                    let file = keep(running.kind, &running.input);
                    eprintln!("a hang; the input is {}", file.display());
                    std::process::exit(1);
                }
            }
        });
    });
}

fn fail(kind: &str, input: &[u8], problem: &str) -> ! {
    let file = keep(kind, input);
    panic!("{problem}; the input is {}", file.display())
}

fn keep(kind: &str, input: &[u8]) -> PathBuf {
    let name = format!("camlux-fuzzed-{}-{kind}", std::process::id());
    let file = std::env::temp_dir().join(name);
    let _ = std::fs::write(&file, input);
    file
}

/// Asserts that a loaded scene is valid, and that each error is one readable line. Returns whether the scene loaded.
pub fn check_scene(loaded: camlux::Result<Scene>) -> bool {
    match &loaded {
        Ok(scene) => {
            scene.validate().expect("what loads is valid");
            assert_eq!(scene.hash().len(), 64);
            scene.warnings();
            match Plan::new(scene, &device()) {
                Ok(plan) => assert!(plan.to_string().starts_with("passes")),
                Err(error) => check_message(&error),
            }
        }
        Err(error) => {
            assert!(matches!(error, Error::Scene { .. }), "{error:?}");
            check_message(error);
        }
    }
    loaded.is_ok()
}

pub fn check_message(error: &Error) {
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "{message:?}");
    // Two parts of about a thousand characters, and the place: the names of folders, the file and a part of the scene.
    assert!(message.chars().count() < 10_000, "{message:?}");
}

/// A device with lavapipe's limits.
pub fn device() -> DeviceInfo {
    DeviceInfo {
        index: 0,
        name: "none".into(),
        uuid: String::new(),
        pci: None,
        kind: DeviceKind::Cpu,
        driver: String::new(),
        api_version: "1.3".into(),
        has_ray_query: false,
        limits: DeviceLimits {
            max_image_px: 16_384,
            max_image_layers: 2048,
            max_storage_buffer_bytes: 128 << 20,
            max_allocation_bytes: 2 << 30,
            max_buffer_bytes: 2 << 30,
            memory_bytes: 16 << 30,
            max_storage_images: 64,
            shared_memory_bytes: 32 << 10,
            subgroup_lanes: 8,
            broadcast_lanes: Some(8),
            sub_pixel_bits: 8,
            timestamp_period_ns: Some(1.0),
        },
        quirks: Default::default(),
        unusable: None,
    }
}
