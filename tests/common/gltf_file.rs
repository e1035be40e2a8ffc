//! Builds glTF files.

/// A file under construction: its buffer, and JSON of buffer views and accessors.
#[derive(Default)]
pub struct GltfBuilder {
    buffer: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;

impl GltfBuilder {
    /// Adds a buffer view and returns its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let (offset, length) = (self.buffer.len(), bytes.len());
        self.buffer.extend(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#
        ));
        self.views.len() - 1
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, count: usize, shape: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{shape}"}}"#
        ));
        self.accessors.len() - 1
    }

    /// Adds an accessor of these bytes, with more JSON members such as `,"normalized":true`.
    pub fn raw(
        &mut self,
        bytes: &[u8],
        component: u32,
        count: usize,
        shape: &str,
        more: &str,
    ) -> usize {
        let accessor = self.accessor(bytes, component, count, shape);
        self.extend(accessor, more);
        accessor
    }

    /// Adds JSON members to an accessor.
    fn extend(&mut self, accessor: usize, more: &str) {
        let json = &mut self.accessors[accessor];
        json.pop();
        json.push_str(&format!("{more}}}"));
    }

    /// Adds an accessor without a buffer view, from its JSON members.
    pub fn bare(&mut self, members: &str) -> usize {
        self.accessors.push(format!("{{{members}}}"));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], count: usize, shape: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, FLOAT, count, shape)
    }

    pub fn vec4(&mut self, values: &[[f32; 4]]) -> usize {
        self.floats(values.as_flattened(), values.len(), "VEC4")
    }

    pub fn vec3(&mut self, values: &[[f32; 3]]) -> usize {
        let accessor = self.floats(values.as_flattened(), values.len(), "VEC3");
        // glTF requires the bounds of POSITION.
        let bound = |pick: fn(f32, f32) -> f32, start: f32| {
            let of_axis = |axis: usize| values.iter().fold(start, |b, v| pick(b, v[axis]));
            format!("[{},{},{}]", of_axis(0), of_axis(1), of_axis(2))
        };
        let (min, max) = (bound(f32::min, f32::MAX), bound(f32::max, f32::MIN));
        self.extend(accessor, &format!(r#","min":{min},"max":{max}"#));
        accessor
    }

    pub fn vec2(&mut self, values: &[[f32; 2]]) -> usize {
        self.floats(values.as_flattened(), values.len(), "VEC2")
    }

    /// Texture coordinates as normalised 16-bit integers.
    pub fn vec2_u16(&mut self, values: &[[u16; 2]]) -> usize {
        let flat = values.as_flattened().iter();
        let bytes: Vec<u8> = flat.flat_map(|v| v.to_le_bytes()).collect();
        let accessor = self.accessor(&bytes, UNSIGNED_SHORT, values.len(), "VEC2");
        self.extend(accessor, r#","normalized":true"#);
        accessor
    }

    pub fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let flat = triangles.as_flattened();
        let bytes: Vec<u8> = flat.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, UNSIGNED_INT, flat.len(), "SCALAR")
    }

    pub fn indices_u16(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, UNSIGNED_SHORT, indices.len(), "SCALAR")
    }

    /// The JSON with the caller's members (nodes, meshes, materials and so on). `uri` is that of the buffer, unless it is in the file.
    fn json(&self, members: &str, uri: Option<&str>) -> String {
        let uri = uri.map_or(String::new(), |uri| format!(r#","uri":"{uri}""#));
        let (views, accessors) = (self.views.join(","), self.accessors.join(","));
        let length = self.buffer.len();
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{length}{uri}}}],"bufferViews":[{views}],"accessors":[{accessors}],{members}}}"#
        )
    }

    /// A .glb file.
    pub fn glb(&self, members: &str) -> Vec<u8> {
        let mut json = self.json(members, None).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut file = b"glTF".to_vec();
        let length = 12 + 8 + json.len() + 8 + self.buffer.len();
        for word in [2, length as u32, json.len() as u32] {
            file.extend(word.to_le_bytes());
        }
        file.extend(b"JSON");
        file.extend(json);
        file.extend((self.buffer.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(&self.buffer);
        file
    }

    /// A .gltf file and the buffer of that name beside it.
    pub fn gltf(&self, members: &str, buffer_name: &str) -> (String, &[u8]) {
        (self.json(members, Some(buffer_name)), &self.buffer)
    }
}
