// The light of the bounce that the diffuse lobe of each pixel would reflect if nothing hid the VPLs, for k_d = 1: A. Light that arrives
// varies from pixel to pixel as A does, where the part of A that is hidden varies little.

#import sampling
#import vpl_list

struct UnoccludedParameters {
    // Of one set.
    vpl_count: u32,
    first_pixel: u32,
}

var normal_geometric: texture_2d<f32>;
var<immediate> parameters: UnoccludedParameters;

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = parameters.first_pixel + 64u * (group.y * groups.x + group.x) + local;
    let size = textureDimensions(position_instance);
    if (item >= size.x * size.y) {
        return;
    }
    let pixel = vec2<u32>(item % size.x, item / size.x);
    let position = textureLoad(position_instance, pixel).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0).xyz;
    var irradiance = vec3<f32>(0.0);
    for (var i = 0u; i < parameters.vpl_count; i++) {
        let vpl = load_vpl(i);
        let offset = vpl.position - position;
        let distance_squared = dot(offset, offset);
        let direction = offset * inverseSqrt(max(distance_squared, 1e-18));
        let cosines = max(dot(normal, direction), 0.0) * max(-dot(vpl.normal, direction), 0.0);
        // A VPL stands for an area, which is a disc: so one near P does not outshine all others.
        let area = 1.0 / (f32(parameters.vpl_count) * max(vpl.density, 1e-20));
        let share = select(0.0, cosines * area / (distance_squared + area / PI), vpl.density > 0.0);
        var radiance = vpl.diffuse;
        if (SPECULAR) {
            let vpl_lobe = load_vpl_lobe(i);
            radiance += vpl_lobe.specular * eval_lobe(vpl_lobe.lobe, -direction);
        }
        irradiance += share * radiance;
    }
    textureStore(samples, pixel, UNOCCLUDED, vec4<f32>(diffuse_factor(irradiance), 1.0));
}
