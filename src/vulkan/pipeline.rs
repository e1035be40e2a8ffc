//! Pipelines whose layouts come from the shaders' own bindings.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, OnceLock,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use ash::vk::{self, ShaderStageFlags as Stage};

use super::{
    Device, lock,
    memory::{COLOR_FORMAT, DEPTH_FORMAT},
    pipeline_cache::PipelineCache,
    shaders::{Binding, Kernel, Key, Module},
};
use crate::{Error, Result};

/// Descriptor sets that a pool allocates at once.
const SETS_OF_A_POOL: u32 = 4;

/// The pipelines of a device, made on first use.
pub(crate) struct Pipelines {
    device: Device,
    /// Opened with the first pipeline.
    cache: OnceLock<Option<PipelineCache>>,
    /// Threads that want the same pipeline wait for the one that makes it; others do not.
    made: Mutex<HashMap<Key, Arc<Slot>>>,
    /// Time in which passes waited for their pipelines.
    nanoseconds: AtomicU64,
}

#[derive(Default)]
struct Slot {
    pipeline: Mutex<Option<Arc<Pipeline>>>,
    /// Whether a pass has asked for it.
    is_used: AtomicBool,
}

impl Pipelines {
    pub fn new(device: &Device) -> Self {
        Pipelines {
            device: device.clone(),
            cache: OnceLock::new(),
            made: Mutex::default(),
            nanoseconds: AtomicU64::default(),
        }
    }

    /// Time in which passes waited for their pipelines so far.
    pub fn making_time(&self) -> Duration {
        Duration::from_nanos(self.nanoseconds.load(Ordering::Relaxed))
    }

    pub fn compute(&self, key: Key) -> Result<Arc<Pipeline>> {
        self.get_or_make(key, || Pipeline::compute(&self.device, self.cache(), key))
    }

    /// Those of these kernels that are still to be made.
    pub fn missing(&self, keys: Vec<Key>) -> Vec<Key> {
        let made = lock(&self.made);
        keys.into_iter()
            .filter(|key| !made.contains_key(key))
            .collect()
    }

    /// Makes the pipelines of kernels, before a pass asks for them.
    pub fn make_ahead(&self, keys: impl Iterator<Item = Key>) -> Result<()> {
        for key in keys {
            let slot = self.slot(key);
            let mut pipeline = lock(&slot.pipeline);
            if pipeline.is_none() {
                *pipeline = Some(Arc::new(Pipeline::compute(
                    &self.device,
                    self.cache(),
                    key,
                )?));
            }
        }
        Ok(())
    }

    /// The kernels that passes have asked for.
    #[cfg(test)]
    pub fn used(&self) -> Vec<Key> {
        let made = lock(&self.made);
        let used = made
            .iter()
            .filter(|(_, slot)| slot.is_used.load(Ordering::Relaxed));
        used.map(|(key, _)| *key).collect()
    }

    /// Null if the driver needs none. Threads may use it at the same time.
    fn cache(&self) -> vk::PipelineCache {
        let cache = self.cache.get_or_init(|| PipelineCache::open(&self.device));
        let raw = cache.as_ref().map(|cache| cache.raw);
        raw.unwrap_or_default()
    }

    fn slot(&self, key: Key) -> Arc<Slot> {
        lock(&self.made).entry(key).or_default().clone()
    }

    /// The raster pipeline of a pass: the common vertex stage and the pass's own fragment stage, which writes `color_count`
    /// images.
    pub fn raster(&self, fragment: Key, color_count: usize) -> Result<Arc<Pipeline>> {
        self.get_or_make(fragment, || {
            Pipeline::raster(&self.device, self.cache(), fragment, color_count)
        })
    }

    fn get_or_make(
        &self,
        key: Key,
        make: impl FnOnce() -> Result<Pipeline>,
    ) -> Result<Arc<Pipeline>> {
        let slot = self.slot(key);
        slot.is_used.store(true, Ordering::Relaxed);
        if let Ok(found) = slot.pipeline.try_lock()
            && let Some(made) = &*found
        {
            return Ok(made.clone());
        }
        let start = Instant::now();
        let mut pipeline = lock(&slot.pipeline);
        let made = match &*pipeline {
            Some(made) => made.clone(),
            None => pipeline.insert(Arc::new(make()?)).clone(),
        };
        let nanoseconds = start.elapsed().as_nanos() as u64;
        self.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        Ok(made)
    }
}

pub(crate) struct Pipeline {
    device: Device,
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    sets: Mutex<DescriptorSets>,
    /// Union of the bindings of all stages.
    pub(super) bindings: Vec<Binding>,
    pub(super) immediate_bytes: u32,
    pub(super) stages: Stage,
    /// The fragment stage of a raster pipeline.
    pub module: &'static Module,
}

/// A pipeline's descriptor sets.
#[derive(Default)]
struct DescriptorSets {
    pools: Vec<vk::DescriptorPool>,
    /// Sets that no command pool has.
    free: Vec<vk::DescriptorSet>,
}

impl Pipeline {
    fn compute(device: &Device, cache: vk::PipelineCache, key: Key) -> Result<Pipeline> {
        let kernel = key.kernel();
        let mut pipeline = Pipeline::with_layout(device, &[&kernel], Stage::COMPUTE)?;
        let shader = Shader::new(device, &kernel, Stage::COMPUTE)?;
        let info = vk::ComputePipelineCreateInfo::default()
            .layout(pipeline.layout)
            .stage(shader.stage);
        // SAFETY: cache, module and layout are live; the last two were made from each other's interface.
        let made = device.call("vkCreateComputePipelines", |device| unsafe {
            device
                .create_compute_pipelines(cache, &[info], None)
                .map_err(|(_, error)| error)
        })?;
        pipeline.raw = made[0];
        Ok(pipeline)
    }

    /// Draws triangles without vertex attributes into float images, with a reversed depth test.
    fn raster(
        device: &Device,
        cache: vk::PipelineCache,
        fragment: Key,
        color_count: usize,
    ) -> Result<Pipeline> {
        let (vertex, fragment) = (Key::Vertex {}.kernel(), fragment.kernel());
        let stages = Stage::VERTEX | Stage::FRAGMENT;
        let mut pipeline = Pipeline::with_layout(device, &[&vertex, &fragment], stages)?;
        let vertex = Shader::new(device, &vertex, Stage::VERTEX)?;
        let fragment = Shader::new(device, &fragment, Stage::FRAGMENT)?;
        let shaders = [vertex.stage, fragment.stage];
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        // Surfaces are two-sided: nothing is culled.
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
            .cull_mode(vk::CullModeFlags::NONE)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER);
        let blend = vk::PipelineColorBlendAttachmentState::default()
            .color_write_mask(vk::ColorComponentFlags::RGBA);
        let blends = vec![blend; color_count];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let formats = vec![COLOR_FORMAT; color_count];
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(DEPTH_FORMAT);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&shaders)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(pipeline.layout)
            .push_next(&mut rendering);
        // SAFETY: cache, modules and layout are live; the last two were made from each other's interface.
        let made = device.call("vkCreateGraphicsPipelines", |device| unsafe {
            device
                .create_graphics_pipelines(cache, &[info], None)
                .map_err(|(_, error)| error)
        })?;
        pipeline.raw = made[0];
        Ok(pipeline)
    }

    /// A pipeline that has no shaders yet.
    fn with_layout(device: &Device, kernels: &[&Kernel], stages: Stage) -> Result<Pipeline> {
        let mut bindings: Vec<Binding> = Vec::new();
        for binding in kernels.iter().flat_map(|kernel| &kernel.bindings) {
            if !bindings.contains(binding) {
                bindings.push(*binding);
            }
        }
        let slot = |binding: &Binding| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(binding.binding)
                .descriptor_type(binding.kind)
                .descriptor_count(1)
                .stage_flags(stages)
        };
        let slots: Vec<_> = bindings.iter().map(slot).collect();
        let immediate_bytes = kernels.iter().map(|k| k.module.immediate_bytes);
        let immediate_bytes = immediate_bytes.max().unwrap_or(0);
        let last = kernels[kernels.len() - 1];
        // From here on, every early return destroys what was made.
        let mut pipeline = Pipeline {
            device: device.clone(),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            sets: Mutex::default(),
            bindings,
            immediate_bytes,
            stages,
            module: last.module,
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&slots);
        // SAFETY: the device is live.
        pipeline.set_layout = device.call("vkCreateDescriptorSetLayout", |device| unsafe {
            device.create_descriptor_set_layout(&info, None)
        })?;
        let sets = [pipeline.set_layout];
        let ranges = [vk::PushConstantRange {
            stage_flags: stages,
            offset: 0,
            size: immediate_bytes,
        }];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        if immediate_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: device and set layout are live.
        pipeline.layout = device.call("vkCreatePipelineLayout", |device| unsafe {
            device.create_pipeline_layout(&info, None)
        })?;
        Ok(pipeline)
    }

    /// A descriptor set for a command pool.
    pub(super) fn take_set(&self) -> Result<vk::DescriptorSet> {
        let mut sets = lock(&self.sets);
        if let Some(set) = sets.free.pop() {
            return Ok(set);
        }
        let size = |binding: &Binding| {
            vk::DescriptorPoolSize::default()
                .ty(binding.kind)
                .descriptor_count(SETS_OF_A_POOL)
        };
        let sizes: Vec<_> = self.bindings.iter().map(size).collect();
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(SETS_OF_A_POOL)
            .pool_sizes(&sizes);
        // SAFETY: the device is live.
        let pool = self
            .device
            .call("vkCreateDescriptorPool", |device| unsafe {
                device.create_descriptor_pool(&info, None)
            })?;
        sets.pools.push(pool);
        let layouts = [self.set_layout; SETS_OF_A_POOL as usize];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&layouts);
        // SAFETY: the pool has room for this number of sets of this layout.
        sets.free = self
            .device
            .call("vkAllocateDescriptorSets", |device| unsafe {
                device.allocate_descriptor_sets(&info)
            })?;
        let set = sets.free.pop();
        set.ok_or_else(|| Error::internal("a pool without descriptor sets"))
    }

    /// Returns the sets of a command pool.
    pub(super) fn give_sets_back(&self, sets: &mut Vec<vk::DescriptorSet>) {
        lock(&self.sets).free.append(sets);
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: recorders wait for their submissions; destroying a null handle does nothing.
        unsafe {
            for &pool in &lock(&self.sets).pools {
                device.destroy_descriptor_pool(pool, None);
            }
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A stage of a pipeline, needed only until the pipeline is made.
struct Shader<'d> {
    device: &'d Device,
    stage: vk::PipelineShaderStageCreateInfo<'static>,
}

impl<'d> Shader<'d> {
    fn new(device: &'d Device, kernel: &Kernel, stage: Stage) -> Result<Self> {
        let info = vk::ShaderModuleCreateInfo::default().code(&kernel.words);
        // SAFETY: the words are a module that naga wrote and spirv-val accepts.
        let raw = device.call("vkCreateShaderModule", |device| unsafe {
            device.create_shader_module(&info, None)
        })?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(raw)
            .name(kernel.module.entry);
        Ok(Shader { device, stage })
    }
}

impl Drop for Shader<'_> {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: pipelines do not need their modules after creation.
        unsafe { device.destroy_shader_module(self.stage.module, None) };
    }
}
