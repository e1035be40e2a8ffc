//! Handles: keys of a table of counted objects, in the form of pointers.

use std::{
    any::Any,
    ptr,
    sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError},
};

use slotmap::{DefaultKey, Key, KeyData, SlotMap};

use super::*;

/// An open Vulkan device. See camlux_device_create.
pub struct camlux_device(());

/// What is lit: camera, lights, meshes, materials. See camlux_scene_create.
pub struct camlux_scene(());

/// Renders frames on a device. See camlux_renderer_create.
pub struct camlux_renderer(());

/// A rendered frame. See camlux_renderer_render.
pub struct camlux_frame(());

/// Ends renders from another thread. See camlux_cancel_token_create.
pub struct camlux_cancel_token(());

/// A render under way. See camlux_renderer_submit.
pub struct camlux_job(());

/// Memory of a device that other interfaces import. See camlux_shared_memory_create.
pub struct camlux_shared_memory(());

/// What a handle points to in C, which nothing ever does.
pub(super) trait Handle {
    const NAME: &'static str;
    /// What the table has for it.
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
    /// The name of its handle.
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

/// The key of a handle, if the object of that kind is still there.
fn find<H: Handle>(table: &Table, handle: *mut H) -> Outcome<DefaultKey> {
    let wanted = H::NAME;
    let number = handle.addr() as u64;
    let key = KeyData::from_ffi(number);
    let problem = match table.get(key.into()) {
        _ if number == 0 => format!("the {wanted} is NULL"),
        // Small numbers are taken for keys that they are not.
        _ if key.as_ffi() != number => format!("{number:#x} is no handle of camlux"),
        None => format!("the {wanted} has been released, or never was one"),
        Some(entry) if entry.kind != wanted => format!("the {wanted} is a {}", entry.kind),
        Some(_) => return Ok(key.into()),
    };
    let message = format!("{problem}; give a {wanted} that was created and not yet released");
    Err(Failure::new(CAMLUX_ERROR_INVALID_HANDLE, message))
}

/// The object of a handle, which stays alive as long as what is returned.
pub(super) fn get<H: Handle>(handle: *mut H) -> Outcome<Arc<H::Object>> {
    let table = table();
    let object = table[find(&table, handle)?].object.clone().downcast();
    object.map_err(|_| crate::Error::internal("a handle's kind is not its object's").into())
}

/// A new object's handle, with one reference, at the place that the host has given.
///
/// # Safety
/// As for [`args::write_result`].
pub(super) unsafe fn return_handle<H: Handle>(
    out: *mut *mut H,
    name: &str,
    make: impl FnOnce() -> Outcome<H::Object>,
) -> Outcome {
    // SAFETY: the caller's word.
    unsafe { args::write_result(out, name, || Ok(insert(make()?))) }
}

/// New objects' handles, with one reference each, in the array that the host has given.
///
/// # Safety
/// `out` is null, or misaligned, or points to `count` places that are writable.
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
        // SAFETY: checked above as far as can be; that there are as many is the caller's word.
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
    // A device takes its time to go: not while others wait for the table.
    drop(last);
    Ok(())
}

/// The number of handles of this process that were created and not yet released, of every kind: 0 at the end of a program
/// that has released all it made.
///
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT where count is NULL.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_handle_count(count: *mut u32) -> camlux_status {
    ffi_guard("camlux_handle_count", || {
        let live = || Ok(table().len() as u32);
        // SAFETY: the caller's word.
        unsafe { args::write_result(count, "count", live) }
    })
}

/// Counts one more owner of a device.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_retain(device: *mut camlux_device) -> camlux_status {
    ffi_guard("camlux_device_retain", || retain(device))
}

/// Counts one owner of a device less. With the last one its handle ends; the device itself is closed once its renderers
/// are gone, too.
///
/// \param device NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_release(device: *mut camlux_device) -> camlux_status {
    ffi_guard("camlux_device_release", || release(device))
}

/// Counts one more owner of a scene.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_retain(scene: *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_retain", || retain(scene))
}

/// Counts one owner of a scene less, and frees it with the last one. Renders of it that are under way are not disturbed.
///
/// \param scene NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_release(scene: *mut camlux_scene) -> camlux_status {
    ffi_guard("camlux_scene_release", || release(scene))
}

/// Counts one more owner of a renderer.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_retain(renderer: *mut camlux_renderer) -> camlux_status {
    ffi_guard("camlux_renderer_retain", || retain(renderer))
}

/// Counts one owner of a renderer less, and frees it with the last one. A render that is under way on it ends first.
///
/// \param renderer NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_release(renderer: *mut camlux_renderer) -> camlux_status {
    ffi_guard("camlux_renderer_release", || release(renderer))
}

/// Counts one more owner of a frame.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_retain(frame: *mut camlux_frame) -> camlux_status {
    ffi_guard("camlux_frame_retain", || retain(frame))
}

/// Counts one owner of a frame less, and frees it with the last one: what camlux_frame_view and the like have pointed to is
/// gone then.
///
/// \param frame NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_release(frame: *mut camlux_frame) -> camlux_status {
    ffi_guard("camlux_frame_release", || release(frame))
}

/// Counts one more owner of a cancel token.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_retain(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_retain", || retain(token))
}

/// Counts one owner of a cancel token less, and frees it with the last one. Renders that are under way with it keep it.
///
/// \param token NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_release(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_release", || release(token))
}

/// Counts one more owner of a job.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_job_retain(job: *mut camlux_job) -> camlux_status {
    ffi_guard("camlux_job_retain", || retain(job))
}

/// Counts one owner of a job less, and frees it with the last one. A render that is under way is cancelled then, and ends first.
///
/// \param job NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_job_release(job: *mut camlux_job) -> camlux_status {
    ffi_guard("camlux_job_release", || release(job))
}

/// Counts one more owner of shared memory.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_shared_memory_retain(memory: *mut camlux_shared_memory) -> camlux_status {
    ffi_guard("camlux_shared_memory_retain", || retain(memory))
}

/// Counts one owner of shared memory less. With the last one camlux frees it; what others have imported stays theirs.
///
/// \param memory NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_shared_memory_release(memory: *mut camlux_shared_memory) -> camlux_status {
    ffi_guard("camlux_shared_memory_release", || release(memory))
}
