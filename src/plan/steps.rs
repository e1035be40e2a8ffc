//! The order in which the pixels of an image are visited, from few to all.

/// Pixels that are visited together, between those before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GridStep {
    /// The coarsest grid: every `stride`-th pixel.
    Base { stride: u32 },
    /// The centres of the squares of the grid so far, `reach` pixels from their corners along either axis.
    Centres { reach: u32 },
    /// The middles of the edges that are still free.
    Edges { reach: u32 },
}

impl GridStep {
    /// From the coarsest stride, a power of two, to every pixel.
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

    /// Columns and rows of its pixels; some may lie beyond the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            GridStep::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            GridStep::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            GridStep::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }

    /// Pixels between the points of the grid that it completes.
    pub fn completed_stride_px(self) -> Option<u32> {
        match self {
            GridStep::Base { stride } => Some(stride),
            GridStep::Centres { .. } => None,
            GridStep::Edges { reach } => Some(reach),
        }
    }

    /// How many pixels that are.
    pub fn pixel_count(self, resolution_px: [u32; 2]) -> u32 {
        self.extent(resolution_px).iter().product()
    }
}
