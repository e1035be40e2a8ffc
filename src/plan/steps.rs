//! The order in which the pixels of an image are visited, from few to all.

/// Pixels that are visited together, between those before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// The coarsest lattice: every `stride`-th pixel.
    Base { stride: u32 },
    /// The centres of the squares of the lattice so far, `reach` pixels from their corners along either axis.
    Centres { reach: u32 },
    /// The middles of the edges that are still free.
    Edges { reach: u32 },
}

impl Step {
    /// From the coarsest stride, a power of two, to every pixel.
    pub fn all(coarsest_stride: u32) -> Vec<Step> {
        let mut steps = vec![Step::Base {
            stride: coarsest_stride,
        }];
        let mut reach = coarsest_stride / 2;
        while reach > 0 {
            steps.extend([Step::Centres { reach }, Step::Edges { reach }]);
            reach /= 2;
        }
        steps
    }

    /// From its pixels to those known before, along an axis.
    pub fn reach_px(self) -> u32 {
        match self {
            Step::Base { stride: reach } | Step::Centres { reach } | Step::Edges { reach } => reach,
        }
    }

    /// Columns and rows of its pixels; some may lie beyond the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Step::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            Step::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            Step::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }
}
