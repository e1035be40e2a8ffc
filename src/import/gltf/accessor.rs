//! Reads the numbers of an accessor.

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

use super::file::GltfFile;
use crate::Result;

impl GltfFile {
    /// Reads vectors of N components. Normalised integers become 0 to 1, or -1 to 1.
    pub fn numbers<const N: usize>(&self, accessor: &Accessor) -> Result<Vec<[f64; N]>> {
        let read: fn(&[u8]) -> f64 = match accessor.data_type() {
            DataType::F32 => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
            DataType::U8 => |b| b[0].into(),
            DataType::I8 => |b| (b[0] as i8).into(),
            DataType::U16 => |b| u16::from_le_bytes([b[0], b[1]]).into(),
            DataType::I16 => |b| i16::from_le_bytes([b[0], b[1]]).into(),
            DataType::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]).into(),
        };
        let whole = match accessor.data_type() {
            _ if !accessor.normalized() => 1.0,
            DataType::F32 | DataType::U32 => 1.0,
            DataType::U8 => u8::MAX.into(),
            DataType::I8 => i8::MAX.into(),
            DataType::U16 => u16::MAX.into(),
            DataType::I16 => i16::MAX.into(),
        };
        let size = accessor.data_type().size();
        self.elements(accessor, N, |element| {
            std::array::from_fn(|i| read(&element[i * size..]) / whole)
        })
    }

    /// Reads whole numbers.
    pub fn indices(&self, accessor: &Accessor) -> Result<Vec<u32>> {
        let read: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |b| b[0].into(),
            DataType::U16 => |b| u16::from_le_bytes([b[0], b[1]]).into(),
            DataType::U32 => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            other => {
                let problem = format!("indices are of type {other:?}");
                return Err(self.error(problem, "export them as whole numbers"));
            }
        };
        self.elements(accessor, 1, read)
    }

    /// Reads every element, which must have this number of components. `read` converts its bytes.
    fn elements<T>(
        &self,
        accessor: &Accessor,
        components: usize,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let broken = |problem: &str| {
            let problem = format!("accessor {} {problem}", accessor.index());
            self.error(problem, "export it again")
        };
        let dimensions = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            _ => 0,
        };
        if dimensions != components {
            return Err(broken(&format!(
                "has {dimensions} components instead of {components}"
            )));
        }
        if accessor.sparse().is_some() {
            return Err(broken(
                "is sparse, which camlux does not read: turn sparse accessors off",
            ));
        }
        let view = accessor.view().ok_or_else(|| broken("has no data"))?;
        let bytes = self.view(&view)?;
        let size = components * accessor.data_type().size();
        let stride = view.stride().unwrap_or(size);
        let (offset, count) = (accessor.offset(), accessor.count());
        let end = count.checked_sub(1).and_then(|last| {
            last.checked_mul(stride)?
                .checked_add(offset)?
                .checked_add(size)
        });
        if stride < size || end.is_some_and(|end| end > bytes.len()) || end.is_none() && count > 0 {
            return Err(broken("reaches beyond its buffer view"));
        }
        let element = |index: usize| &bytes[offset + index * stride..][..size];
        Ok((0..count).map(|index| read(element(index))).collect())
    }
}
