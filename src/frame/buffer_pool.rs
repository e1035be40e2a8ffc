//! The buffers of a frame that nobody needs any more. The system clears fresh memory at its first touch, which takes longer than to fill it.

use crate::output::{Frame, LayerData};

/// The values of one frame at most.
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

    /// So many values, whatever they are.
    pub fn floats(&mut self, count: usize) -> Vec<f32> {
        take(&mut self.floats, count)
    }

    /// So many values, whatever they are.
    pub fn ids(&mut self, count: usize) -> Vec<u32> {
        take(&mut self.ids, count)
    }
}

fn take<T: Copy + Default>(pool: &mut Vec<Vec<T>>, count: usize) -> Vec<T> {
    let fitting = pool.iter().position(|values| values.len() == count);
    fitting.map_or_else(|| vec![T::default(); count], |i| pool.swap_remove(i))
}
