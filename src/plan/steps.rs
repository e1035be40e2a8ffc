//! The order in which the pixels of an image are visited, from few to all.

/// Pixels that are visited together, between the pixels of earlier steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GridStep {
    /// The coarsest grid: every `stride`-th pixel.
    Base { stride: u32 },
    /// The centres of the squares of the grid so far, `reach` pixels from their corners along either axis.
    Centres { reach: u32 },
    /// The middles of the edges that were not visited before.
    Edges { reach: u32 },
}

impl GridStep {
    /// All steps from the coarsest stride, a power of two, to every pixel.
    pub fn all(coarsest_stride: u32) -> Vec<GridStep> {
        let mut steps = vec![GridStep::Base {
            stride: coarsest_stride,
        }];
        let mut reach = coarsest_stride / 2;
        while reach > 0 {
            steps.extend([GridStep::Centres { reach }, GridStep::Edges { reach }]);
            reach /= 2;
        }
        steps
    }

    /// Columns and rows of the step's pixels; some may be outside the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            GridStep::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            GridStep::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            GridStep::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }

    /// Stride of the grid that the step completes, if it completes one.
    pub fn completed_stride_px(self) -> Option<u32> {
        match self {
            GridStep::Base { stride } => Some(stride),
            GridStep::Centres { .. } => None,
            GridStep::Edges { reach } => Some(reach),
        }
    }

    /// Number of the step's pixels, including those outside the image.
    pub fn pixel_count(self, resolution_px: [u32; 2]) -> u32 {
        self.extent(resolution_px).iter().product()
    }
}
