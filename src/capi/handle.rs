//! Handles: keys of a table of reference-counted objects, in the form of pointers.

use std::{
    any::Any,
    ptr,
    sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError},
};

use slotmap::{DefaultKey, Key, KeyData, SlotMap};

use super::*;

/// An open Vulkan device. See camlux_device_create.
pub struct camlux_device(());

/// A scene: camera, lights, meshes, materials. See camlux_scene_create.
pub struct camlux_scene(());

/// Renders frames on a device. See camlux_renderer_create.
pub struct camlux_renderer(());

/// A rendered frame. See camlux_renderer_render.
pub struct camlux_frame(());

/// Cancels renders from another thread. See camlux_cancel_token_create.
pub struct camlux_cancel_token(());

/// A render on its own thread. See camlux_renderer_submit.
pub struct camlux_job(());

/// Device memory that other interfaces can import. See camlux_shared_memory_create.
pub struct camlux_shared_memory(());

/// The type that a handle points to in C. Nothing ever reads it.
pub(super) trait Handle {
    const NAME: &'static str;
    /// The object in the table.
    type Object: Any + Send + Sync;
}

macro_rules! handle {
    ($handle:ident, $object:ty) => {
        impl Handle for $handle {
            const NAME: &'static str = stringify!($handle);
            type Object = $object;
        }
    };
}

handle!(camlux_device, DeviceObject);
handle!(camlux_scene, SceneObject);
handle!(camlux_renderer, RendererObject);
handle!(camlux_frame, FrameObject);
handle!(camlux_cancel_token, CancelToken);
handle!(camlux_job, JobObject);
handle!(camlux_shared_memory, crate::SharedMemory);

struct Entry {
    /// The name of its handle type.
    kind: &'static str,
    references: u32,
    object: Arc<dyn Any + Send + Sync>,
}

type Table = SlotMap<DefaultKey, Entry>;

static TABLE: LazyLock<Mutex<Table>> = LazyLock::new(Mutex::default);

fn table() -> MutexGuard<'static, Table> {
    TABLE.lock().unwrap_or_else(PoisonError::into_inner)
}

// A key fills 64 bits.
const _: () = assert!(usize::BITS == 64, "the C interface is for 64-bit machines");

/// The key of a handle, if an object of that kind exists.
fn find<H: Handle>(table: &Table, handle: *mut H) -> Outcome<DefaultKey> {
    let wanted = H::NAME;
    let number = handle.addr() as u64;
    let key = KeyData::from_ffi(number);
    let problem = match table.get(key.into()) {
        _ if number == 0 => format!("the {wanted} is NULL"),
        // `from_ffi` maps small numbers to keys that differ from them.
        _ if key.as_ffi() != number => format!("{number:#x} is not a handle of camlux"),
        None => format!("the {wanted} has been released, or was never created"),
        Some(entry) if entry.kind != wanted => format!("the {wanted} is a {}", entry.kind),
        Some(_) => return Ok(key.into()),
    };
    let message = format!("{problem}; give a {wanted} that was created and not yet released");
    Err(Failure::new(CAMLUX_ERROR_INVALID_HANDLE, message))
}

/// The object of a handle. It stays alive as long as the returned reference.
pub(super) fn get<H: Handle>(handle: *mut H) -> Outcome<Arc<H::Object>> {
    let table = table();
    let object = table[find(&table, handle)?].object.clone().downcast();
    object.map_err(|_| crate::Error::internal("a handle's kind is not its object's").into())
}

/// Writes a new object's handle, with one reference, to the host's memory.
///
/// # Safety
/// As for [`args::write_result`].
pub(super) unsafe fn return_handle<H: Handle>(
    out: *mut *mut H,
    name: &str,
    make: impl FnOnce() -> Outcome<H::Object>,
) -> Outcome {
    // SAFETY: the caller guarantees it.
    unsafe { args::write_result(out, name, || Ok(insert(make()?))) }
}

/// Writes new objects' handles, with one reference each, to the host's array.
///
/// # Safety
/// `out` is null, or misaligned, or points to `count` writable elements.
pub(super) unsafe fn return_handles<H: Handle>(
    out: *mut *mut H,
    name: &str,
    count: usize,
    make: impl FnOnce() -> Outcome<Vec<H::Object>>,
) -> Outcome {
    if count == 0 {
        return Ok(());
    }
    args::check_pointer(out, name)?;
    for (place, object) in make()?.into_iter().take(count).enumerate() {
        // SAFETY: checked above as far as possible; the caller guarantees `count` elements.
        unsafe { out.add(place).write(insert(object)) };
    }
    Ok(())
}

fn insert<H: Handle>(object: H::Object) -> *mut H {
    let entry = Entry {
        kind: H::NAME,
        references: 1,
        object: Arc::new(object),
    };
    let key = table().insert(entry).data();
    ptr::without_provenance_mut(key.as_ffi() as usize)
}

fn retain<H: Handle>(handle: *mut H) -> Outcome {
    let mut table = table();
    let key = find(&table, handle)?;
    let references = &mut table[key].references;
    *references = references.checked_add(1).ok_or_else(|| {
        let (name, most) = (H::NAME, u32::MAX);
        Failure::argument(format!(
            "the {name} has {most} references already; release some"
        ))
    })?;
    Ok(())
}

fn release<H: Handle>(handle: *mut H) -> Outcome {
    if handle.is_null() {
        return Ok(());
    }
    let mut table = table();
    let key = find(&table, handle)?;
    table[key].references -= 1;
    let last = match table[key].references {
        0 => table.remove(key),
        _ => None,
    };
    drop(table);
    // Closing a device takes time; other threads must not wait for the table meanwhile.
    drop(last);
    Ok(())
}

/// The number of handles of this process, of every kind, that were created and not yet released. It is 0 at the end of a program
/// that has released everything.
///
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT if count is NULL.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_handle_count(count: *mut u32) -> camlux_status {
    ffi_guard("camlux_handle_count", || {
        let live = || Ok(table().len() as u32);
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(count, "count", live) }
    })
}

/// Adds a reference to a device.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_retain(device: *mut camlux_device) -> camlux_status {
    ffi_guard("camlux_device_retain", || retain(device))
}

/// Removes a reference to a device. The last release ends the handle. The device itself is closed once its renderers
/// are gone, too.
///
/// \param device NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_release(device: *mut camlux_device) -> camlux_status {
    ffi_guard("camlux_device_release", || release(device))
}

/// Adds a reference to a scene.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_retain(scene: *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_retain", || retain(scene))
}

/// Removes a reference to a scene. The last release frees it. Renders of it that are running are not affected.
///
/// \param scene NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_release(scene: *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_release", || release(scene))
}

/// Adds a reference to a renderer.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_retain(renderer: *mut camlux_renderer) -> camlux_status {
    ffi_guard("camlux_renderer_retain", || retain(renderer))
}

/// Removes a reference to a renderer. The last release frees it; a render that is running on it ends first.
///
/// \param renderer NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_release(renderer: *mut camlux_renderer) -> camlux_status {
    ffi_guard("camlux_renderer_release", || release(renderer))
}

/// Adds a reference to a frame.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_retain(frame: *mut camlux_frame) -> camlux_status {
    ffi_guard("camlux_frame_retain", || retain(frame))
}

/// Removes a reference to a frame. The last release frees it, and pointers from camlux_frame_view and similar functions become
/// invalid.
///
/// \param frame NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_release(frame: *mut camlux_frame) -> camlux_status {
    ffi_guard("camlux_frame_release", || release(frame))
}

/// Adds a reference to a cancel token.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_retain(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_retain", || retain(token))
}

/// Removes a reference to a cancel token. The last release frees it. Renders that are running with it keep it.
///
/// \param token NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_release(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_release", || release(token))
}

/// Adds a reference to a job.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_job_retain(job: *mut camlux_job) -> camlux_status {
    ffi_guard("camlux_job_retain", || retain(job))
}

/// Removes a reference to a job. The last release frees it; if its render is running, it is cancelled, and ends first.
///
/// \param job NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_job_release(job: *mut camlux_job) -> camlux_status {
    ffi_guard("camlux_job_release", || release(job))
}

/// Adds a reference to shared memory.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_shared_memory_retain(memory: *mut camlux_shared_memory) -> camlux_status {
    ffi_guard("camlux_shared_memory_retain", || retain(memory))
}

/// Removes a reference to shared memory. The last release frees it; what others have imported stays valid for them.
///
/// \param memory NULL: the call does nothing.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_shared_memory_release(memory: *mut camlux_shared_memory) -> camlux_status {
    ffi_guard("camlux_shared_memory_release", || release(memory))
}
