//! Pipelines whose layouts come from the shaders' own bindings.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use ash::vk;

use super::{
    Device,
    memory::{COLOR_FORMAT, DEPTH_FORMAT},
    shaders::{Binding, BindingKind, Module},
};
use crate::Result;

/// The pipelines of a device, made when they are first asked for.
pub(crate) struct Pipelines {
    device: Device,
    compute: Mutex<HashMap<&'static str, Arc<ComputePipeline>>>,
    raster: Mutex<HashMap<&'static str, Arc<RasterPipeline>>>,
}

impl Pipelines {
    pub fn new(device: &Device) -> Self {
        Pipelines {
            device: device.clone(),
            compute: Mutex::default(),
            raster: Mutex::default(),
        }
    }

    /// The compute pipeline of a pass with the words of its permutation.
    pub fn compute(&self, pass: &str, words: &[&str]) -> Result<Arc<ComputePipeline>> {
        let module = Module::find(pass, words)?;
        let mut made = self.compute.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.get(module.name) {
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(ComputePipeline::new(&self.device, module)?);
        made.insert(module.name, pipeline.clone());
        Ok(pipeline)
    }

    /// The raster pipeline of a pass: the common vertex stage and the pass's own fragment stage.
    pub fn raster(
        &self,
        pass: &str,
        words: &[&str],
        color_count: usize,
    ) -> Result<Arc<RasterPipeline>> {
        let fragment = Module::find(pass, words)?;
        let mut made = self.raster.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = made.get(fragment.name) {
            return Ok(pipeline.clone());
        }
        let vertex = Module::find("vertex", &[])?;
        let pipeline = RasterPipeline::new(&self.device, vertex, fragment, color_count)?;
        let pipeline = Arc::new(pipeline);
        made.insert(fragment.name, pipeline.clone());
        Ok(pipeline)
    }
}

/// What both kinds of pipeline consist of.
pub(super) struct Parts {
    device: Device,
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    /// Union of the bindings of all stages.
    pub bindings: Vec<Binding>,
    pub immediate_bytes: u32,
    pub stages: vk::ShaderStageFlags,
    pub name: &'static str,
}

/// A compute pipeline of one module.
pub(crate) struct ComputePipeline {
    pub(super) parts: Parts,
    pub module: &'static Module,
}

/// A pipeline that draws triangles without vertex attributes into float images with a reversed depth test.
pub(crate) struct RasterPipeline {
    pub(super) parts: Parts,
}

impl ComputePipeline {
    pub fn new(device: &Device, module: &'static Module) -> Result<ComputePipeline> {
        let mut parts = Parts::new(device, &[module], vk::ShaderStageFlags::COMPUTE)?;
        let shader = ShaderModule::new(device, module)?;
        let info = vk::ComputePipelineCreateInfo::default()
            .layout(parts.layout)
            .stage(shader.stage(vk::ShaderStageFlags::COMPUTE));
        // SAFETY: module and layout are live and were made from each other's interface.
        parts.raw = device.call("vkCreateComputePipelines", |device| {
            created(unsafe {
                device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
            })
        })?;
        Ok(ComputePipeline { parts, module })
    }
}

impl RasterPipeline {
    /// `color_count` is the number of images that the fragment shader writes.
    pub fn new(
        device: &Device,
        vertex: &'static Module,
        fragment: &'static Module,
        color_count: usize,
    ) -> Result<RasterPipeline> {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let mut parts = Parts::new(device, &[vertex, fragment], stages)?;
        let vertex = ShaderModule::new(device, vertex)?;
        let fragment = ShaderModule::new(device, fragment)?;
        let shaders = [
            vertex.stage(vk::ShaderStageFlags::VERTEX),
            fragment.stage(vk::ShaderStageFlags::FRAGMENT),
        ];
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
        let blends = vec![
            vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA);
            color_count
        ];
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
            .layout(parts.layout)
            .push_next(&mut rendering);
        // SAFETY: modules and layout are live and were made from each other's interface.
        parts.raw = device.call("vkCreateGraphicsPipelines", |device| {
            created(unsafe {
                device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
            })
        })?;
        Ok(RasterPipeline { parts })
    }
}

/// The one pipeline that was asked for.
fn created(
    result: std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
) -> std::result::Result<vk::Pipeline, vk::Result> {
    match result {
        Ok(pipelines) => pipelines
            .first()
            .copied()
            .ok_or(vk::Result::ERROR_INITIALIZATION_FAILED),
        Err((_, result)) => Err(result),
    }
}

impl Parts {
    fn new(
        device: &Device,
        modules: &[&'static Module],
        stages: vk::ShaderStageFlags,
    ) -> Result<Parts> {
        let mut bindings: Vec<Binding> = Vec::new();
        for binding in modules.iter().flat_map(|module| module.bindings) {
            if !bindings.contains(binding) {
                bindings.push(*binding);
            }
        }
        let immediate_bytes = modules.iter().map(|m| m.immediate_bytes).max().unwrap_or(0);
        let slots: Vec<_> = bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(binding.kind.descriptor_type())
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        // From here on what was made is destroyed on every way out.
        let mut parts = Parts {
            device: device.clone(),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            bindings,
            immediate_bytes,
            stages,
            name: modules.last().map_or("", |module| module.name),
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&slots);
        // SAFETY: the device is live and has the push descriptor extension.
        parts.set_layout = device.call("vkCreateDescriptorSetLayout", |device| unsafe {
            device.create_descriptor_set_layout(&info, None)
        })?;
        let sets = [parts.set_layout];
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
        parts.layout = device.call("vkCreatePipelineLayout", |device| unsafe {
            device.create_pipeline_layout(&info, None)
        })?;
        Ok(parts)
    }
}

impl Drop for Parts {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: recorders wait for their submissions; destroying a null handle does nothing.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

impl BindingKind {
    pub(super) fn descriptor_type(self) -> vk::DescriptorType {
        match self {
            BindingKind::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
            BindingKind::StorageRead | BindingKind::StorageWrite => {
                vk::DescriptorType::STORAGE_BUFFER
            }
            BindingKind::SampledImage => vk::DescriptorType::SAMPLED_IMAGE,
            BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
        }
    }
}

/// Needed only until its pipeline is made.
struct ShaderModule<'d> {
    device: &'d Device,
    raw: vk::ShaderModule,
    module: &'static Module,
}

impl<'d> ShaderModule<'d> {
    fn new(device: &'d Device, module: &'static Module) -> Result<Self> {
        let words = module.words();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a module that naga wrote and spirv-val accepts.
        let raw = device.call("vkCreateShaderModule", |device| unsafe {
            device.create_shader_module(&info, None)
        })?;
        Ok(ShaderModule {
            device,
            raw,
            module,
        })
    }

    fn stage(&self, stage: vk::ShaderStageFlags) -> vk::PipelineShaderStageCreateInfo<'static> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(self.raw)
            .name(self.module.entry)
    }
}

impl Drop for ShaderModule<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once they are made.
        unsafe { self.device.raw().destroy_shader_module(self.raw, None) };
    }
}
