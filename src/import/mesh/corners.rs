//! The indices of the corners of polygons.

/// The index of a corner that has no texture coordinate or no normal.
pub(super) const NONE: u32 = u32::MAX;

/// The indices of corners.
#[derive(Debug)]
pub(super) enum Corners {
    /// One index for all values.
    Shared(Vec<u32>),
    Separate(Columns),
}

/// Separate indices of each kind of value: an empty list stands for [`NONE`] at all corners.
#[derive(Debug, Default)]
pub(super) struct Columns {
    pub positions: Vec<u32>,
    pub texcoords: Vec<u32>,
    pub normals: Vec<u32>,
    /// Empty: the index of the position.
    pub colors: Vec<u32>,
}

impl Default for Corners {
    fn default() -> Self {
        Corners::Shared(Vec::new())
    }
}

impl Columns {
    /// Adds a corner by its indices of position, texture coordinate ([`NONE`]: none) and normal ([`NONE`]: none).
    pub fn push(&mut self, [position, texcoord, normal]: [u32; 3]) {
        let count = self.positions.len();
        self.positions.push(position);
        for (column, index) in [(&mut self.texcoords, texcoord), (&mut self.normals, normal)] {
            if column.is_empty() && index != NONE {
                column.resize(count, NONE);
            }
            if index != NONE || !column.is_empty() {
                column.push(index);
            }
        }
    }

    pub fn all(&mut self) -> [&mut Vec<u32>; 4] {
        [
            &mut self.positions,
            &mut self.texcoords,
            &mut self.normals,
            &mut self.colors,
        ]
    }
}

impl Corners {
    pub fn len(&self) -> usize {
        match self {
            Corners::Shared(indices) => indices.len(),
            Corners::Separate(columns) => columns.positions.len(),
        }
    }

    pub fn position(&self, corner: usize) -> u32 {
        match self {
            Corners::Shared(indices) => indices[corner],
            Corners::Separate(columns) => columns.positions[corner],
        }
    }

    pub fn texcoord(&self, corner: usize) -> u32 {
        match self {
            Corners::Shared(indices) => indices[corner],
            Corners::Separate(columns) => *columns.texcoords.get(corner).unwrap_or(&NONE),
        }
    }

    pub fn normal(&self, corner: usize) -> u32 {
        match self {
            Corners::Shared(indices) => indices[corner],
            Corners::Separate(columns) => *columns.normals.get(corner).unwrap_or(&NONE),
        }
    }

    pub fn color(&self, corner: usize) -> u32 {
        match self {
            Corners::Separate(columns) if !columns.colors.is_empty() => columns.colors[corner],
            _ => self.position(corner),
        }
    }
}
