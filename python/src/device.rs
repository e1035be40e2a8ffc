//! Vulkan devices.

use camlux::{DeviceChoice, DeviceOptions};
use pyo3::prelude::*;

use crate::errors::raised;

/// Properties of a Vulkan device. `choice` of `Device` accepts its index, a part of its name, its uuid or its PCI address.
#[pyclass(module = "camlux", frozen, get_all)]
pub struct DeviceInfo {
    index: usize,
    name: String,
    uuid: String,
    /// None if the driver does not report it.
    pci: Option<String>,
    driver: String,
    api_version: String,
    memory_bytes: u64,
    has_ray_query: bool,
    /// Why camlux cannot use it; None if it can.
    unusable: Option<String>,
}

impl From<&camlux::DeviceInfo> for DeviceInfo {
    fn from(info: &camlux::DeviceInfo) -> Self {
        DeviceInfo {
            index: info.index,
            name: info.name.clone(),
            uuid: info.uuid.clone(),
            pci: info.pci.clone(),
            driver: info.driver.clone(),
            api_version: info.api_version.clone(),
            memory_bytes: info.limits.memory_bytes,
            has_ray_query: info.has_ray_query,
            unusable: info.unusable.clone(),
        }
    }
}

#[pymethods]
impl DeviceInfo {
    fn __repr__(&self) -> String {
        let Self { index, name, .. } = self;
        format!("<camlux.DeviceInfo {index}: {name:?}>")
    }
}

/// Lists every Vulkan device of this machine, including those that camlux cannot use.
///
/// Raises DeviceError if there is no Vulkan loader, driver or device.
#[pyfunction]
pub fn devices(py: Python) -> PyResult<Vec<DeviceInfo>> {
    let list = py.detach(camlux::Device::list).map_err(raised)?;
    Ok(list.iter().map(DeviceInfo::from).collect())
}

/// An open Vulkan device. Several renderers may share it, each in its own thread.
///
/// choice: an index, a uuid, a PCI address or a part of a name; None: prefers a discrete GPU, then an integrated one, then a CPU driver.
/// validation: turns on the Khronos validation layer; `validation_messages` returns its messages.
///
/// Raises DeviceError if no device matches, or if the matching one lacks what camlux needs.
#[pyclass(module = "camlux", frozen)]
pub struct Device(pub camlux::Device);

#[pymethods]
impl Device {
    #[new]
    #[pyo3(signature = (choice=None, *, validation=false))]
    pub fn new(py: Python, choice: Option<&str>, validation: bool) -> PyResult<Device> {
        let options = DeviceOptions {
            choice: choice.map(DeviceChoice::from).unwrap_or_default(),
            validation,
        };
        let device = py.detach(|| camlux::Device::open(&options));
        Ok(Device(device.map_err(raised)?))
    }

    #[getter]
    fn info(&self) -> DeviceInfo {
        self.0.info().into()
    }

    /// Messages of the validation layer since the device was opened.
    #[getter]
    fn validation_messages(&self) -> Vec<String> {
        self.0.validation_messages()
    }

    fn __repr__(&self) -> String {
        format!("<camlux.Device {:?}>", self.0.info().name)
    }
}
