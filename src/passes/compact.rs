//! Stable compaction of items into a matte and a glossy list, shared by the passes that make lists.

use super::Context;
use crate::{
    Error, Result,
    vulkan::{
        Allocate, BufferUse, Device, Resource,
        shaders::{Compaction, Key, ListLengths, constants::RUN_ITEMS},
    },
};

/// Number of runs of items; each invocation processes one run.
fn runs_of(item_count: u32) -> u32 {
    item_count.div_ceil(RUN_ITEMS)
}

/// The buffers of a compaction, except its items and its lists.
pub(crate) struct Compactor<A: Allocate = Device> {
    pub item_count: u32,
    run_count: u32,
    runs: A::Buffer,
    /// Lengths of the two lists, matte and glossy.
    pub lengths: A::Buffer,
    readback: A::Buffer,
}

impl<A: Allocate> Compactor<A> {
    /// For up to `item_count` items.
    pub fn new(allocate: &A, item_count: u32) -> Result<Compactor<A>> {
        let run_count = runs_of(item_count);
        let bytes = u64::from(run_count) * size_of::<ListLengths>() as u64;
        let one = size_of::<ListLengths>() as u64;
        Ok(Compactor {
            item_count,
            run_count,
            runs: allocate.buffer("run counts", bytes, BufferUse::Device)?,
            lengths: allocate.buffer("list lengths", one, BufferUse::Device)?,
            readback: allocate.buffer("list lengths", one, BufferUse::Readback)?,
        })
    }
}

impl Compactor {
    /// Changes the number of items, within the room that was allocated.
    pub fn set_item_count(&mut self, item_count: u32) -> Result<()> {
        let run_count = runs_of(item_count);
        if u64::from(run_count) * size_of::<ListLengths>() as u64 > self.runs.bytes {
            return Err(Error::internal("a compaction has more items than room"));
        }
        (self.item_count, self.run_count) = (item_count, run_count);
        Ok(())
    }

    /// Records the three kernels of a pass, two of which are its own. `grid_stride` is for the receivers pass.
    pub fn record(
        &self,
        context: &Context,
        [count, write]: [Key; 2],
        resources: &[(&str, Resource)],
        grid_stride: u32,
    ) -> Result<()> {
        let pass = count.pass();
        let pipelines = context.pipelines;
        let count = pipelines.compute(count)?;
        let scan = pipelines.compute(Key::CompactScan {})?;
        let write = pipelines.compute(write)?;
        let mut all = vec![
            ("runs", Resource::Buffer(&self.runs)),
            ("lengths", Resource::Buffer(&self.lengths)),
        ];
        all.extend_from_slice(resources);
        let parameters = Compaction {
            item_count: self.item_count,
            run_count: self.run_count,
            grid_stride,
        };
        let groups = [
            self.run_count.div_ceil(count.module.workgroup_size[0]),
            1,
            1,
        ];
        context.pass(pass, |recorder| {
            recorder.dispatch(&count, &all, &parameters, groups)?;
            recorder.barrier();
            recorder.dispatch(&scan, &all, &parameters, [1, 1, 1])?;
            recorder.barrier();
            recorder.dispatch(&write, &all, &parameters, groups)?;
            let bytes = size_of::<ListLengths>() as u64;
            recorder.copy_buffer(&self.lengths, &self.readback, bytes);
            Ok(())
        })
    }

    /// The lengths of the lists; valid after the submission.
    pub fn read_lengths(&self) -> Result<ListLengths> {
        let lengths = self.readback.mapped::<ListLengths>(1)?;
        Ok(lengths.first().copied().unwrap_or_default())
    }
}
