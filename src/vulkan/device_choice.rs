//! Which device to open.

use super::{instance::DeviceInfo, no_device};
use crate::Result;

/// Which device to open.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best device: a discrete GPU before an integrated one, and that before a CPU driver.
    #[default]
    Best,
    /// Index in [`Device::list`](crate::Device::list).
    Index(usize),
    /// Part of the device's name; case does not matter.
    Name(String),
    /// [`DeviceInfo::uuid`], with or without hyphens.
    Uuid(String),
    /// [`DeviceInfo::pci`], with or without its domain.
    Pci(String),
}

impl From<&str> for DeviceChoice {
    /// Recognises the text's form: an index, a UUID, a PCI address, or else a name.
    fn from(text: &str) -> DeviceChoice {
        if let Ok(index) = text.parse() {
            return DeviceChoice::Index(index);
        }
        let is_hex = |text: &str, count: usize| {
            text.len() == count && text.bytes().all(|byte| byte.is_ascii_hexdigit())
        };
        if is_hex(&text.replace('-', ""), 32) {
            return DeviceChoice::Uuid(text.into());
        }
        let parts: Vec<&str> = text.rsplit([':', '.']).collect();
        let is_pci = match parts[..] {
            [function, device, bus] => [(function, 1), (device, 2), (bus, 2)]
                .iter()
                .all(|&(part, count)| is_hex(part, count)),
            [function, device, bus, domain] => [(function, 1), (device, 2), (bus, 2), (domain, 4)]
                .iter()
                .all(|&(part, count)| is_hex(part, count)),
            _ => false,
        };
        if is_pci {
            return DeviceChoice::Pci(text.into());
        }
        DeviceChoice::Name(text.into())
    }
}

impl DeviceChoice {
    /// The device in a list that this names.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if no device matches, or if the matching device lacks something camlux needs.
    pub fn among<'l>(&self, list: &'l [DeviceInfo]) -> Result<&'l DeviceInfo> {
        let none = |problem: String| {
            let name = |info: &DeviceInfo| format!("{} \"{}\"", info.index, info.name);
            let names: Vec<String> = list.iter().map(name).collect();
            no_device(problem, format!("choose one of: {}", names.join(", ")))
        };
        let chosen = match self {
            DeviceChoice::Best => list
                .iter()
                .filter(|info| info.unusable.is_none())
                .min_by_key(|info| info.kind)
                .ok_or_else(|| {
                    let lack = |info: &DeviceInfo| {
                        Some(format!("{} lacks {}", info.name, info.unusable.as_ref()?))
                    };
                    let lacks: Vec<String> = list.iter().filter_map(lack).collect();
                    no_device(lacks.join(", "), "update the driver, or install a CPU driver, on Debian: apt-get install mesa-vulkan-drivers")
                })?,
            DeviceChoice::Index(index) => list
                .iter()
                .find(|info| info.index == *index)
                .ok_or_else(|| none(format!("there is no device {index}")))?,
            DeviceChoice::Name(name) => list
                .iter()
                .find(|info| info.name.to_lowercase().contains(&name.to_lowercase()))
                .ok_or_else(|| none(format!("no device is called \"{name}\"")))?,
            DeviceChoice::Uuid(uuid) => {
                let digits = |uuid: &str| uuid.replace('-', "").to_lowercase();
                list.iter()
                    .find(|info| digits(&info.uuid) == digits(uuid))
                    .ok_or_else(|| none(format!("no device has the UUID {uuid}")))?
            }
            DeviceChoice::Pci(pci) => {
                let wanted = pci.to_lowercase();
                let is_at = |at: &String| *at == wanted || at.strip_prefix("0000:") == Some(&wanted);
                list.iter()
                    .find(|info| info.pci.as_ref().is_some_and(is_at))
                    .ok_or_else(|| none(format!("no device is at the PCI address {pci}")))?
            }
        };
        match &chosen.unusable {
            None => Ok(chosen),
            Some(lack) => Err(none(format!("{} lacks {lack}", chosen.name))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_chooses_by_what_it_looks_like() {
        for (text, choice) in [
            ("0", DeviceChoice::Index(0)),
            ("12", DeviceChoice::Index(12)),
            ("llvmpipe", DeviceChoice::Name("llvmpipe".into())),
            ("65:00", DeviceChoice::Name("65:00".into())),
            ("65:00.0", DeviceChoice::Pci("65:00.0".into())),
            ("0000:65:00.0", DeviceChoice::Pci("0000:65:00.0".into())),
        ] {
            assert_eq!(DeviceChoice::from(text), choice);
        }
        let uuid = "6d657361-3232-2e33-2e36-000000000000";
        for text in [uuid.to_owned(), uuid.replace('-', "")] {
            let choice = DeviceChoice::from(text.as_str());
            assert_eq!(choice, DeviceChoice::Uuid(text));
        }
    }
}
