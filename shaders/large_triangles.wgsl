// Traces rays among all triangles, on devices without ray queries.
//
// A packet tests the large triangles, which are not in the tree, one after the other. Terms that depend only on the triangle and the rays'
// common end are computed once, one triangle per lane, and broadcast. The other triangles are in a tree of boxes: ray_tree.wgsl. A scene
// without small triangles has no tree, and its kernels have no code for one.

#import triangle_hit
#if TREE CUTOUT INSTANCED
#import ray_tree
#endif

var ray_boxes: texture_storage_2d<rgba32float, read>;

fn box_texel(index: u32) -> vec4<f32> {
    return textureLoad(ray_boxes, list_place(index));
}

fn intersect(planes: OriginPlanes, triangle: u32) {
    for (var i = 0u; i < RAYS; i++) {
        let inverse_t = inverse_t_of(planes, ray_vector[i]);
        // Not max: a triangle without area gives 0 or −0. Of these max may return −0, and the ray would end at −∞.
        let is_nearer = inverse_t > ray_inverse_t[i];
        ray_hit[i] = select(ray_hit[i], triangle, is_nearer);
        ray_inverse_t[i] = select(ray_inverse_t[i], inverse_t, is_nearer);
    }
}

fn occlude(planes: LightPlanes, triangle: u32) {
    for (var i = 0u; i < RAYS; i++) {
        let inverse_t = blocking(planes, ray_vector[i]);
#if PARALLEL
        ray_hit[i] = select(ray_hit[i], triangle, inverse_t > ray_inverse_t[i]);
#endif
        ray_inverse_t[i] = max(ray_inverse_t[i], inverse_t);
    }
}

#if PACKET
var<private> lane: u32;

#repeat LANE 8
fn origin_planes_of_LANE(mine: OriginPlanes) -> OriginPlanes {
    return OriginPlanes(subgroupBroadcast(mine.edge0, LANEu), subgroupBroadcast(mine.edge1, LANEu),
        subgroupBroadcast(mine.edge2, LANEu), subgroupBroadcast(mine.normal, LANEu));
}

fn light_planes_of_LANE(mine: LightPlanes) -> LightPlanes {
    return LightPlanes(subgroupBroadcast(mine.plane0, LANEu), subgroupBroadcast(mine.plane1, LANEu),
        subgroupBroadcast(mine.plane2, LANEu), subgroupBroadcast(mine.offsets, LANEu), subgroupBroadcast(mine.corner, LANEu),
        subgroupBroadcast(mine.normal, LANEu));
}
#endrepeat
#endif

// Traces the rays of a lane. The rays of a packet, which is the eight lanes of a subgroup, share one origin. All lanes must call this,
// whether their rays are wanted or not. Afterwards ray_inverse_t and ray_hit hold the hits.
fn trace(origin: vec3<f32>, is_any: bool) {
    let large_end = 8u * whole_number(box_texel(0u).x);
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    var first = 0u;
    loop {
#if PACKET
        let mine = planes_from_origin(corners_at(first + lane), origin, 1.0);
#repeat LANE 8
        intersect(origin_planes_of_LANE(mine), first + LANEu);
#endrepeat
        first += 8u;
#else
        intersect(planes_from_origin(corners_at(first), origin, 1.0), first);
        first++;
#endif
        continuing {
            break if first >= large_end;
        }
    }
#if TREE CUTOUT INSTANCED
    traverse(vec4<f32>(origin, 0.0), false, is_any);
#endif
}

// Finds for each ray whether something is between its start and the light. The light is the same for all lanes of a packet, and all of them
// must call this. Afterwards a ray_inverse_t above 1 is BLOCKED, or NOT_WANTED as before.
//
// For parallel rays from a light it finds the closest hit. `light_end` is then the direction of the rays.
fn trace_to_light(light_end: vec4<f32>) {
    let large_end = 8u * whole_number(box_texel(0u).x);
#if PARALLEL
    for (var i = 0u; i < RAYS; i++) {
        ray_hit[i] = NOTHING_HIT;
    }
    let is_any = false;
#else
    let is_any = true;
#endif
    var first = 0u;
    loop {
#if PACKET
        let mine = planes_to_light(corners_at(first + lane), light_end, 1.0);
#repeat LANE 8
        occlude(light_planes_of_LANE(mine), first + LANEu);
#endrepeat
        first += 8u;
#else
        occlude(planes_to_light(corners_at(first), light_end, 1.0), first);
        first++;
#endif
        continuing {
            break if first >= large_end;
        }
    }
#if TREE CUTOUT INSTANCED
    traverse(light_end, true, is_any);
#endif
}
