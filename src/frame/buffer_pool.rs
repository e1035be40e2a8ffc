//! Buffers of a frame that are no longer needed, for reuse. The system clears fresh memory at its first touch, which takes longer
//! than filling it.

use crate::output::{Frame, LayerData};

/// The values of at most one frame.
#[derive(Default)]
pub(crate) struct BufferPool {
    floats: Vec<Vec<f32>>,
    ids: Vec<Vec<u32>>,
}

impl BufferPool {
    pub fn from_frame(frame: Frame) -> BufferPool {
        let mut pool = BufferPool::default();
        for (_, data) in frame.layers {
            match data {
                LayerData::Float(values) => pool.floats.push(values),
                LayerData::Id(values) => pool.ids.push(values),
            }
        }
        pool
    }

    /// This many values, with arbitrary contents.
    pub fn floats(&mut self, count: usize) -> Vec<f32> {
        take(&mut self.floats, count)
    }

    /// This many values, with arbitrary contents.
    pub fn ids(&mut self, count: usize) -> Vec<u32> {
        take(&mut self.ids, count)
    }
}

fn take<T: Copy + Default>(pool: &mut Vec<Vec<T>>, count: usize) -> Vec<T> {
    let fitting = pool.iter().position(|values| values.len() == count);
    fitting.map_or_else(|| vec![T::default(); count], |i| pool.swap_remove(i))
}
