// Emits a ray from each pixel's P to a light.

#import direct_pixel

var<storage, read_write> rays: array<Ray>;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) global: vec3<u32>) {
    let place = place_of(global);
    if (place.x < textureDimensions(position_instance).x && place.y < parameters.row_end) {
        let pixel = pixel_at(place);
        // If P is also in a second surface, as in the corner of two walls, the ray starts on the side that the camera sees.
        let to_camera = normalize(parameters.camera_position - pixel.position);
        let start = before_surface(pixel.position, pixel.geometric_normal, ORIGIN_SHIFT) + ORIGIN_SHIFT * to_camera;
        rays[ray_index(place)] = ray_to_light(start, light_end(light), any(pixel.irradiance > vec3<f32>(0.0)));
    }
}
