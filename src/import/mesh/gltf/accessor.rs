//! Reads the numbers of an accessor.

use super::document::{Accessor, Component, Sparse};
use super::file::GltfFile;
use crate::Result;

/// Elements that a file may have without data for them, beside one per byte. All of them are 0 but those of a sparse accessor.
const MOST_ZEROS: usize = 1 << 16;

impl Component {
    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }
}

impl GltfFile {
    /// Reads vectors of N components. Normalised integers become 0 to 1, or -1 to 1.
    pub fn numbers<const N: usize>(&self, accessor: usize, user: &str) -> Result<Vec<[f64; N]>> {
        let of_file = self.find(&self.document.accessors, accessor, "accessor", user)?;
        let component = of_file.component;
        let read: fn(&[u8]) -> f64 = match component {
            Component::F32 => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
            Component::U8 => |b| b[0].into(),
            Component::I8 => |b| (b[0] as i8).into(),
            Component::U16 => |b| u16::from_le_bytes([b[0], b[1]]).into(),
            Component::I16 => |b| i16::from_le_bytes([b[0], b[1]]).into(),
            Component::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
        };
        let whole: Option<f64> = match component {
            _ if !of_file.normalized => None,
            Component::F32 => None,
            Component::U8 => Some(u8::MAX.into()),
            Component::I8 => Some(i8::MAX.into()),
            Component::U16 => Some(u16::MAX.into()),
            Component::I16 => Some(i16::MAX.into()),
            Component::U32 => Some(u32::MAX.into()),
        };
        let size = component.size();
        self.elements(accessor, of_file, N, |element| {
            std::array::from_fn(|i| match (read(&element[i * size..]), whole) {
                // The lowest signed integer is just beyond -1.
                (value, Some(whole)) => (value / whole).max(-1.0),
                (value, None) => value,
            })
        })
    }

    /// The number of components of an accessor.
    pub fn component_count(&self, accessor: usize, user: &str) -> Result<usize> {
        let of_file = self.find(&self.document.accessors, accessor, "accessor", user)?;
        Ok(components(&of_file.shape))
    }

    /// Reads whole numbers.
    pub fn indices(&self, accessor: usize, user: &str) -> Result<Vec<u32>> {
        let of_file = self.find(&self.document.accessors, accessor, "accessor", user)?;
        let read = self.reader_of_indices(of_file.component)?;
        self.elements(accessor, of_file, 1, read)
    }

    fn reader_of_indices(&self, component: Component) -> Result<fn(&[u8]) -> u32> {
        Ok(match component {
            Component::U8 => |b| b[0].into(),
            Component::U16 => |b| u16::from_le_bytes([b[0], b[1]]).into(),
            Component::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            other => return Err(self.broken(format!("indices are of type {other:?}"))),
        })
    }

    /// Reads every element, which must have this number of components. `read` converts its bytes.
    fn elements<T: Clone>(
        &self,
        index: usize,
        accessor: &Accessor,
        components: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let broken = |problem: &str| self.broken(format!("accessor {index} {problem}"));
        let found = self::components(&accessor.shape);
        if found != components {
            let shape = &accessor.shape;
            return Err(broken(&format!(
                "is a {shape}, of {found} components instead of {components}"
            )));
        }
        let size = components * accessor.component.size();
        let mut elements = match accessor.view {
            Some(view) => {
                let bytes = self.view(view, &format!("accessor {index}"))?;
                let stride = self.document.views[view].stride.unwrap_or(size);
                let (offset, count) = (accessor.offset, accessor.count);
                let end = count.checked_sub(1).and_then(|last| {
                    last.checked_mul(stride)?
                        .checked_add(offset)?
                        .checked_add(size)
                });
                if stride < size
                    || end.is_some_and(|end| end > bytes.len())
                    || end.is_none() && count > 0
                {
                    return Err(broken("reaches beyond its buffer view"));
                }
                let element = |index: usize| &bytes[offset + index * stride..][..size];
                (0..count).map(|index| read(element(index))).collect()
            }
            None => {
                if accessor.count > MOST_ZEROS + self.byte_count() {
                    let problem = format!("has {} elements without data", accessor.count);
                    return Err(broken(&problem));
                }
                vec![read(&[0; 64]); accessor.count]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(&mut elements, index, sparse, size, read)?;
        }
        Ok(elements)
    }

    /// Replaces the elements that a sparse accessor lists.
    fn replace<T>(
        &self,
        elements: &mut [T],
        accessor: usize,
        sparse: &Sparse,
        size: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<()> {
        let user = format!("accessor {accessor}");
        let read_index = self.reader_of_indices(sparse.index_component)?;
        let index_size = sparse.index_component.size();
        let indices = self.view(sparse.index_view, &user)?;
        let values = self.view(sparse.value_view, &user)?;
        let mut places = indices
            .get(sparse.index_offset..)
            .unwrap_or_default()
            .chunks_exact(index_size);
        let mut values = values
            .get(sparse.value_offset..)
            .unwrap_or_default()
            .chunks_exact(size);
        for _ in 0..sparse.count {
            let (Some(place), Some(value)) = (places.next(), values.next()) else {
                let problem = "reaches beyond the buffer views of its sparse values";
                return Err(self.broken(format!("{user} {problem}")));
            };
            let place = read_index(place) as usize;
            let count = elements.len();
            let element = elements.get_mut(place).ok_or_else(|| {
                let problem = format!("has a sparse value for element {place} of {count}");
                self.broken(format!("{user} {problem}"))
            })?;
            *element = read(value);
        }
        Ok(())
    }
}

/// The number of components of an element; 0 for matrices, which nothing uses.
fn components(shape: &str) -> usize {
    match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 0,
    }
}
