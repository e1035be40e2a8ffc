//! Which properties of an element are read.

use super::header::{Element, Property, Type};
use crate::import::unused::Unused;

/// Names that programs write, and that camlux reads or knows to be of no use to it.
const PROPERTIES: [&str; 50] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "u",
    "v",
    "s",
    "t",
    "texture_u",
    "texture_v",
    "texture_s",
    "texture_t",
    "red",
    "green",
    "blue",
    "alpha",
    "diffuse_red",
    "diffuse_green",
    "diffuse_blue",
    "diffuse_alpha",
    "vertex_indices",
    "vertex_index",
    "texcoord",
    "texnumber",
    "quality",
    "confidence",
    "intensity",
    "value",
    "flags",
    "radius",
    "curvature",
    "material_index",
    "ambient_red",
    "ambient_green",
    "ambient_blue",
    "specular_red",
    "specular_green",
    "specular_blue",
    "specular_power",
    "vertex1",
    "vertex2",
    "opacity",
    "u2",
    "v2",
    "tx",
    "ty",
    "tz",
    "tw",
];

/// Where the values of an element's properties go: an index of a list of `N` values, or nowhere.
pub(super) struct Slots<const N: usize> {
    pub of_property: Vec<Option<usize>>,
    pub values: [f64; N],
}

impl<const N: usize> Slots<N> {
    pub fn new(element: &Element) -> Self {
        Slots {
            of_property: vec![None; element.properties.len()],
            values: [0.0; N],
        }
    }

    /// Sends these properties to the slots from `first` on, if all are there. Returns their types.
    pub fn take<const M: usize>(
        &mut self,
        element: &Element,
        first: usize,
        names: [&str; M],
    ) -> Option<[Type; M]> {
        let mut kinds = [Type::U8; M];
        let mut found = [0; M];
        for (index, name) in names.into_iter().enumerate() {
            found[index] = element.find(&[name])?;
            let property = &element.properties[found[index]];
            if property.length.is_some() {
                return None;
            }
            kinds[index] = property.kind;
        }
        for (index, property) in found.into_iter().enumerate() {
            self.of_property[property] = Some(first + index);
        }
        Some(kinds)
    }

    /// The first of these groups of properties that is there.
    pub fn take_one<const M: usize>(
        &mut self,
        element: &Element,
        first: usize,
        groups: &[[&str; M]],
    ) -> Option<[Type; M]> {
        let mut groups = groups.iter();
        groups.find_map(|&names| self.take(element, first, names))
    }

    /// Counts the properties that go nowhere.
    pub fn report(
        &self,
        element: &Element,
        is_list_used: impl Fn(&Property) -> bool,
        unused: &mut Unused,
    ) {
        let properties = element.properties.iter().zip(&self.of_property);
        for (property, slot) in properties {
            if slot.is_some() || (property.length.is_some() && is_list_used(property)) {
                continue;
            }
            let name = property.name.as_str();
            match PROPERTIES.contains(&name) {
                true => unused.add_many(
                    &format!("\"{name}\" of \"{}\"", element.name),
                    element.count,
                ),
                false => unused.add_unknown(name, &PROPERTIES),
            }
        }
    }
}

/// The colour in three slots.
pub(super) fn color(values: &[f64], kinds: [Type; 3]) -> [f32; 3] {
    [0, 1, 2].map(|band| (values[band] / kinds[band].white()) as f32)
}
