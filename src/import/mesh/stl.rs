//! STL files, text or binary: one mesh without materials, flat.
//!
//! Corners at the same position become one vertex, which takes a third of the memory. Which side is the front follows from the order of
//! the corners.
//!
//! The crate `stl_io` (0.11) is not used. It drops all solids after the first without a word, refuses some binary files whose comment begins with
//! "solid ", and refuses texts whose solid has no name, keywords in capitals and CR line ends. It gives no lines in messages, and takes twice
//! as long: 0.5 s of CPU time for the binary file of `cargo bench --bench load`.

use std::hash::{BuildHasher, RandomState};
use std::io::{BufRead, Read};
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::polygons::{Corners, NONE, Polygons};
use super::{Assets, MeshRequest};
use crate::import::lines::{Lines, open};
use crate::import::unused::Unused;
use crate::import::words::Words;
use crate::input_file::Stream;
use crate::scene::Mesh;
use crate::{Error, Result};

const HINT: &str = "export it again";
/// A comment of 80 bytes and the number of triangles.
const HEADER_BYTES: usize = 84;
/// A normal, three corners, and two bytes of any meaning.
const TRIANGLE_BYTES: usize = 50;
/// The words of a text.
const KEYWORDS: [&str; 9] = [
    "vertex", "facet", "normal", "outer", "loop", "endloop", "endfacet", "solid", "endsolid",
];

impl Assets {
    /// Loads an STL file as one mesh.
    pub(super) fn load_stl(&mut self, request: &MeshRequest) -> Result<Mesh> {
        let path = &request.path;
        let material = request.only_material()?;
        let (mut stream, file_bytes) = open(path, &request.named_at, "mesh")?;
        let mut reader = Reader::default();
        match is_binary(&mut stream, file_bytes) {
            true => reader.read_binary(stream, file_bytes, path)?,
            false => reader.read_text(Words::new(Lines::new(path, stream)))?,
        }
        let Reader {
            polygons,
            mut unused,
            ..
        } = reader;
        let polygons = Polygons {
            corners: Corners::Shared(reader.corners),
            materials: vec![material],
            ..polygons
        };
        let to_world = DAffine3::from_mat4(request.transform.matrix());
        let mesh = polygons.into_mesh(&request.name, &to_world, request.flat, &mut unused);
        self.report(path, &unused);
        mesh.map_err(|problem| Error::scene(path.display().to_string(), problem, HINT))
    }
}

/// Whether the file is binary, whatever its comment begins with. A text has no control characters.
fn is_binary(stream: &mut Stream, file_bytes: u64) -> bool {
    let Ok(beginning) = stream.fill_buf() else {
        return false;
    };
    if let Some(header) = beginning.get(..HEADER_BYTES)
        && expected_bytes(header) == file_bytes
    {
        return true;
    }
    let is_control = |byte: &u8| *byte < b' ' && !byte.is_ascii_whitespace() && *byte != 0x0b;
    let text = beginning.strip_prefix(b"\xef\xbb\xbf").unwrap_or(beginning);
    let text = text.trim_ascii_start();
    let is_solid = text
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    !is_solid && file_bytes >= HEADER_BYTES as u64 || beginning.iter().any(is_control)
}

/// The length of a binary file with this header.
fn expected_bytes(header: &[u8]) -> u64 {
    HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * u64::from(triangle_count(header))
}

fn triangle_count(header: &[u8]) -> u32 {
    let [.., a, b, c, d] = *header else {
        return 0;
    };
    u32::from_le_bytes([a, b, c, d])
}

#[derive(Default)]
struct Reader {
    polygons: Polygons,
    corners: Vec<u32>,
    vertices: VertexTable,
    unused: Unused,
}

impl Reader {
    fn read_binary(&mut self, mut stream: Stream, file_bytes: u64, file: &Path) -> Result<()> {
        let refuse = |problem: String| Error::scene(file.display().to_string(), problem, HINT);
        let unreadable = |error: std::io::Error| refuse(format!("cannot be read: {error}"));
        let mut header = [0; HEADER_BYTES];
        if file_bytes < HEADER_BYTES as u64 {
            let problem =
                "not an STL file: it neither begins with \"solid\" nor has a header of 84 bytes";
            return Err(refuse(problem.into()));
        }
        stream.read_exact(&mut header).map_err(unreadable)?;
        let count = triangle_count(&header);
        let expected = expected_bytes(&header);
        if expected > file_bytes {
            return Err(refuse(format!(
                "its {count} triangles take {expected} bytes, but it has {file_bytes}"
            )));
        }
        if expected < file_bytes {
            let more = file_bytes - expected;
            self.unused
                .add(&format!("{more} bytes after the last triangle"));
        }
        let has_color = header[..80].windows(6).any(|word| word == b"COLOR=");
        self.unused
            .add_many("the colour in the header", has_color.into());
        self.corners.reserve_exact(3 * count as usize);
        let mut attributes = 0;
        for index in 0..count {
            let mut bytes = [0; TRIANGLE_BYTES];
            stream.read_exact(&mut bytes).map_err(unreadable)?;
            let (numbers, _) = bytes.as_chunks::<4>();
            let vector = |first: usize| {
                let number = |axis: usize| f64::from(f32::from_le_bytes(numbers[first + axis]));
                DVec3::new(number(0), number(1), number(2))
            };
            let triangle = [3, 6, 9].map(vector);
            if !triangle.iter().all(|corner| corner.is_finite()) {
                let problem =
                    format!("triangle {index} has a coordinate that is not a finite number");
                return Err(refuse(problem));
            }
            self.check_normal(vector(0), &triangle);
            for corner in triangle {
                self.push(corner);
            }
            attributes += u64::from(bytes[48..] != [0, 0]);
        }
        self.unused
            .add_many("attribute bytes of triangles, such as colours", attributes);
        Ok(())
    }

    fn read_text(&mut self, mut words: Words) -> Result<()> {
        let mut normal = DVec3::ZERO;
        let mut outline: Vec<DVec3> = Vec::new();
        let mut is_open = false;
        let mut is_empty = true;
        while let Some(word) = words.next_word()? {
            is_empty = false;
            let known = KEYWORDS
                .iter()
                .find(|keyword| word.eq_ignore_ascii_case(keyword.as_bytes()));
            match known.copied().unwrap_or_default() {
                // A name follows.
                "solid" | "endsolid" => words.skip_line(),
                "outer" | "loop" | "endfacet" => {}
                "facet" => is_open = true,
                "normal" => normal = vector(&mut words)?,
                "vertex" => {
                    let corner = vector(&mut words)?;
                    if !corner.is_finite() {
                        let problem = "a vertex has a coordinate that is not a finite number";
                        return Err(Error::scene(words.here(), problem, HINT));
                    }
                    outline.push(corner);
                }
                "endloop" => {
                    is_open = false;
                    self.check_normal(normal, &outline);
                    let start = self.corners.len();
                    for corner in outline.drain(..) {
                        self.push(corner);
                    }
                    let end = self.corners.len();
                    if end >= NONE as usize {
                        let problem = "there are 2^32 corners or more";
                        return Err(Error::scene(words.here(), problem, "split the mesh"));
                    }
                    Polygons::end_face(&mut self.polygons.face_ends, start, end);
                }
                _ => {
                    return Err(words.error(
                        "is no word of STL",
                        "write solid, facet normal, outer loop, vertex, endloop, endfacet or endsolid",
                    ));
                }
            }
        }
        if is_empty {
            let problem = "not an STL file: it is empty";
            return Err(Error::scene(words.here(), problem, HINT));
        }
        match is_open || !outline.is_empty() {
            true => Err(words.at_end()),
            false => Ok(()),
        }
    }

    /// Counts normals of the file that are on the back of their triangle.
    fn check_normal(&mut self, normal: DVec3, outline: &[DVec3]) {
        if let [a, b, c] = *outline
            && (b - a).cross(c - a).dot(normal) < 0.0
        {
            self.unused
                .add("normals that oppose the order of the corners");
        }
    }

    fn push(&mut self, corner: DVec3) {
        // −0 is at the same place as 0.
        let corner = corner + DVec3::ZERO;
        let vertex = self.vertices.index_of(corner, &mut self.polygons.positions);
        self.corners.push(vertex);
    }
}

fn vector(words: &mut Words) -> Result<DVec3> {
    let mut vector = DVec3::ZERO;
    for axis in 0..3 {
        vector[axis] = words.next_number()?;
    }
    Ok(vector)
}

/// Finds the vertex at a position. Its slots hold indices only, so that it takes little memory.
struct VertexTable {
    hasher: RandomState,
    slots: Vec<u32>,
}

impl Default for VertexTable {
    fn default() -> Self {
        VertexTable {
            hasher: RandomState::new(),
            slots: vec![NONE; 64],
        }
    }
}

impl VertexTable {
    /// The index of a position, which is added if it is new.
    fn index_of(&mut self, position: DVec3, positions: &mut Vec<DVec3>) -> u32 {
        let slot = self.slot(position, positions);
        if self.slots[slot] != NONE {
            return self.slots[slot];
        }
        let index = positions.len() as u32;
        self.slots[slot] = index;
        positions.push(position);
        if 2 * positions.len() > self.slots.len() {
            let slots = 2 * self.slots.len();
            self.slots = Vec::new();
            self.slots.resize(slots, NONE);
            for (index, &position) in positions.iter().enumerate() {
                let slot = self.slot(position, positions);
                self.slots[slot] = index as u32;
            }
        }
        index
    }

    /// The slot of a position, or the free one where it belongs.
    fn slot(&self, position: DVec3, positions: &[DVec3]) -> usize {
        let mask = self.slots.len() - 1;
        let bits = position.to_array().map(f64::to_bits);
        let mut slot = self.hasher.hash_one(bits) as usize & mask;
        while self.slots[slot] != NONE && positions[self.slots[slot] as usize] != position {
            slot = (slot + 1) & mask;
        }
        slot
    }
}
