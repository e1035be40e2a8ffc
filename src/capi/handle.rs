//! Handles: numbers of a table of counted objects.

use std::{
    ptr,
    sync::{
        Arc, PoisonError, RwLock,
        atomic::{AtomicU32, Ordering},
    },
};

use super::{
    args,
    device::DeviceObject,
    frame::FrameObject,
    renderer::RendererObject,
    scene::SceneObject,
    status::{CAMLUX_ERROR_INVALID_HANDLE, Failure, Outcome, camlux_status, entry},
};

/// An open Vulkan device. See camlux_device_create.
pub struct camlux_device {
    _opaque: (),
}

/// What is lit: camera, lights, meshes, materials. See camlux_scene_create.
pub struct camlux_scene {
    _opaque: (),
}

/// Renders frames on a device. See camlux_renderer_create.
pub struct camlux_renderer {
    _opaque: (),
}

/// A rendered frame. See camlux_renderer_render.
pub struct camlux_frame {
    _opaque: (),
}

/// A value that the host knows by a handle.
pub(super) trait Object: Send + Sync + Sized {
    type Handle;
    const KIND: Kind;
    fn into_any(this: Arc<Self>) -> Any;
    fn from_any(any: &Any) -> Option<&Arc<Self>>;
}

/// In a handle's upper bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Device = 1,
    Scene = 2,
    Renderer = 3,
    Frame = 4,
}

/// An object of any kind.
#[derive(Clone)]
pub(super) enum Any {
    Device(Arc<DeviceObject>),
    Scene(Arc<SceneObject>),
    Renderer(Arc<RendererObject>),
    Frame(Arc<FrameObject>),
}

impl Kind {
    const ALL: [Kind; 4] = [Kind::Device, Kind::Scene, Kind::Renderer, Kind::Frame];

    fn name(self) -> &'static str {
        match self {
            Kind::Device => "camlux_device",
            Kind::Scene => "camlux_scene",
            Kind::Renderer => "camlux_renderer",
            Kind::Frame => "camlux_frame",
        }
    }
}

macro_rules! object {
    ($kind:ident, $object:ty, $handle:ty) => {
        impl Object for $object {
            type Handle = $handle;
            const KIND: Kind = Kind::$kind;

            fn into_any(this: Arc<Self>) -> Any {
                Any::$kind(this)
            }

            fn from_any(any: &Any) -> Option<&Arc<Self>> {
                match any {
                    Any::$kind(object) => Some(object),
                    _ => None,
                }
            }
        }
    };
}

object!(Device, DeviceObject, camlux_device);
object!(Scene, SceneObject, camlux_scene);
object!(Renderer, RendererObject, camlux_renderer);
object!(Frame, FrameObject, camlux_frame);

const SLOT_BITS: u32 = 32;
const GENERATION_BITS: u32 = 28;
const LAST_GENERATION: u32 = (1 << GENERATION_BITS) - 1;
// A handle's number fills 64 bits.
const _: () = assert!(usize::BITS == 64, "the C interface is for 64-bit machines");

/// The number that a handle is.
#[derive(Clone, Copy)]
struct Id {
    kind: usize,
    generation: u32,
    slot: u32,
}

impl Id {
    fn of(number: usize) -> Id {
        Id {
            kind: number >> (SLOT_BITS + GENERATION_BITS),
            generation: (number >> SLOT_BITS) as u32 & LAST_GENERATION,
            slot: number as u32,
        }
    }

    fn number(self) -> usize {
        self.kind << (SLOT_BITS + GENERATION_BITS)
            | (self.generation as usize) << SLOT_BITS
            | self.slot as usize
    }
}

/// A place of the table. Its generation tells the handles that it has had apart.
struct Slot {
    generation: u32,
    references: AtomicU32,
    object: Option<Any>,
}

struct Table {
    slots: Vec<Slot>,
    free: Vec<u32>,
}

static TABLE: RwLock<Table> = RwLock::new(Table {
    slots: Vec::new(),
    free: Vec::new(),
});

impl Table {
    /// The slot of a handle, if the object of that kind is still there.
    fn find<T: Object>(&self, number: usize) -> Outcome<&Slot> {
        let id = Id::of(number);
        let wanted = T::KIND.name();
        let wrong = |problem: String| {
            Err(Failure {
                status: CAMLUX_ERROR_INVALID_HANDLE,
                message: format!(
                    "{problem}; give a {wanted} that was created and not yet released"
                ),
            })
        };
        if number == 0 {
            return wrong(format!("the {wanted} is NULL"));
        }
        if id.kind != T::KIND as usize {
            return match Kind::ALL.into_iter().find(|kind| *kind as usize == id.kind) {
                Some(kind) => wrong(format!("the {wanted} is a {}", kind.name())),
                None => wrong(format!("{number:#x} is no handle of camlux")),
            };
        }
        let slot = self.slots.get(id.slot as usize);
        match slot.filter(|slot| slot.generation == id.generation && slot.object.is_some()) {
            Some(slot) => Ok(slot),
            None => wrong(format!("the {wanted} has been released")),
        }
    }
}

/// The object of a handle, which stays alive as long as what is returned.
pub(super) fn get<T: Object>(handle: *mut T::Handle) -> Outcome<Arc<T>> {
    let table = TABLE.read().unwrap_or_else(PoisonError::into_inner);
    let slot = table.find::<T>(handle.addr())?;
    let object = slot.object.as_ref().and_then(T::from_any).cloned();
    object.ok_or_else(|| crate::Error::internal("a handle's kind is not its object's").into())
}

/// A new handle, with one reference.
pub(super) fn insert<T: Object>(object: T) -> *mut T::Handle {
    let object = Some(T::into_any(Arc::new(object)));
    let mut table = TABLE.write().unwrap_or_else(PoisonError::into_inner);
    let slot = match table.free.pop() {
        Some(index) => {
            let slot = &mut table.slots[index as usize];
            slot.generation += 1;
            slot.references = AtomicU32::new(1);
            slot.object = object;
            index
        }
        None => {
            table.slots.push(Slot {
                generation: 0,
                references: AtomicU32::new(1),
                object,
            });
            (table.slots.len() - 1) as u32
        }
    };
    let id = Id {
        kind: T::KIND as usize,
        generation: table.slots[slot as usize].generation,
        slot,
    };
    ptr::without_provenance_mut(id.number())
}

/// A new object's handle at the place that the host has given.
///
/// # Safety
/// As for [`args::check_out`].
pub(super) unsafe fn hand_out<T: Object>(
    make: impl FnOnce() -> Outcome<T>,
    out: *mut *mut T::Handle,
    name: &str,
) -> Outcome {
    args::check_out(out, name)?;
    let handle = insert(make()?);
    // SAFETY: checked above as far as can be; the rest is the caller's word.
    unsafe { out.write(handle) };
    Ok(())
}

fn retain<T: Object>(handle: *mut T::Handle) -> Outcome {
    let table = TABLE.read().unwrap_or_else(PoisonError::into_inner);
    let references = &table.find::<T>(handle.addr())?.references;
    let counted = references.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
        count.checked_add(1)
    });
    match counted {
        Ok(_) => Ok(()),
        Err(_) => Err(Failure::argument(format!(
            "the {} has {} references already; release some",
            T::KIND.name(),
            u32::MAX
        ))),
    }
}

fn release<T: Object>(handle: *mut T::Handle) -> Outcome {
    if handle.is_null() {
        return Ok(());
    }
    let mut table = TABLE.write().unwrap_or_else(PoisonError::into_inner);
    let references = &table.find::<T>(handle.addr())?.references;
    if references.fetch_sub(1, Ordering::Relaxed) > 1 {
        return Ok(());
    }
    let index = Id::of(handle.addr()).slot;
    let slot = &mut table.slots[index as usize];
    let object = slot.object.take();
    // A slot whose numbers are used up stays empty.
    if slot.generation < LAST_GENERATION {
        table.free.push(index);
    }
    drop(table);
    // A device takes its time to go: not while others wait for the table.
    drop(object);
    Ok(())
}

/// The number of handles of this process that were created and not yet released, of every kind: 0 at the end of a program
/// that has released all it made.
///
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT where count is NULL.
/// \threads any.
///
/// # Safety
/// `count` is NULL or points to a writable uint32_t.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_handle_count(count: *mut u32) -> camlux_status {
    entry("camlux_handle_count", || {
        args::check_out(count, "count")?;
        let table = TABLE.read().unwrap_or_else(PoisonError::into_inner);
        let live = table.slots.iter().filter(|slot| slot.object.is_some());
        // SAFETY: checked above as far as can be; the rest is the caller's word.
        unsafe { count.write(live.count() as u32) };
        Ok(())
    })
}

/// Counts one more owner of a device.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_retain(device: *mut camlux_device) -> camlux_status {
    entry("camlux_device_retain", || retain::<DeviceObject>(device))
}

/// Counts one owner of a device less. With the last one its handle ends; the device itself is closed once its renderers
/// are gone, too.
///
/// \param device NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_device_release(device: *mut camlux_device) -> camlux_status {
    entry("camlux_device_release", || release::<DeviceObject>(device))
}

/// Counts one more owner of a scene.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_retain(scene: *mut camlux_scene) -> camlux_status {
    entry("camlux_scene_retain", || retain::<SceneObject>(scene))
}

/// Counts one owner of a scene less, and frees it with the last one. Renders of it that are under way are not disturbed.
///
/// \param scene NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_scene_release(scene: *mut camlux_scene) -> camlux_status {
    entry("camlux_scene_release", || release::<SceneObject>(scene))
}

/// Counts one more owner of a renderer.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_retain(renderer: *mut camlux_renderer) -> camlux_status {
    entry("camlux_renderer_retain", || {
        retain::<RendererObject>(renderer)
    })
}

/// Counts one owner of a renderer less, and frees it with the last one. A render that is under way on it ends first.
///
/// \param renderer NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_renderer_release(renderer: *mut camlux_renderer) -> camlux_status {
    entry("camlux_renderer_release", || {
        release::<RendererObject>(renderer)
    })
}

/// Counts one more owner of a frame.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_retain(frame: *mut camlux_frame) -> camlux_status {
    entry("camlux_frame_retain", || retain::<FrameObject>(frame))
}

/// Counts one owner of a frame less, and frees it with the last one: what camlux_frame_view and the like have pointed to is
/// gone then.
///
/// \param frame NULL is fine: nothing happens.
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_frame_release(frame: *mut camlux_frame) -> camlux_status {
    entry("camlux_frame_release", || release::<FrameObject>(frame))
}
