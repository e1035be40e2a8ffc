//! A device of the host. The tests act as the host: they create a device, lend it to camlux and read a frame's image on it.

use std::{
    ffi::c_void,
    sync::{
        Arc, Mutex,
        atomic::{AtomicI64, Ordering::SeqCst},
    },
};

use ash::{ext, khr, vk};

use crate::common::gpu::demo_scene;
use crate::common::rows::assert_says;
use camlux::{
    Device, DeviceChoice, DeviceFrame, DeviceImage, DeviceKind, DeviceOptions, HostVulkan,
    QueueLock, Renderer, Scene, SharedMemory, SharedMemoryInfo,
    output::Layer,
    scene::{IndirectLight, VplSum},
};

/// Features that the host enables.
#[derive(Clone, Copy)]
struct Made {
    features: bool,
    timeline: bool,
}

const ALL: Made = Made {
    features: true,
    timeline: true,
};

struct Host {
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    device: ash::Device,
    queue: vk::Queue,
    family: u32,
}

/// Called by the validation layer.
unsafe extern "system" fn keep_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and the list that the messenger was created with.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().expect("a message");
        (text, &*messages.cast::<Mutex<Vec<String>>>())
    };
    let text = text.to_string_lossy().into_owned();
    messages.lock().expect("no panic before").push(text);
    vk::FALSE
}

impl Host {
    /// Creates the host's instance under the validation layer, and its device, and passes them to `use_it` in the form that camlux takes.
    fn with<T>(made: Made, use_it: impl FnOnce(&Host, HostVulkan) -> T) -> T {
        let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
        let messages: Mutex<Vec<String>> = Mutex::default();
        let mut messenger = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                    | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(keep_message))
            .user_data(std::ptr::from_ref(&messages).cast_mut().cast());
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let extensions = [
            ext::debug_utils::NAME.as_ptr(),
            ext::validation_features::NAME.as_ptr(),
        ];
        let info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions)
            .push_next(&mut features);
        // SAFETY (all of it): arguments live until after the call, and destroyed objects are not used again.
        let entry = unsafe { ash::Entry::load() }.expect("scripts/test installs the loader");
        let instance = unsafe { entry.create_instance(&info, None) };
        let instance = instance.expect("scripts/test installs a driver and the layer");
        let debug = ext::debug_utils::Instance::new(&entry, &instance);
        messenger.p_next = std::ptr::null();
        let messenger = unsafe { debug.create_debug_utils_messenger(&messenger, None) };
        let messenger = messenger.expect("the messenger is made");
        let result = Host::with_device(&entry, instance.clone(), made, use_it);
        unsafe {
            debug.destroy_debug_utils_messenger(messenger, None);
            instance.destroy_instance(None);
        }
        let messages = messages.into_inner().expect("no panic before");
        assert!(messages.is_empty(), "{messages:#?}");
        result
    }

    fn with_device<T>(
        entry: &ash::Entry,
        instance: ash::Instance,
        made: Made,
        use_it: impl FnOnce(&Host, HostVulkan) -> T,
    ) -> T {
        let list = Device::list().expect("there are devices");
        let chosen = DeviceChoice::default()
            .among(&list)
            .expect("one can be used");
        // SAFETY: the instance is live, and the physical device belongs to it.
        let (physical, families) = unsafe {
            let found = instance.enumerate_physical_devices();
            let physical = found.expect("there are devices")[chosen.index];
            let families = instance.get_physical_device_queue_family_properties(physical);
            (physical, families)
        };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let family = families
            .iter()
            .position(|family| family.queue_flags.contains(wanted));
        let family = family.expect("it has a queue") as u32;
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(family)
            .queue_priorities(&[1.0])];
        let mut features12 = vk::PhysicalDeviceTimelineSemaphoreFeatures::default()
            .timeline_semaphore(made.timeline);
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(made.features)
            .synchronization2(made.features);
        let extensions = [khr::external_memory_fd::NAME.as_ptr()];
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut features12)
            .push_next(&mut features13);
        // SAFETY: everything that the info points to lives until after the call.
        let device = unsafe { instance.create_device(physical, &info, None) };
        let device = device.expect("the device is made");
        // SAFETY: one queue of this family was requested.
        let queue = unsafe { device.get_device_queue(family, 0) };
        let lent = HostVulkan {
            get_instance_proc_addr: entry.static_fn().get_instance_proc_addr,
            instance: instance.handle(),
            physical_device: physical,
            device: device.handle(),
            device_create_info: std::ptr::from_ref(&info).cast(),
            queue,
            queue_family: family,
            queue_lock: None,
        };
        let host = Host {
            instance,
            physical,
            device,
            queue,
            family,
        };
        let result = use_it(&host, lent);
        // SAFETY: everything created from the device has been destroyed.
        unsafe { host.device.destroy_device(None) };
        result
    }

    /// Copies an image to the host's memory with the host's own commands, after the semaphore is signalled.
    fn read(&self, image: DeviceImage, (semaphore, value): (vk::Semaphore, u64)) -> Vec<f32> {
        let device = &self.device;
        let [width, height] = image.size_px;
        let waits = [vk::SemaphoreSubmitInfo::default()
            .semaphore(semaphore)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)];
        self.copy_to_host(
            u64::from(width * height * 16),
            &waits,
            |commands, buffer| {
                let region = vk::BufferImageCopy::default()
                    .image_subresource(vk::ImageSubresourceLayers {
                        aspect_mask: vk::ImageAspectFlags::COLOR,
                        layer_count: 1,
                        ..Default::default()
                    })
                    .image_extent(vk::Extent3D {
                        width,
                        height,
                        depth: 1,
                    });
                let turn = |from, to| {
                    let barriers = [vk::ImageMemoryBarrier2::default()
                        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                        .dst_access_mask(vk::AccessFlags2::MEMORY_READ)
                        .old_layout(from)
                        .new_layout(to)
                        .image(image.image)
                        .subresource_range(vk::ImageSubresourceRange {
                            aspect_mask: vk::ImageAspectFlags::COLOR,
                            level_count: 1,
                            layer_count: 1,
                            ..Default::default()
                        })];
                    let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
                    // SAFETY: the commands are being recorded.
                    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
                };
                let (kept, best) = (
                    vk::ImageLayout::GENERAL,
                    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                );
                turn(kept, best);
                // SAFETY: as above; the buffer has room for the image.
                unsafe {
                    device.cmd_copy_image_to_buffer(commands, image.image, best, buffer, &[region]);
                }
                // The host must restore the layout.
                turn(best, kept);
            },
        )
    }

    /// Imports memory of another instance, and copies it to the host's memory.
    fn read_shared(&self, fd: i32, info: SharedMemoryInfo) -> Vec<f32> {
        let device = &self.device;
        let handle = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;
        let bytes = info.allocation_bytes;
        // SAFETY (all of it): the objects are created here from the live device, used in order, and destroyed when the queue is idle.
        unsafe {
            let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(handle);
            let create = vk::BufferCreateInfo::default()
                .size(bytes)
                .usage(
                    vk::BufferUsageFlags::TRANSFER_SRC
                        | vk::BufferUsageFlags::TRANSFER_DST
                        | vk::BufferUsageFlags::STORAGE_BUFFER,
                )
                .push_next(&mut external);
            let buffer = device.create_buffer(&create, None).expect("a buffer");
            let mut import = vk::ImportMemoryFdInfoKHR::default()
                .handle_type(handle)
                .fd(fd);
            let mut dedicated = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer);
            let mut allocate = vk::MemoryAllocateInfo::default()
                .allocation_size(bytes)
                .memory_type_index(info.memory_type_index)
                .push_next(&mut import);
            if info.is_dedicated {
                allocate = allocate.push_next(&mut dedicated);
            }
            let memory = device.allocate_memory(&allocate, None).expect("imported");
            device.bind_buffer_memory(buffer, memory, 0).expect("bound");
            let values = self.copy_to_host(bytes, &[], |commands, to| {
                let taken_over = [vk::BufferMemoryBarrier2::default()
                    .dst_stage_mask(vk::PipelineStageFlags2::COPY)
                    .dst_access_mask(vk::AccessFlags2::TRANSFER_READ)
                    .src_queue_family_index(vk::QUEUE_FAMILY_EXTERNAL)
                    .dst_queue_family_index(self.family)
                    .buffer(buffer)
                    .size(vk::WHOLE_SIZE)];
                let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&taken_over);
                device.cmd_pipeline_barrier2(commands, &dependency);
                let regions = [vk::BufferCopy::default().size(bytes)];
                device.cmd_copy_buffer(commands, buffer, to, &regions);
            });
            device.destroy_buffer(buffer, None);
            device.free_memory(memory, None);
            values
        }
    }

    /// Runs recorded commands that copy to a host-visible buffer, and returns its contents.
    fn copy_to_host(
        &self,
        bytes: u64,
        waits: &[vk::SemaphoreSubmitInfo],
        record: impl FnOnce(vk::CommandBuffer, vk::Buffer),
    ) -> Vec<f32> {
        let device = &self.device;
        // SAFETY (all of it): the objects are created here from the live device, used in order, and destroyed when the queue is
        // idle.
        unsafe {
            let info = vk::BufferCreateInfo::default()
                .size(bytes)
                .usage(vk::BufferUsageFlags::TRANSFER_DST);
            let buffer = device.create_buffer(&info, None).expect("a buffer");
            let needs = device.get_buffer_memory_requirements(buffer);
            let memory = self
                .instance
                .get_physical_device_memory_properties(self.physical);
            let wanted =
                vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let kind = (0..memory.memory_type_count)
                .find(|&kind| {
                    let flags = memory.memory_types[kind as usize].property_flags;
                    needs.memory_type_bits >> kind & 1 == 1 && flags.contains(wanted)
                })
                .expect("memory that the host sees");
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(needs.size)
                .memory_type_index(kind);
            let memory = device.allocate_memory(&info, None).expect("memory");
            device.bind_buffer_memory(buffer, memory, 0).expect("bound");
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(self.family);
            let pool = device.create_command_pool(&info, None).expect("a pool");
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).expect("commands")[0];
            let begin = vk::CommandBufferBeginInfo::default();
            device
                .begin_command_buffer(commands, &begin)
                .expect("begun");
            record(commands, buffer);
            device.end_command_buffer(commands).expect("ended");
            let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
            let submit = vk::SubmitInfo2::default()
                .wait_semaphore_infos(waits)
                .command_buffer_infos(&commands);
            let fence = vk::Fence::null();
            device
                .queue_submit2(self.queue, &[submit], fence)
                .expect("submitted");
            device.queue_wait_idle(self.queue).expect("done");
            let flags = vk::MemoryMapFlags::empty();
            let mapped = device.map_memory(memory, 0, bytes, flags).expect("mapped");
            let texels = std::slice::from_raw_parts(mapped.cast::<f32>(), bytes as usize / 4);
            let texels = texels.to_vec();
            device.destroy_command_pool(pool, None);
            device.destroy_buffer(buffer, None);
            device.free_memory(memory, None);
            texels
        }
    }
}

pub fn scene() -> Scene {
    let mut scene = demo_scene("glossy", [24, 16]);
    scene.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, 8));
    scene
}

/// Copies radiance and normals to shared memory, one image after the other.
pub fn copy_to_shared(drawn: &DeviceFrame, memory: &SharedMemory, image_bytes: u64) {
    for (place, layer) in [Layer::Radiance, Layer::Normal].into_iter().enumerate() {
        let copied = drawn.copy_to(layer, memory, place as u64 * image_bytes);
        assert!(copied.expect("it fits"));
    }
}

/// R, G and B of texels with four components.
pub fn bands(texels: &[f32]) -> Vec<f32> {
    let texels = texels.chunks_exact(4);
    texels.flat_map(|texel| &texel[..3]).copied().collect()
}

#[test]
fn a_host_reads_the_image_on_its_own_device() {
    let own = Device::open(&DeviceOptions::default()).expect("a device");
    let options = &mut Default::default();
    let frame = Renderer::new(&own).and_then(|mut renderer| renderer.render(&scene(), options));
    let frame = frame.expect("it renders");
    Host::with(ALL, |host, lent| {
        // SAFETY: the host's objects outlive the device.
        let device = unsafe { Device::of_host(&lent) }.expect("nothing is missing");
        let mut renderer = Renderer::new(&device).expect("a renderer");
        let mut drawn = || {
            let drawn = renderer.render_on_device(&scene(), &mut Default::default());
            drawn.expect("it renders")
        };
        let (first, second) = (drawn(), drawn());
        assert_eq!([first.ready().1, second.ready().1], [1, 2]);
        for drawn in [&first, &second] {
            for layer in [
                Layer::Radiance,
                Layer::Direct,
                Layer::Indirect,
                Layer::Normal,
            ] {
                let image = drawn.image(layer).expect("the scene has the layer");
                let texels = bands(&host.read(image, drawn.ready()));
                assert!(Some(&texels[..]) == frame.values(layer), "{}", layer.name());
            }
            assert!(drawn.read().expect("it is read").layers == frame.layers);
        }
        assert_ne!(first.image(Layer::Direct), second.image(Layer::Direct));
        assert_eq!(first.image(Layer::Depth), None);
        // A frame outlives its renderer.
        drop(renderer);
        assert!(first.read().is_ok());
    });
}

/// Another instance, or CUDA, imports the memory once. Each frame is copied to it on the device. If the device uses the host's memory, the
/// host reads it in place.
#[test]
fn another_instance_imports_shared_memory() {
    let own = Device::open(&DeviceOptions::default()).expect("a device");
    let image_bytes = 24 * 16 * 16;
    let memory = SharedMemory::new(&own, 2 * image_bytes).expect("it exports memory");
    let info = memory.info();
    assert!(info.allocation_bytes >= 2 * image_bytes);
    let mut renderer = Renderer::new(&own).expect("a renderer");
    let mut scene = scene();
    Host::with(ALL, |host, _| {
        for height_m in [0.0, 0.1] {
            scene.camera.position_m.y += height_m;
            let drawn = renderer.render_on_device(&scene, &mut Default::default());
            let drawn = drawn.expect("it renders");
            let frame = drawn.read().expect("it is read");
            copy_to_shared(&drawn, &memory, image_bytes);
            let fd = memory.export_fd().expect("a file descriptor");
            let texels = host.read_shared(fd, info);
            // SAFETY: the memory has at least this many bytes, and nothing writes to it meanwhile.
            let in_place = memory.host_data().map(|data| unsafe {
                std::slice::from_raw_parts(
                    data.as_ptr().cast::<f32>(),
                    2 * image_bytes as usize / 4,
                )
            });
            assert_eq!(in_place.is_some(), own.info().kind == DeviceKind::Cpu);
            let seen = in_place.unwrap_or(&texels[..2 * image_bytes as usize / 4]);
            for texels in [&texels[..seen.len()], seen] {
                let (radiance, normals) = texels.split_at(texels.len() / 2);
                assert!(Some(&bands(radiance)[..]) == frame.values(Layer::Radiance));
                assert!(Some(&bands(normals)[..]) == frame.values(Layer::Normal));
            }
        }
    });
    let drawn = renderer.render_on_device(&scene, &mut Default::default());
    let drawn = drawn.expect("it renders");
    assert!(!drawn.copy_to(Layer::Depth, &memory, 0).expect("no error"));
    let other = Device::open(&DeviceOptions::default()).expect("a device");
    let of_other = SharedMemory::new(&other, image_bytes).expect("it exports memory");
    for (memory, offset_bytes, words) in [
        (&memory, 8, "not a multiple of 16"),
        (
            &memory,
            info.allocation_bytes - image_bytes + 16,
            "do not fit",
        ),
        (&memory, u64::MAX - 15, "do not fit"),
        (&of_other, 0, "on another device"),
    ] {
        let refused = drawn.copy_to(Layer::Direct, memory, offset_bytes);
        let refused = refused.expect_err("it does not fit").to_string();
        assert!(refused.contains(words), "{refused}");
    }
    Host::with(ALL, |_, lent| {
        // SAFETY: the host's objects outlive the device.
        let device = unsafe { Device::of_host(&lent) }.expect("nothing is missing");
        let refused = SharedMemory::new(&device, 64)
            .err()
            .expect("it is the host's");
        assert_says(&refused.to_string(), &["VK_KHR_external_memory_fd"]);
    });
}

#[test]
fn what_the_host_has_not_switched_on_is_said() {
    for (made, says) in [
        (
            Made {
                features: false,
                ..ALL
            },
            "dynamicRendering",
        ),
        (
            Made {
                timeline: false,
                ..ALL
            },
            "timelineSemaphore",
        ),
    ] {
        Host::with(made, |_, lent| {
            // SAFETY: the host's objects outlive the device.
            let error = unsafe { Device::of_host(&lent) }
                .err()
                .expect("that is missing");
            assert!(error.to_string().contains(says), "{error}");
        });
    }
    Host::with(ALL, |_, lent| {
        let of = |lent: &HostVulkan| {
            // SAFETY: as above; camlux finds the wrong value before it uses it.
            let error = unsafe { Device::of_host(lent) }
                .err()
                .expect("that is wrong");
            error.to_string()
        };
        let null = HostVulkan {
            queue: vk::Queue::null(),
            queue_lock: None,
            ..lent
        };
        assert!(of(&null).contains("null"), "{}", of(&null));
        let family = HostVulkan {
            queue: lent.queue,
            queue_family: 99,
            queue_lock: None,
            ..null
        };
        assert!(of(&family).contains("queue family 99"), "{}", of(&family));
    });
}

#[test]
fn the_hosts_lock_is_held_around_each_submission() {
    #[derive(Default)]
    struct Counting {
        held: AtomicI64,
        times: AtomicI64,
    }
    impl QueueLock for Counting {
        fn lock(&self) {
            assert_eq!(self.held.fetch_add(1, SeqCst), 0);
            self.times.fetch_add(1, SeqCst);
        }
        fn unlock(&self) {
            self.held.fetch_sub(1, SeqCst);
        }
    }
    let counting = Arc::new(Counting::default());
    let submissions = Host::with(ALL, |_, lent| {
        let lent = HostVulkan {
            queue_lock: Some(counting.clone()),
            ..lent
        };
        // SAFETY: the host's objects outlive the device.
        let device = unsafe { Device::of_host(&lent) }.expect("nothing is missing");
        let mut renderer = Renderer::new(&device).expect("a renderer");
        let drawn = renderer.render_on_device(&scene(), &mut Default::default());
        drawn.expect("it renders").stats().submissions
    });
    assert_eq!(counting.held.load(SeqCst), 0);
    // Plus the submission that signals the semaphore.
    assert_eq!(counting.times.load(SeqCst), i64::from(submissions) + 1);
}
