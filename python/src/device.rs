//! Vulkan devices.

use camlux::{DeviceChoice, DeviceOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{count, refuse};
use crate::errors::{not_copied, raised};
use crate::process::{self, OfProcess};

/// Properties of a Vulkan device. `choice` of `Device` accepts its index, a part of its name, its uuid or its PCI address.
#[pyclass(module = "camlux", frozen, get_all)]
pub struct DeviceInfo {
    /// Its number in the list of devices.
    index: usize,
    /// As its driver calls it.
    name: String,
    /// Identifies the device, also after a restart.
    uuid: String,
    /// Its PCI address; None if the driver does not report it.
    pci: Option<String>,
    /// Name and version of its driver.
    driver: String,
    /// The version of Vulkan.
    api_version: String,
    /// Its memory for images and scenes, bytes.
    memory_bytes: u64,
    /// Whether it has hardware for rays.
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
    process::begin()?;
    let list = py.detach(camlux::Device::list).map_err(raised)?;
    Ok(list.iter().map(DeviceInfo::from).collect())
}

/// An open Vulkan device. Several renderers may share it, each in its own thread.
///
/// choice: an index, a uuid, a PCI address or a part of a name; None: prefers a discrete GPU, then an integrated one, then a CPU driver.
/// validation: turns on the Khronos validation layer; `validation_messages` returns its messages.
///
/// A process that is forked from one with a device can use neither that device nor a new one: start processes by spawn.
///
/// Raises DeviceError if no device matches, if the matching one lacks what camlux needs, or in a forked process.
#[pyclass(module = "camlux", frozen)]
pub struct Device(OfProcess<camlux::Device>);

impl Device {
    pub fn get(&self) -> PyResult<&camlux::Device> {
        self.0.get()
    }
}

#[pymethods]
impl Device {
    #[new]
    #[pyo3(
        signature = (choice=None, *, validation=false, **others),
        text_signature = "(choice=None, *, validation=False)"
    )]
    pub fn new(
        py: Python,
        choice: Option<Bound<'_, PyAny>>,
        validation: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Device> {
        refuse("Device", others)?;
        let choice = choice.map(|choice| match choice.extract::<String>() {
            Ok(name) => Ok(name),
            Err(_) => count(&choice, "choice").map(|index| index.to_string()),
        });
        let choice = choice.transpose()?;
        let options = DeviceOptions {
            choice: choice
                .as_deref()
                .map(DeviceChoice::from)
                .unwrap_or_default(),
            validation,
        };
        process::begin()?;
        let device = py.detach(|| camlux::Device::open(&options));
        Ok(Device(OfProcess::new(device.map_err(raised)?)))
    }

    /// Its properties.
    #[getter]
    fn info(&self) -> PyResult<DeviceInfo> {
        Ok(self.get()?.info().into())
    }

    /// Messages of the validation layer since the device was opened.
    #[getter]
    fn validation_messages(&self) -> PyResult<Vec<String>> {
        Ok(self.get()?.validation_messages())
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(not_copied("Device", "open one in each process"))
    }

    fn __repr__(&self) -> PyResult<String> {
        Ok(format!("<camlux.Device {:?}>", self.get()?.info().name))
    }
}
