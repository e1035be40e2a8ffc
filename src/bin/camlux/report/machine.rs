//! The machine on which a report was measured: times mean nothing without it.

use std::fs;
use std::thread;
use std::time::SystemTime;

use camlux::DeviceInfo;
use serde::Serialize;

/// Versions and hardware. `None` if the system does not report a value.
#[derive(Serialize, Clone, Debug)]
pub struct Machine {
    pub camlux_version: &'static str,
    /// UTC, RFC 3339.
    pub date: String,
    pub device: String,
    pub device_kind: String,
    pub driver: String,
    pub cpu: Option<String>,
    /// Number of cores that this process may use.
    pub cores: Option<usize>,
    /// The environment variable LP_NUM_THREADS: threads of Mesa's CPU driver.
    pub lp_num_threads: Option<String>,
    /// Mean number of running processes in the minute before the report. Far above 0, the machine was busy and the times are too long.
    pub load_before: Option<f64>,
    pub system: String,
}

impl Machine {
    pub fn look(device: &DeviceInfo) -> Machine {
        Machine {
            camlux_version: env!("CARGO_PKG_VERSION"),
            date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            device: device.name.clone(),
            device_kind: device.kind.to_string(),
            driver: device.driver.clone(),
            cpu: cpu_model(),
            cores: thread::available_parallelism().ok().map(usize::from),
            lp_num_threads: std::env::var("LP_NUM_THREADS").ok(),
            load_before: load_of_last_minute(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        }
    }

    /// Everything except the time of the report and the load of the machine.
    pub fn identity(&self) -> String {
        let lasting = Machine {
            date: String::new(),
            load_before: None,
            ..self.clone()
        };
        format!("{lasting:?}")
    }
}

fn cpu_model() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn load_of_last_minute() -> Option<f64> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}
