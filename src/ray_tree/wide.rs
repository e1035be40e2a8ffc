//! A tree of boxes with up to eight children per node, which the host traces. It has the triangles of a [`MeshTree`](super::MeshTree), in the
//! same order.

use glam::Vec3A;

use super::lanes::{LANES, Lanes};
use super::{TRIANGLE_TEXELS, Texel};

/// The bit of a child that is a leaf, beside the leaf's index.
pub(super) const LEAF: u32 = 1 << 31;
/// A ray hits nothing.
pub(crate) const NOTHING_HIT: u32 = u32::MAX;

/// A ray in the layout of `shaders/shared/ray.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Ray {
    pub origin: [f32; 3],
    pub t_max: f32,
    pub direction: [f32; 3],
    pub end_height: f32,
}

/// What a ray has hit so far.
#[derive(Debug, Clone, Copy)]
pub(super) struct Met {
    /// 1 / distance of the nearest hit so far, or of the ray's end.
    pub inverse_t: f32,
    pub hit: u32,
}

/// The children of a node: per axis, low and high ends of their boxes.
#[repr(align(64))]
#[derive(Debug, Clone)]
pub(super) struct Node {
    bounds: [[[f32; LANES]; 2]; 3],
    /// Nodes, or leaves; 0 where there is no child.
    pub(super) children: [u32; LANES],
}

/// Triangles that are tested together.
#[repr(align(64))]
#[derive(Debug, Clone, bytemuck::Zeroable)]
pub(super) struct Leaf {
    corners: [[[f32; LANES]; 3]; 3],
    normal: [[f32; LANES]; 3],
    /// Their places in the list.
    pub(super) items: [u32; LANES],
    pub(super) count: usize,
    /// A bit for each triangle with cut-outs.
    cutouts: u32,
}

/// Boxes around leaves. Without items it has a node without children.
#[derive(Debug, Default)]
pub(super) struct WideNodes {
    pub(super) nodes: Vec<Node>,
}

/// The tree over triangles.
#[derive(Debug, Default)]
pub(crate) struct WideTree {
    pub(super) nodes: WideNodes,
    pub(super) leaves: Vec<Leaf>,
}

impl Node {
    pub(super) const EMPTY: Node = Node {
        bounds: [[[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]]; 3],
        children: [0; LANES],
    };

    pub(super) fn set_box(&mut self, lane: usize, [low, high]: [Vec3A; 2]) {
        for axis in 0..3 {
            self.bounds[axis][0][lane] = low[axis];
            self.bounds[axis][1][lane] = high[axis];
        }
    }

    /// The box around all children.
    pub(super) fn whole_box(&self) -> [Vec3A; 2] {
        let ends = |axis: usize| {
            let [low, high] = &self.bounds[axis];
            let low = low.iter().copied().fold(f32::INFINITY, f32::min);
            [low, high.iter().copied().fold(f32::NEG_INFINITY, f32::max)]
        };
        let [x, y, z] = [0, 1, 2].map(ends);
        [0, 1].map(|end| Vec3A::new(x[end], y[end], z[end]))
    }
}

impl Leaf {
    /// Takes these triangles of a list, no fewer than before. Lanes that stay 0 have triangles without area, which are never hit.
    pub(super) fn fill(&mut self, items: &[u32], triangles: &[Texel]) {
        self.count = items.len();
        self.cutouts = 0;
        for (lane, &item) in items.iter().enumerate() {
            let texels = &triangles[TRIANGLE_TEXELS * item as usize..][..TRIANGLE_TEXELS];
            for (corner, [x, y, z, normal]) in texels.iter().take(3).enumerate() {
                for (axis, place) in [x, y, z].into_iter().enumerate() {
                    self.corners[corner][axis][lane] = *place;
                }
                self.normal[corner][lane] = *normal;
            }
            self.items[lane] = item;
            self.cutouts |= u32::from(texels[3][1] > 0.0) << lane;
        }
    }

    /// The box around its triangles.
    pub(super) fn whole_box(&self) -> [Vec3A; 2] {
        let corners = (0..self.count).flat_map(|lane| {
            let corner = move |[x, y, z]: &[[f32; LANES]; 3]| Vec3A::new(x[lane], y[lane], z[lane]);
            self.corners.iter().map(corner)
        });
        corners.fold(
            [Vec3A::INFINITY, Vec3A::NEG_INFINITY],
            |[low, high], corner| [low.min(corner), high.max(corner)],
        )
    }
}

/// A ray as boxes are tested with it.
#[derive(Clone, Copy)]
struct BoxRay<L: Lanes> {
    origin: Vector<L>,
    inverse: Vector<L>,
    /// Index of the end of a box that the ray meets first, per axis.
    near: [usize; 3],
}

/// A ray as triangles are tested with it.
#[derive(Clone, Copy)]
struct TriangleRay<L: Lanes> {
    origin: Vector<L>,
    direction: Vector<L>,
    end_height: L::F,
}

impl<L: Lanes> BoxRay<L> {
    #[inline(always)]
    fn new(lanes: L, origin: [f32; 3], direction: [f32; 3]) -> Self {
        // Never infinite, so that 0 times the inverse is 0 and not NaN.
        let inverse = direction.map(|d| if d.abs() < 1e-30 { 1e30 } else { 1.0 / d });
        BoxRay {
            origin: splat(lanes, origin),
            inverse: splat(lanes, inverse),
            near: inverse.map(|i| usize::from(i < 0.0)),
        }
    }

    /// A bit for each child whose box the ray meets before `t_max`, and the distances.
    #[inline(always)]
    fn meet(&self, lanes: L, node: &Node, t_max: f32) -> (u32, L::F) {
        let mut enter = lanes.splat(0.0);
        let mut leave = lanes.splat(t_max);
        for axis in 0..3 {
            let near = self.near[axis];
            enter = lanes.max(enter, self.distance(lanes, node, axis, near));
            leave = lanes.min(leave, self.distance(lanes, node, axis, near ^ 1));
        }
        (lanes.le(enter, leave), enter)
    }

    #[inline(always)]
    fn distance(&self, lanes: L, node: &Node, axis: usize, end: usize) -> L::F {
        let plane = lanes.load(&node.bounds[axis][end & 1]);
        lanes.mul(lanes.sub(plane, self.origin[axis]), self.inverse[axis])
    }
}

/// A vector for each lane. These functions have no closures: a closure is not compiled for the vector units of its caller.
type Vector<L> = [<L as Lanes>::F; 3];

#[inline(always)]
fn splat<L: Lanes>(lanes: L, [x, y, z]: [f32; 3]) -> Vector<L> {
    [lanes.splat(x), lanes.splat(y), lanes.splat(z)]
}

#[inline(always)]
fn load<L: Lanes>(lanes: L, [x, y, z]: &[[f32; LANES]; 3]) -> Vector<L> {
    [lanes.load(x), lanes.load(y), lanes.load(z)]
}

#[inline(always)]
fn add<L: Lanes>(lanes: L, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [
        lanes.add(a[0], b[0]),
        lanes.add(a[1], b[1]),
        lanes.add(a[2], b[2]),
    ]
}

#[inline(always)]
fn sub<L: Lanes>(lanes: L, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [
        lanes.sub(a[0], b[0]),
        lanes.sub(a[1], b[1]),
        lanes.sub(a[2], b[2]),
    ]
}

#[inline(always)]
fn dot<L: Lanes>(lanes: L, a: Vector<L>, b: Vector<L>) -> L::F {
    lanes.add(
        lanes.add(lanes.mul(a[0], b[0]), lanes.mul(a[1], b[1])),
        lanes.mul(a[2], b[2]),
    )
}

#[inline(always)]
fn cross<L: Lanes>(lanes: L, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [
        lanes.sub(lanes.mul(a[1], b[2]), lanes.mul(a[2], b[1])),
        lanes.sub(lanes.mul(a[2], b[0]), lanes.mul(a[0], b[2])),
        lanes.sub(lanes.mul(a[0], b[1]), lanes.mul(a[1], b[0])),
    ]
}

/// On which side of the edge between two corners the direction passes.
#[inline(always)]
fn side<L: Lanes>(lanes: L, a: Vector<L>, b: Vector<L>, direction: Vector<L>) -> L::F {
    let normal = cross(lanes, add(lanes, a, b), sub(lanes, b, a));
    dot(lanes, normal, direction)
}

/// Where a ray meets the planes of a leaf's triangles: as `meet` of `shaders/shared/triangle_hit.wgsl`.
struct Meeting<L: Lanes> {
    /// A bit for each triangle that the ray passes inside.
    inside: u32,
    height: L::F,
    covered: L::F,
    end_height: L::F,
}

impl<L: Lanes> TriangleRay<L> {
    #[inline(always)]
    fn new(lanes: L, ray: &Ray) -> Self {
        TriangleRay {
            origin: splat(lanes, ray.origin),
            direction: splat(lanes, ray.direction),
            end_height: lanes.splat(ray.end_height),
        }
    }

    #[inline(always)]
    fn meet(&self, lanes: L, leaf: &Leaf) -> Meeting<L> {
        let [a, b, c] = &leaf.corners;
        let c0 = sub(lanes, load(lanes, a), self.origin);
        let c1 = sub(lanes, load(lanes, b), self.origin);
        let c2 = sub(lanes, load(lanes, c), self.origin);
        let normal = load(lanes, &leaf.normal);
        let w0 = side(lanes, c1, c2, self.direction);
        let w1 = side(lanes, c2, c0, self.direction);
        let w2 = side(lanes, c0, c1, self.direction);
        let height = dot(lanes, normal, c0);
        let zero = lanes.splat(0.0);
        let least = lanes.min(lanes.min(w0, w1), w2);
        let most = lanes.max(lanes.max(w0, w1), w2);
        let is_above = lanes.lt(zero, height);
        let inside = lanes.le(zero, least) & is_above | lanes.le(most, zero) & !is_above;
        let size = lanes.add(
            lanes.add(lanes.abs(normal[0]), lanes.abs(normal[1])),
            lanes.abs(normal[2]),
        );
        Meeting {
            inside,
            height,
            covered: dot(lanes, normal, self.direction),
            end_height: lanes.mul(self.end_height, size),
        }
    }
}

/// Nodes and leaves that a ray still has to visit, with the distances of their boxes.
pub(super) type Stack = Vec<(u32, f32)>;

/// What a ray does at a leaf. A trait and not a closure, which would not be compiled for the vector units of its caller.
pub(super) trait Visit<L: Lanes> {
    /// Visits a leaf that the ray may reach before `t_max`, and shortens the ray to what it hits. Returns whether the ray ends here.
    fn visit(&mut self, lanes: L, leaf: u32, t_max: &mut f32, stack: &mut Stack) -> bool;
}

impl WideNodes {
    /// Visits the leaves whose boxes a ray meets before `t_max`, the nearest ones first.
    #[inline(always)]
    pub(super) fn nearest_first<L: Lanes>(
        &self,
        lanes: L,
        ray: &Ray,
        mut t_max: f32,
        stack: &mut Stack,
        visitor: &mut impl Visit<L>,
    ) {
        let boxes = BoxRay::new(lanes, ray.origin, ray.direction);
        let bottom = stack.len();
        let mut next = 0;
        loop {
            if next & LEAF != 0 {
                if visitor.visit(lanes, next & !LEAF, &mut t_max, stack) {
                    stack.truncate(bottom);
                    return;
                }
            } else {
                let node = &self.nodes[next as usize];
                let (mut bits, enter) = boxes.meet(lanes, node, t_max);
                if bits != 0 {
                    let enter = lanes.store(enter);
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
                    let mut nearest = (node.children[lane], enter[lane]);
                    let first = stack.len();
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize & 7;
                        bits &= bits - 1;
                        let mut child = (node.children[lane], enter[lane]);
                        if child.1 < nearest.1 {
                            std::mem::swap(&mut child, &mut nearest);
                        }
                        stack.push(child);
                    }
                    sort_down(&mut stack[first..]);
                    next = nearest.0;
                    continue;
                }
            }
            loop {
                if stack.len() == bottom {
                    return;
                }
                let (word, t) = stack.pop().unwrap_or_default();
                if t <= t_max {
                    next = word;
                    break;
                }
            }
        }
    }

    /// Visits the leaves whose boxes a ray meets, in any order, until one ends it. Returns whether one did.
    #[inline(always)]
    pub(super) fn in_any_order<L: Lanes>(
        &self,
        lanes: L,
        ray: &Ray,
        stack: &mut Stack,
        visitor: &mut impl Visit<L>,
    ) -> bool {
        let boxes = BoxRay::new(lanes, ray.origin, ray.direction);
        let bottom = stack.len();
        let mut t_max = ray.t_max;
        let mut next = 0;
        loop {
            if next & LEAF != 0 {
                if visitor.visit(lanes, next & !LEAF, &mut t_max, stack) {
                    stack.truncate(bottom);
                    return true;
                }
            } else {
                let node = &self.nodes[next as usize];
                let (mut bits, _) = boxes.meet(lanes, node, t_max);
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
                    stack.push((node.children[lane], 0.0));
                }
            }
            if stack.len() == bottom {
                return false;
            }
            next = stack.pop().unwrap_or_default().0;
        }
    }
}

impl WideTree {
    /// Moves `met` to the closest triangle before it; of several at the same distance, to the first one. `first_hit` is the number of the
    /// tree's first triangle among all hits, `is_hole` tells whether a triangle with cut-outs has a hole where the ray meets it.
    #[inline(always)]
    pub(super) fn closest<L: Lanes>(
        &self,
        lanes: L,
        ray: &Ray,
        met: &mut Met,
        first_hit: u32,
        is_hole: &impl Fn(u32, &Ray) -> bool,
        stack: &mut Stack,
    ) {
        let mut visitor = Closest {
            leaves: &self.leaves,
            ray,
            triangles: TriangleRay::new(lanes, ray),
            met,
            first_hit,
            is_hole,
        };
        let t_max = 1.0 / visitor.met.inverse_t;
        self.nodes
            .nearest_first(lanes, ray, t_max, stack, &mut visitor);
    }

    /// The same as [`closest`](Self::closest), but without the boxes.
    #[cfg(test)]
    pub(super) fn closest_of_all<L: Lanes>(&self, lanes: L, ray: &Ray, met: &mut Met) {
        let mut visitor = Closest {
            leaves: &self.leaves,
            ray,
            triangles: TriangleRay::new(lanes, ray),
            met,
            first_hit: 0,
            is_hole: &|_: u32, _: &Ray| false,
        };
        for leaf in 0..self.leaves.len() as u32 {
            visitor.visit(lanes, leaf, &mut 1e30, &mut Vec::new());
        }
    }

    /// Whether a triangle is between the ends of a ray.
    #[inline(always)]
    pub(super) fn is_blocked<L: Lanes>(
        &self,
        lanes: L,
        ray: &Ray,
        is_hole: &impl Fn(u32, &Ray) -> bool,
        stack: &mut Stack,
    ) -> bool {
        let mut visitor = Any {
            leaves: &self.leaves,
            ray,
            triangles: TriangleRay::new(lanes, ray),
            is_hole,
        };
        self.nodes.in_any_order(lanes, ray, stack, &mut visitor)
    }
}

struct Closest<'t, L: Lanes, H> {
    leaves: &'t [Leaf],
    ray: &'t Ray,
    triangles: TriangleRay<L>,
    met: &'t mut Met,
    first_hit: u32,
    is_hole: &'t H,
}

impl<L: Lanes, H: Fn(u32, &Ray) -> bool> Visit<L> for Closest<'_, L, H> {
    #[inline(always)]
    fn visit(&mut self, lanes: L, leaf: u32, t_max: &mut f32, _: &mut Stack) -> bool {
        let leaf = &self.leaves[leaf as usize];
        let at = self.triangles.meet(lanes, leaf);
        let mut bits = at.inside & lanes.lt(at.end_height, lanes.abs(at.height));
        if bits == 0 {
            return false;
        }
        let inverse_ts = lanes.div(at.covered, at.height);
        bits &= lanes.le(lanes.splat(self.met.inverse_t), inverse_ts);
        let inverse_ts = lanes.store(inverse_ts);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let (inverse_t, hit) = (inverse_ts[lane], self.first_hit + leaf.items[lane]);
            // As integers with signs, NOTHING_HIT comes before all others: what only ends at the ray's end is not hit.
            let is_before = (hit as i32) < self.met.hit as i32;
            let is_nearer =
                inverse_t > self.met.inverse_t || inverse_t == self.met.inverse_t && is_before;
            let is_cut = leaf.cutouts >> lane & 1 == 1;
            if is_nearer && !(is_cut && (self.is_hole)(leaf.items[lane], self.ray)) {
                *self.met = Met { inverse_t, hit };
                *t_max = 1.0 / inverse_t;
            }
        }
        false
    }
}

struct Any<'t, L: Lanes, H> {
    leaves: &'t [Leaf],
    ray: &'t Ray,
    triangles: TriangleRay<L>,
    is_hole: &'t H,
}

impl<L: Lanes, H: Fn(u32, &Ray) -> bool> Visit<L> for Any<'_, L, H> {
    #[inline(always)]
    fn visit(&mut self, lanes: L, leaf: u32, _: &mut f32, _: &mut Stack) -> bool {
        let leaf = &self.leaves[leaf as usize];
        let at = self.triangles.meet(lanes, leaf);
        // The ends are on different sides.
        let beyond = lanes.flip(lanes.sub(at.covered, at.height), at.height);
        let is_off_plane = lanes.lt(lanes.splat(0.0), lanes.abs(at.height));
        let mut bits = at.inside & lanes.lt(at.end_height, beyond) & is_off_plane;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            if leaf.cutouts >> lane & 1 == 0 || !(self.is_hole)(leaf.items[lane], self.ray) {
                return true;
            }
        }
        false
    }
}

/// Sorts a few boxes so that the nearest is last.
#[inline(always)]
fn sort_down(boxes: &mut [(u32, f32)]) {
    for end in 1..boxes.len() {
        let mut at = end;
        while at > 0 && boxes[at - 1].1 < boxes[at].1 {
            boxes.swap(at - 1, at);
            at -= 1;
        }
    }
}
